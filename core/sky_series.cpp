#include "core/sky_series.h"

#include <utility>

#include "core/errors.h"
#include "core/sun_on_patches.h"

namespace naturel {

struct SkySeries::Implementation {
    DaylightSolution solve(const Scene& scene) const {
        NoProgress progress;
        DirectSolution direct = compute_direct_light(scene, building, grid, visibility, progress);
        if (direct.outdoors.direct_normal_illuminance_lx > 0.0) {
            const SunBeam sun{direct.outdoors.sun_direction, direct.outdoors.direct_normal_illuminance_lx, direct.outdoors.sun_colour};
            for (std::size_t p = 0; p < grid.indoor_patch_count; ++p)
                direct.patch_direct_lx[p].other = direct.patch_components[p].outdoor_lx.other;
            for (const SunOnPatches::LitPatch& lit : sun_on_patches.lit_by(scene, sun))
                direct.patch_direct_lx[index(lit.patch)].other += lit.mean_lx;
        }
        RadiositySolution radiosity =
            compute_interreflection(scene, building, grid, form_factors, direct, options.radiosity, progress);
        DaylightSolution solution{.outdoors = std::move(direct.outdoors)};
        solution.sensors = sensors;
        solution.form_factor_quality = form_factors.quality;
        solution.sensor_values = light_on_sensors(scene, building, grid, visibility, solution.outdoors, radiosity, options, sensors,
                                                  progress);
        solution.radiosity = std::move(radiosity);
        solution.radiosity.exitance_lm_m2.clear();
        solution.radiosity.indirect_illuminance_lx.clear();
        return solution;
    }

    const Building& building;
    const PatchGrid& grid;
    const Visibility& visibility;
    const FormFactors& form_factors;
    std::vector<Sensor> sensors;
    DaylightOptions options;
    SunOnPatches sun_on_patches{building, grid};
};

SkySeries::SkySeries(const Scene&, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                     const FormFactors& form_factors, std::vector<Sensor> sensors, const DaylightOptions& options, Progress&)
    : implementation_(new Implementation{building, grid, visibility, form_factors, std::move(sensors), options}) {}

SkySeries::~SkySeries() = default;

std::vector<DaylightSolution> SkySeries::solve(std::span<const Scene> variants, Progress& progress) {
    progress.begin("series", variants.size());
    std::vector<DaylightSolution> solutions;
    for (const Scene& variant : variants) {
        solutions.push_back(implementation_->solve(variant));
        progress.advance(1);
        if (progress.interrupted()) break;
    }
    progress.end();
    if (progress.interrupted()) throw Interrupted();
    return solutions;
}

}  // namespace naturel
