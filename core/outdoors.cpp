#include "core/outdoors.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/parallel.h"
#include "core/sun.h"

namespace naturel {
namespace {

/// Side of the square of stratified directions: 32 x 32 = 1024.
constexpr std::size_t strata = 32;
constexpr std::size_t direction_count = strata * strata;

/// Directions about +z of equal projected solid angle, pi / 1024 each: the centres of the cells of a square, by the
/// concentric map to the unit disc (Shirley & Chiu 1997) lifted to the hemisphere.
std::array<glm::dvec3, direction_count> cosine_weighted_directions() {
    std::array<glm::dvec3, direction_count> directions;
    for (std::size_t i = 0; i < direction_count; ++i) {
        const double x = (2.0 * static_cast<double>(i % strata) + 1.0) / strata - 1.0;
        const double y = (2.0 * static_cast<double>(i / strata) + 1.0) / strata - 1.0;
        const bool x_leads = std::abs(x) > std::abs(y);
        const double radius = x_leads ? x : y;
        const double angle = x_leads ? pi / 4.0 * (y / x) : pi / 2.0 - pi / 4.0 * (x / y);
        directions[i] = {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1.0 - radius * radius)};
    }
    return directions;
}

LightBySource ground_luminance(const Ground& ground, const OutdoorLight& light) {
    const double sun_lx = light.direct_normal_illuminance_lx * light.sun_direction.z;
    return {(light.sky.horizontal_illuminance().value / pi) * (light.sky_colour * ground.reflectance),
            (sun_lx / pi) * (light.sun_colour * ground.reflectance)};
}

}  // namespace

LightBySource outdoor_luminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen, bool* is_sky) {
    if (is_sky) *is_sky = seen == FacetId::none && direction.z >= 0.0;
    if (seen == FacetId::none) {
        if (direction.z < 0.0) return light.ground_luminance_cd_m2;
        return {light.sky.luminance(direction).value * light.sky_colour, {}};
    }
    const Facet& facet = building.facets[index(seen)];
    const double slope = glm::dot(facet.normal, direction);
    if (facet.environment == Environment::indoor || facet.is_aperture || slope >= 0.0) return {};
    const double distance = glm::dot(facet.normal, facet.vertices_m.front() - from_m) / slope;
    const PatchId patch = grid.patch_at(facet.face, from_m + distance * direction);
    return patch == PatchId::none ? LightBySource{} : light.patch_luminance_cd_m2[index(patch)];
}

OutdoorIlluminance outdoor_illuminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                       const Visibility& visibility, const GatherPoint& point) {
    static const std::array<glm::dvec3, direction_count> local = cosine_weighted_directions();
    const PlaneFrame frame = make_plane_frame(point.position_m, point.normal);
    std::array<glm::dvec3, direction_count> directions;
    for (std::size_t i = 0; i < direction_count; ++i) {
        directions[i] = local[i].x * frame.x + local[i].y * frame.y + local[i].z * frame.normal;
    }
    std::array<FacetId, direction_count> seen;
    visibility.first_seen(point, directions, seen);

    OutdoorIlluminance sum;
    constexpr double weight_sr = pi / direction_count;
    for (std::size_t i = 0; i < direction_count; ++i) {
        bool is_sky = false;
        const LightBySource luminance =
            outdoor_luminance(light, building, grid, point.position_m, directions[i], seen[i], &is_sky);
        if (is_sky) {
            sum.sky_lx += weight_sr * luminance.sky;
        } else {
            sum.reflected_lx += weight_sr * luminance;
        }
    }

    const double cos_sun = glm::dot(point.normal, light.sun_direction);
    if (light.direct_normal_illuminance_lx > 0.0 && cos_sun > 0.0) {
        FacetId towards_sun{};
        visibility.first_seen(point, {&light.sun_direction, 1}, {&towards_sun, 1});
        if (towards_sun == FacetId::none) 
            sum.sun_lx = (light.direct_normal_illuminance_lx * cos_sun) * light.sun_colour;
    }
    return sum;
}

OutdoorLight light_outdoors(const Scene& scene, const Building& building, const PatchGrid& grid,
                            const Visibility& visibility, Progress& progress) {
    const SunDescription sun = scene.sun.value_or(SunDescription{});
    const glm::dvec3 sun_direction =
        scene.sun ? direction_from_angles(sun.altitude_rad, sun.azimuth_rad) : glm::dvec3{0, 0, 1};
    const Sky sky(scene.sky, sun_direction);
    const double direct_normal_lx = sun_direction.z > 0.0 ? sun.direct_normal_illuminance_lx : 0.0;
    OutdoorLight light{.sky = sky,
                       .sun_direction = sun_direction,
                       .direct_normal_illuminance_lx = direct_normal_lx,
                       .sky_colour = scene.sky.colour.band,
                       .sun_colour = sun.colour.band,
                       .patch_luminance_cd_m2 = std::vector<LightBySource>(grid.patches.size())};
    light.ground_luminance_cd_m2 = ground_luminance(scene.ground, light);

    // While the patches are being lit they see each other dark: one reflection.
    std::vector<LightBySource> luminance(grid.patches.size());
    const std::size_t first = grid.gather_patch_count;
    parallel_stage("outdoors", grid.patches.size() - first, 1, progress, [&](std::size_t i) {
        const Patch& patch = grid.patches[first + i];
        const OutdoorIlluminance lit =
            outdoor_illuminance(light, building, grid, visibility, {patch.centroid_m, patch.normal});
        const Material& material = scene.materials[index(building.faces[index(patch.face)].material)];
        const LightBySource arriving = LightBySource{lit.sky_lx, lit.sun_lx} + lit.reflected_lx;
        luminance[first + i] = {(1.0 / pi) * (material.reflectance * arriving.sky),
                                (1.0 / pi) * (material.reflectance * arriving.other + material.exitance_lm_m2)};
    });
    light.patch_luminance_cd_m2 = std::move(luminance);
    return light;
}

}  // namespace naturel
