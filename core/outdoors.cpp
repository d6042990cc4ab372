#include "core/outdoors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <tuple>

#include "core/direct_integrators.h"
#include "core/directional_light.h"
#include "core/parallel.h"
#include "core/sun.h"

namespace naturel {
namespace {

/// Corners are gathered for this far inside their patches, so that none sits inside a neighbouring wall.
constexpr double inwards_m = 1e-3;

LightBySource ground_luminance(const Ground& ground, const OutdoorLight& light) {
    const double sun_lx = light.direct_normal_illuminance_lx * light.sun_direction.z;
    return {(light.sky.horizontal_illuminance().value / pi) * (light.sky_colour * ground.reflectance),
            (sun_lx / pi) * (light.sun_colour * ground.reflectance)};
}

/// Whether the sun shines on a point, 1 or 0.
double sees_sun(const OutdoorLight& light, const Visibility& visibility, const GatherPoint& point) {
    FacetId towards_sun{};
    visibility.first_seen(point, {&light.sun_direction, 1}, {&towards_sun, 1});
    return towards_sun == FacetId::none ? 1.0 : 0.0;
}

OutdoorIlluminance gather_open_air(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                   const FacetTree& tree, const Visibility& visibility, const GatherPoint& point,
                                   double tolerance, AdaptiveScratch& scratch) {
    const SkyAndOutdoors found =
        integrate_open_air(point, OpenAirLight(light, building, grid), tree, tolerance, visibility, scratch);
    return {.sky_lx = found.sky_lx, .sun_lx = {}, .reflected_lx = found.outdoor_lx, .ground_lx = found.ground_lx};
}

/// A place beside a patch, by rounding or because it was taken from the edge of a facet, drawn to its outline.
/// Interpolation weights lose their digits closer to an edge than some 1e-7 of it.
glm::dvec3 drawn_inside(std::span<const glm::dvec3> polygon, const Patch& patch, const glm::dvec3& place) {
    double share = 1.0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const glm::dvec3 inwards = glm::cross(patch.normal, polygon[(k + 1) % polygon.size()] - polygon[k]);
        const double height = glm::dot(inwards, place - polygon[k]), centre = glm::dot(inwards, patch.centroid_m - polygon[k]);
        if (height < 0.0 && centre > 0.0) share = std::min(share, centre / (centre - height));
    }
    return patch.centroid_m + (1.0 - 1e-5) * share * (place - patch.centroid_m);
}

/// Lights ground and faces, pass by pass.
class OutdoorLighting {
public:
    OutdoorLighting(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                    const OutdoorSurfaces& surfaces, const OutdoorGather& gather, Progress& progress, OutdoorLight& light)
        : scene_(scene), building_(building), grid_(grid), visibility_(visibility), surfaces_(surfaces), gather_(gather),
          progress_(progress), light_(light), first_patch_(grid.gather_patch_count), sun_share_(surfaces.nodes.size(), 0.0) {
        light_.corner_luminance_cd_m2.resize(surfaces.node_of_corner.size());
        light_.patch_luminance_cd_m2.resize(grid.patches.size());
        light_.ground_lattice = surfaces.lattice;
        light_.lattice_luminance_cd_m2.assign(surfaces.lattice.nodes.size(), light_.ground_luminance_cd_m2);
        // What the emitting surfaces give by themselves, they give from the start.
        for (const OutdoorSurfaces::Node& node : surfaces.nodes)
            node_luminance_.push_back({{}, (1.0 / pi) * material_of(node.face).exitance_lm_m2});
        spread_to_corners();
    }

