#include "core/method_combinations.h"

#include "core/parallel.h"

namespace naturel {

MethodCombinations::MethodCombinations(const Scene& scene, const Building& building, const PatchGrid& grid,
                                       const RadiosityOptions& radiosity, Progress& progress)
    : scene_(scene), building_(building), grid_(grid), radiosity_(radiosity), progress_(progress), primaries_(scene.primaries),
      sensors_(place_sensors(scene, building)) {}

MethodCombinations::Direct MethodCombinations::direct(const Visibility& visibility, const DirectOptions& rule) const {
    Scene scene = scene_;
    scene.direct = rule;
    Direct direct{compute_direct_light(scene, building_, grid_, visibility, progress_),
                  std::vector<DirectIlluminance>(sensors_.size())};
    const DirectLight light(scene, building_, grid_, direct.grid.outdoors, visibility);
    parallel_stage("direct light at sensors", sensors_.size(), 4, progress_, [&](std::size_t s) {
        if (sensors_[s].medium == Medium::indoor_air) direct.sensors[s] = light.at(sensors_[s].point);
    });
    return direct;
}

MethodCombinations::Gathering MethodCombinations::gathering_at_sensors(const Visibility& visibility) const {
    Gathering rows{std::vector<FormFactorRow>(sensors_.size()), {}};
    parallel_stage("gathering at sensors", sensors_.size(), 2, progress_, [&](std::size_t s) {
        if (sensors_[s].medium == Medium::indoor_air) visibility.gather_row(sensors_[s].point, rows.sensors[s]);
    });
    return rows;
}

MethodCombinations::Gathering MethodCombinations::gathering(const Visibility& visibility) const {
    Gathering rows = gathering_at_sensors(visibility);
    rows.nodes.resize(grid_.nodes.size());
    parallel_stage("gathering at nodes", grid_.nodes.size(), 4, progress_, [&](std::size_t n) {
        const Node& node = grid_.nodes[n];
        visibility.gather_row({node.gather_position_m, building_.faces[index(node.face)].normal}, rows.nodes[n]);
    });
    return rows;
}

DaylightSolution MethodCombinations::solution(const FormFactors& form_factors, const Direct& direct, const Gathering& gathering,
                                              IndirectMethod indirect, FormFactorRepair repair) const {
    DaylightSolution found{.outdoors = direct.grid.outdoors};
    found.radiosity = compute_interreflection(scene_, building_, grid_, form_factors, direct.grid, radiosity_, progress_);
    found.patch_direct_lx = direct.grid.patch_direct_lx;
    found.patch_components = direct.grid.patch_components;
    found.form_factor_quality = form_factors.quality;
    const std::span<const LightBySource> exitance_lm_m2 = found.radiosity.exitance_lm_m2;
    found.sensors = sensors_;
    found.sensor_values.resize(sensors_.size());
    for (std::size_t s = 0; s < sensors_.size(); ++s)
        if (sensors_[s].medium == Medium::indoor_air)
            found.sensor_values[s] = {direct.sensors[s], collect(gathering.sensors[s], exitance_lm_m2, repair)};
    std::vector<LightBySource> nodes(grid_.nodes.size());
    if (indirect == IndirectMethod::patch) {
        nodes = mean_of_patches_at_nodes(grid_, found.radiosity.indirect_illuminance_lx);
    } else {
        for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] = collect(gathering.nodes[n], exitance_lm_m2, repair);
    }
    for (std::size_t n = 0; n < nodes.size(); ++n) found.nodes.push_back({direct.grid.nodes[n], nodes[n]});
    return found;
}

LightState MethodCombinations::state(const DaylightSolution& solution) const {
    LightState state;
    for (const PointIlluminance& point : solution.sensor_values) state.sensors.push_back(components(point));
    for (const PointIlluminance& point : solution.nodes) state.nodes.push_back(components(point));
    for (const LightBySource& exitance : solution.radiosity.exitance_lm_m2)
        state.patch_exitance_lm_m2.push_back(primaries_.luminous(exitance.total()));
    return state;
}

ComponentsAndTotal MethodCombinations::components(const PointIlluminance& point) const {
    const DirectIlluminance& direct = point.direct;
    ComponentsAndTotal found{{primaries_.luminous(direct.sky_lx), primaries_.luminous(direct.sun_lx),
                      primaries_.luminous(direct.outdoor_lx.total()), primaries_.luminous(point.indirect_lx.total()), 0.0,
                      primaries_.luminous(point.from_sky_lx())}};
    found.lx[ComponentsAndTotal::total_index] = found.lx[0] + found.lx[1] + found.lx[2] + found.lx[3];
    return found;
}

}  // namespace naturel
