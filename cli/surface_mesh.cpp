#include "cli/surface_mesh.h"

#include <cmath>
#include <utility>

#include "core/tone_mapping.h"
#include "core/units.h"

namespace naturel {
namespace {

SurfaceLight light_of(const Result& result, const PointIlluminance& point, const Band3& luminance_cd_m2) {
    return {.parts = components_of(result.primaries, point.direct, point.indirect_lx),
            .total_lx = point.total_lx(),
            .daylight_factor_percent = daylight_factor_percent(result, point).value_or(0.0),
            .luminance_cd_m2 = luminance_cd_m2};
}

SurfaceLight light_of_node(const Result& result, std::size_t n) {
    const PointIlluminance& point = result.solution.nodes[n];
    const Face& face = result.building.faces[index(result.grid.nodes[n].face)];
    const Material& material = result.scene.materials[index(face.material)];
    return light_of(result, point, 1.0 / pi * (material.reflectance * point.total_lx() + material.exitance_lm_m2));
}

SurfaceLight light_of_patch(const Result& result, std::size_t p) {
    const DaylightSolution& solution = result.solution;
    if (p >= result.grid.gather_patch_count) return {.luminance_cd_m2 = solution.outdoors.patch_luminance_cd_m2[p].total()};
    return light_of(result, {solution.patch_components[p], solution.radiosity.indirect_illuminance_lx[p]},
                    1.0 / pi * solution.radiosity.exitance_lm_m2[p].total());
}

void add(SurfaceLight& sum, double weight, const SurfaceLight& light) {
    for (const auto part : {&Components::sky_lx, &Components::sun_lx, &Components::erc_ground_lx, &Components::erc_buildings_lx,
                            &Components::irc_lx})
        sum.parts.*part += weight * (light.parts.*part);
    sum.total_lx += weight * light.total_lx;
    sum.daylight_factor_percent += weight * light.daylight_factor_percent;
    sum.luminance_cd_m2 += weight * light.luminance_cd_m2;
}

}  // namespace

double SurfaceLight::illuminance_lx() const {
    return parts.sky_lx + parts.sun_lx + parts.erc_ground_lx + parts.erc_buildings_lx + parts.irc_lx;
}

SurfaceMesh make_surface_mesh(const Result& result) {
    const PatchGrid& grid = result.grid;
    SurfaceMesh mesh;
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
        mesh.positions_m.push_back(grid.nodes[n].position_m);
        mesh.light.push_back(light_of_node(result, n));
    }
    std::vector<double> weights;
    for (std::size_t p = 0; p < grid.patches.size(); ++p) {
        const Patch& patch = grid.patches[p];
        mesh.patch_light.push_back(light_of_patch(result, p));
        for (std::size_t c = patch.first_corner; c < patch.first_corner + patch.corner_count; ++c) {
            if (p < grid.indoor_patch_count) {
                mesh.outlines.push_back(static_cast<std::uint32_t>(index(grid.corners[c])));
                continue;
            }
            mesh.outlines.push_back(static_cast<std::uint32_t>(mesh.positions_m.size()));
            mesh.positions_m.push_back(grid.corner_positions_m[c]);
            mesh.light.push_back(p < grid.gather_patch_count
                                     ? mesh.patch_light[p]
                                     : SurfaceLight{.luminance_cd_m2 = result.solution.outdoors.corner_luminance_cd_m2[c].total()});
        }
        mesh.first.push_back(static_cast<std::uint32_t>(mesh.outlines.size()));
        weights.resize(patch.corner_count);
        grid.interpolation_weights(make_id<PatchId>(p), patch.centroid_m, weights);
        SurfaceLight& centre = mesh.centre_light.emplace_back();
        for (std::size_t k = 0; k < weights.size(); ++k) add(centre, weights[k], mesh.light[mesh.outline_of(p)[k]]);
    }
    return mesh;
}

double white_of_patches_cd_m2(const Result& result, const SurfaceMesh& mesh, std::size_t first, std::size_t last) {
    constexpr double pixels = 1e5;
    double area_m2 = 0.0;
    for (std::size_t p = first; p < last; ++p) area_m2 += result.grid.patches[p].area_m2;
    std::vector<double> luminance;
    for (std::size_t p = first; p < last; ++p)
        luminance.insert(luminance.end(),
                         static_cast<std::size_t>(std::ceil(pixels * result.grid.patches[p].area_m2 / area_m2)),
                         result.primaries.luminous(mesh.patch_light[p].luminance_cd_m2));
    return white_luminance_cd_m2(std::move(luminance), {});
}

}  // namespace naturel