    void light_all() {
        find_sun();
        for (int pass = 0; pass <= scene_.outdoors.interreflections; ++pass) {
            if (!light_.ground_lattice.nodes.empty()) light_ground();
            light_faces(pass == 0);
        }
        for (std::size_t p = first_patch_; p < grid_.patches.size(); ++p) {
            const Patch& patch = grid_.patches[p];
            LightBySource sum;
            for (std::size_t k = 0; k < patch.corner_count; ++k)
                sum += light_.corner_luminance_cd_m2[patch.first_corner + k];
            light_.patch_luminance_cd_m2[p] = 1.0 / patch.corner_count * sum;
        }
    }

private:
    const Material& material_of(FaceId face) const {
        return scene_.materials[index(building_.faces[index(face)].material)];
    }

    void spread_to_corners() {
        const std::vector<std::size_t>& node_of_corner = surfaces_.node_of_corner;
        for (std::size_t k = 0; k < node_of_corner.size(); ++k)
            if (node_of_corner[k] != OutdoorSurfaces::no_node) light_.corner_luminance_cd_m2[k] = node_luminance_[node_of_corner[k]];
    }

    /// The share of each patch that the sun reaches, judged in one place for each of its sides; the nodes take the mean of their
    /// patches, which spreads the edge of a shadow over a cell but keeps its light.
    void find_sun() {
        if (light_.direct_normal_illuminance_lx <= 0.0) return;
        std::vector<double> share(grid_.patches.size() - first_patch_, 0.0);
        parallel_stage("sun outdoors", share.size(), 16, progress_, [&](std::size_t i) {
            const Patch& patch = grid_.patches[first_patch_ + i];
            if (glm::dot(patch.normal, light_.sun_direction) <= 0.0) return;
            const auto polygon = grid_.polygon_of(make_id<PatchId>(first_patch_ + i));
            double sum = 0.0;
            for (std::size_t k = 0; k < polygon.size(); ++k) {
                const glm::dvec3 middle = (polygon[k] + polygon[(k + 1) % polygon.size()] + patch.centroid_m) / 3.0;
                sum += sees_sun(light_, visibility_, {middle, patch.normal});
            }
            share[i] = sum / static_cast<double>(polygon.size());
        });
        std::vector<double> area(surfaces_.nodes.size(), 0.0);
        for (std::size_t i = 0; i < share.size(); ++i) {
            const Patch& patch = grid_.patches[first_patch_ + i];
            for (std::size_t k = 0; k < patch.corner_count; ++k) {
                const std::size_t n = surfaces_.node_of_corner[patch.first_corner + k];
                sun_share_[n] += patch.area_m2 * share[i];
                area[n] += patch.area_m2;
            }
        }
        for (std::size_t n = 0; n < area.size(); ++n) sun_share_[n] /= area[n];

        // The ground likewise: four places in each cell.
        const GroundLattice& lattice = light_.ground_lattice;
        if (lattice.nodes.empty()) return;
        const std::size_t columns = lattice.x_m.size() - 1, rows = lattice.y_m.size() - 1;
        std::vector<double> cell_share(columns * rows);
        parallel_stage("sun on the ground", cell_share.size(), 16, progress_, [&](std::size_t c) {
            const std::size_t i = c % columns, j = c / columns;
            double sum = 0.0;
            for (const auto& [s, t] : {std::pair{0.25, 0.25}, std::pair{0.75, 0.25}, std::pair{0.25, 0.75}, std::pair{0.75, 0.75}}) {
                const glm::dvec3 place{std::lerp(lattice.x_m[i], lattice.x_m[i + 1], s),
                                       std::lerp(lattice.y_m[j], lattice.y_m[j + 1], t), lattice.nodes[0].position_m.z};
                sum += sees_sun(light_, visibility_, {place, {0, 0, 1}});
            }
            cell_share[c] = 0.25 * sum;
        });
        ground_sun_share_.assign(lattice.nodes.size(), 0.0);
        for (std::size_t n = 0; n < lattice.nodes.size(); ++n) {
            const std::size_t i = n % lattice.x_m.size(), j = n / lattice.x_m.size();
            double sum = 0.0, cells_m2 = 0.0;
            for (const std::size_t cj : {j - 1, j}) {
                for (const std::size_t ci : {i - 1, i}) {
                    if (ci >= columns || cj >= rows) continue;
                    // Of the cells under buildings nothing is known.
                    const glm::dvec3 middle{0.5 * (lattice.x_m[ci] + lattice.x_m[ci + 1]), 0.5 * (lattice.y_m[cj] + lattice.y_m[cj + 1]),
                                            lattice.nodes[0].position_m.z};
                    if (medium_at(scene_, middle) != Medium::outdoor_air) continue;
                    const double area_m2 = (lattice.x_m[ci + 1] - lattice.x_m[ci]) * (lattice.y_m[cj + 1] - lattice.y_m[cj]);
                    sum += area_m2 * cell_share[cj * columns + ci];
                    cells_m2 += area_m2;
                }
            }
            ground_sun_share_[n] = cells_m2 > 0.0 ? sum / cells_m2 : 0.0;
        }
    }

