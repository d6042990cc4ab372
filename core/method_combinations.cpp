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

LightState MethodCombinations::state(const FormFactors& form_factors, const Direct& direct, const Gathering& gathering,
                                     IndirectMethod indirect, FormFactorRepair repair) const {
    const RadiositySolution radiosity =
        compute_interreflection(scene_, building_, grid_, form_factors, direct.grid, radiosity_, progress_);
    const std::span<const LightBySource> exitance_lm_m2 = radiosity.exitance_lm_m2;
    LightState state;
    for (std::size_t s = 0; s < sensors_.size(); ++s) {
        const bool indoors = sensors_[s].medium == Medium::indoor_air;
        state.sensors.push_back(
            indoors ? components(direct.sensors[s], collect(gathering.sensors[s], exitance_lm_m2, repair)) : Components{});
    }
    std::vector<LightBySource> nodes(grid_.nodes.size());
    if (indirect == IndirectMethod::patch) {
        nodes = mean_of_patches_at_nodes(grid_, radiosity.indirect_illuminance_lx);
    } else {
        for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] = collect(gathering.nodes[n], exitance_lm_m2, repair);
    }
    for (std::size_t n = 0; n < nodes.size(); ++n) state.nodes.push_back(components(direct.grid.nodes[n], nodes[n]));
    for (const LightBySource& exitance : exitance_lm_m2)
        state.patch_exitance_lm_m2.push_back(primaries_.luminous(exitance.total()));
    return state;
}

Components MethodCombinations::components(const DirectIlluminance& direct, const LightBySource& indirect_lx) const {
    Components found{{primaries_.luminous(direct.sky_lx), primaries_.luminous(direct.sun_lx),
                      primaries_.luminous(direct.outdoor_lx.total()), primaries_.luminous(indirect_lx.total()), 0.0}};
    found.lx[4] = found.lx[0] + found.lx[1] + found.lx[2] + found.lx[3];
    return found;
}

}  // namespace naturel