    void light_ground() {
        const GroundLattice& lattice = light_.ground_lattice;
        std::vector<LightBySource> luminance(lattice.nodes.size());
        parallel_stage("light on the ground", lattice.nodes.size(), 4, progress_, [&](std::size_t n) {
            if (!lattice.nodes[n].open) return;
            const OutdoorIlluminance lit = gather_.at_lattice(light_, n);
            LightBySource arriving = LightBySource{lit.sky_lx, {}} + lit.reflected_lx;
            if (!ground_sun_share_.empty())
                arriving.other += (ground_sun_share_[n] * light_.direct_normal_illuminance_lx * light_.sun_direction.z) * light_.sun_colour;
            luminance[n] = (1.0 / pi) * (scene_.ground.reflectance * arriving);
        });
        lattice.fill_closed(luminance);
        light_.lattice_luminance_cd_m2 = std::move(luminance);
    }

    /// first: the faces see each other dark but for what they emit, which is not yet reflected: one reflection of sky and sun.
    void light_faces(bool first) {
        std::vector<LightBySource> luminance(surfaces_.nodes.size());
        parallel_stage(first ? "outdoors" : "outdoor interreflection", surfaces_.nodes.size(), 4, progress_, [&](std::size_t n) {
            const OutdoorSurfaces::Node& node = surfaces_.nodes[n];
            const OutdoorIlluminance lit = gather_.at_face(light_, n);
            const double sun_lx = light_.direct_normal_illuminance_lx * sun_share_[n] *
                                  std::max(0.0, glm::dot(node.point.normal, light_.sun_direction));
            const Material& material = material_of(node.face);
            const LightBySource arriving = LightBySource{lit.sky_lx, sun_lx * light_.sun_colour} + lit.reflected_lx;
            luminance[n] = {(1.0 / pi) * (material.reflectance * arriving.sky),
                            (1.0 / pi) * (material.reflectance * arriving.other + material.exitance_lm_m2)};
        });
        node_luminance_ = std::move(luminance);
        spread_to_corners();
    }

    const Scene& scene_;
    const Building& building_;
    const PatchGrid& grid_;
    const Visibility& visibility_;
    const OutdoorSurfaces& surfaces_;
    const OutdoorGather& gather_;
    Progress& progress_;
    OutdoorLight& light_;
    std::size_t first_patch_;
    std::vector<LightBySource> node_luminance_;  ///< [surfaces_.nodes]
    std::vector<double> sun_share_;              ///< [surfaces_.nodes] of the sun's light, mean of the patches around
    std::vector<double> ground_sun_share_;       ///< [lattice nodes]; empty without sun
};

}  // namespace

OutdoorSource outdoor_source(const Building& building, const glm::dvec3& direction, FacetId seen) {
    if (seen == FacetId::none) return direction.z < 0.0 ? OutdoorSource::ground : OutdoorSource::sky;
    const Facet& facet = building.facets[index(seen)];
    const bool dark = facet.environment == Environment::indoor || facet.is_aperture || glm::dot(facet.normal, direction) >= 0.0;
    return dark ? OutdoorSource::dark : OutdoorSource::building;
}

OutdoorPlace find_outdoor_place(const Building& building, const PatchGrid& grid, const GroundLattice& lattice,
                                const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen) {
    OutdoorPlace place{.source = outdoor_source(building, direction, seen)};
    if (place.source == OutdoorSource::ground) {
        const double distance = (building.ground_z_m - from_m.z) / direction.z;
        place.open_ground = lattice.nodes.empty() || !(distance > 0.0) ||
                            !lattice.find(from_m.x + distance * direction.x, from_m.y + distance * direction.y, place.on_lattice);
    }
    if (place.source != OutdoorSource::building) return place;
    const Facet& facet = building.facets[index(seen)];
    const double distance = glm::dot(facet.normal, facet.vertices_m.front() - from_m) / glm::dot(facet.normal, direction);
    if (!(distance < 1e12)) return place;  // edge on
    const glm::dvec3 at = from_m + distance * direction;
    place.patch = grid.patch_at(facet.face, at);
    if (place.patch == PatchId::none) return place;
    const Patch& patch = grid.patches[index(place.patch)];
    if (patch.corner_count <= OutdoorPlace::most_corners)
        grid.interpolation_weights(place.patch, drawn_inside(grid.polygon_of(place.patch), patch, at),
                                   {place.corner_weights.data(), patch.corner_count});
    return place;
}

LightBySource outdoor_luminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen) {
    const OutdoorPlace place = find_outdoor_place(building, grid, light.ground_lattice, from_m, direction, seen);
    switch (place.source) {
        case OutdoorSource::dark:
            return {};
        case OutdoorSource::sky:
            return {light.sky.luminance(direction).value * light.sky_colour, {}};
        case OutdoorSource::ground:
            return place.open_ground ? light.ground_luminance_cd_m2
                                     : light.ground_lattice.interpolate(place.on_lattice, light.lattice_luminance_cd_m2);
        case OutdoorSource::building:
            break;
    }
    if (place.patch == PatchId::none) return {};
    const Patch& patch = grid.patches[index(place.patch)];
    if (patch.corner_count > OutdoorPlace::most_corners) return light.patch_luminance_cd_m2[index(place.patch)];
    LightBySource sum;
    for (std::size_t k = 0; k < patch.corner_count; ++k)
        sum += place.corner_weights[k] * light.corner_luminance_cd_m2[patch.first_corner + k];
    return sum;
}

Band3 sun_in_open_air(const OutdoorLight& light, const Visibility& visibility, const GatherPoint& point) {
    const double cos_sun = glm::dot(point.normal, light.sun_direction);
    if (light.direct_normal_illuminance_lx <= 0.0 || cos_sun <= 0.0) return {};
    return (light.direct_normal_illuminance_lx * cos_sun * sees_sun(light, visibility, point)) * light.sun_colour;
}

OutdoorIlluminance outdoor_illuminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                       const FacetTree& tree, const Visibility& visibility, const GatherPoint& point,
                                       double tolerance) {
    AdaptiveScratch scratch;
    OutdoorIlluminance found = gather_open_air(light, building, grid, tree, visibility, point, tolerance, scratch);
    found.sun_lx = sun_in_open_air(light, visibility, point);
    return found;
}

OutdoorSurfaces find_outdoor_surfaces(const Scene& scene, const Building& building, const PatchGrid& grid) {
    struct Corner {
        FaceId face;
        std::array<std::int64_t, 3> place_um;
        std::size_t corner, patch;
    };
    std::vector<Corner> corners;
    for (std::size_t p = grid.gather_patch_count; p < grid.patches.size(); ++p) {
        const Patch& patch = grid.patches[p];
        for (std::size_t k = patch.first_corner; k < patch.first_corner + patch.corner_count; ++k) {
            const glm::dvec3& at = grid.corner_positions_m[k];
            corners.push_back({patch.face, {std::llround(at.x * 1e6), std::llround(at.y * 1e6), std::llround(at.z * 1e6)}, k, p});
        }
    }
    std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
        return std::tie(a.face, a.place_um, a.corner) < std::tie(b.face, b.place_um, b.corner);
    });
    OutdoorSurfaces found;
    found.node_of_corner.resize(grid.corner_positions_m.size(), OutdoorSurfaces::no_node);
    for (std::size_t i = 0; i < corners.size();) {
        const glm::dvec3 at = grid.corner_positions_m[corners[i].corner];
        glm::dvec3 inwards{};
        std::size_t end = i;
        for (; end < corners.size() && corners[end].face == corners[i].face && corners[end].place_um == corners[i].place_um; ++end) {
            const glm::dvec3 to_centroid = grid.patches[corners[end].patch].centroid_m - at;
            inwards += std::min(0.1, inwards_m / std::max(1e-12, glm::length(to_centroid))) * to_centroid;
            found.node_of_corner[corners[end].corner] = found.nodes.size();
        }
        const glm::dvec3& normal = building.faces[index(corners[i].face)].normal;
        found.nodes.push_back({corners[i].face, {at + inwards, normal}, corners[i].corner});
        i = end;
    }
    if (scene.ground.shadows) found.lattice = make_ground_lattice(scene, building, scene.grid.outdoor_spacing_m);
    return found;
}

OutdoorLight outdoor_sources(const Scene& scene) {
    const SunDescription sun = scene.sun.value_or(SunDescription{});
    const glm::dvec3 sun_direction =
        scene.sun ? direction_from_angles(sun.altitude_rad, sun.azimuth_rad) : glm::dvec3{0, 0, 1};
    const Sky sky(scene.sky, sun_direction);
    const double direct_normal_lx = sun_direction.z > 0.0 ? sun.direct_normal_illuminance_lx : 0.0;
    OutdoorLight light{.sky = sky,
                       .sun_direction = sun_direction,
                       .direct_normal_illuminance_lx = direct_normal_lx,
                       .sky_colour = scene.sky.colour.band,
                       .sun_colour = sun.colour.band};
    light.ground_luminance_cd_m2 = ground_luminance(scene.ground, light);
    return light;
}

void light_surfaces(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                    const OutdoorSurfaces& surfaces, const OutdoorGather& gather, Progress& progress, OutdoorLight& light) {
    OutdoorLighting(scene, building, grid, visibility, surfaces, gather, progress, light).light_all();
}

OutdoorLight light_outdoors(const Scene& scene, const Building& building, const PatchGrid& grid,
                            const Visibility& visibility, Progress& progress) {
    OutdoorLight light = outdoor_sources(scene);
    const OutdoorSurfaces surfaces = find_outdoor_surfaces(scene, building, grid);
    const FacetTree tree(building);
    // Errors of nodes average out where a point sees many of them: 1e-3 is fine enough.
    const double tolerance = std::max(1e-3, scene.direct.tolerance);
    ThreadScratch<AdaptiveScratch> scratch;
    const auto gather_at = [&](const OutdoorLight& so_far, const GatherPoint& point) {
        return gather_open_air(so_far, building, grid, tree, visibility, point, tolerance, scratch.local());
    };
    const OutdoorGather gather{
        .at_lattice = [&](const OutdoorLight& so_far,
                          std::size_t n) { return gather_at(so_far, {surfaces.lattice.nodes[n].position_m, {0, 0, 1}}); },
        .at_face = [&](const OutdoorLight& so_far, std::size_t n) { return gather_at(so_far, surfaces.nodes[n].point); }};
    light_surfaces(scene, building, grid, visibility, surfaces, gather, progress, light);
    return light;
}

}  // namespace naturel
