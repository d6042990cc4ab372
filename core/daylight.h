#pragma once
#include <vector>

#include "core/direct.h"
#include "core/form_factors.h"
#include "core/radiosity.h"
#include "core/sensors.h"
#include "core/stage_clock.h"

namespace naturel {

enum class IndirectMethod {
    patch,   ///< the article: each node takes the mean IRC of its patches; sensors in the air gather all the same
    gather,  ///< gathered at the point itself through the visibility interface
};

struct DaylightOptions {
    FormFactorOptions form_factors{};
    RadiosityOptions radiosity{};
    IndirectMethod node_indirect = IndirectMethod::patch;
    IndirectMethod sensor_indirect = IndirectMethod::gather;
};

/// Light on a point: a node or a sensor.
struct PointIlluminance {
    DirectIlluminance direct{};
    LightBySource indirect_lx{};  ///< internally reflected component (IRC)

    Band3 total_lx() const { return direct.by_source().total() + indirect_lx.total(); }
    /// What the sky causes, directly and by reflection: the numerator of the daylight factor.
    Band3 from_sky_lx() const { return direct.by_source().sky + indirect_lx.sky; }
};

/// Direct light on the grid: depends on sky, sun and glazing, but on no reflectance indoors.
struct DirectSolution {
    OutdoorLight outdoors;
    std::vector<DirectIlluminance> nodes{};             ///< [grid.nodes]
    std::vector<LightBySource> patch_direct_lx{};       ///< [gather_patch_count], mean over the patch
    std::vector<DirectIlluminance> patch_components{};  ///< [gather_patch_count], the same by component
    /// What panes send back into the room of the direct light that falls on them: [patches of apertures].
    std::vector<LightBySource> pane_exitance_lm_m2{};
};

/// The daylight in a building by one visibility method.
struct DaylightSolution {
    OutdoorLight outdoors;
    std::vector<PointIlluminance> nodes{};              ///< [grid.nodes]
    std::vector<LightBySource> patch_direct_lx{};       ///< [gather_patch_count], mean over the patch
    std::vector<DirectIlluminance> patch_components{};  ///< [gather_patch_count], the same by component
    std::vector<Sensor> sensors{};
    std::vector<PointIlluminance> sensor_values{};      ///< [sensors]
    RadiositySolution radiosity{};
    FormFactorQuality form_factor_quality{};
    FormFactorRepair repair = FormFactorRepair::reciprocal;  ///< of rows: what collect() at another point needs
    std::vector<StageTime> stages{};  ///< what each step took
};

// The steps of the calculation. Form factors (compute_form_factors) depend on geometry alone: one set serves every sky, sun and
// reflectance.

DirectSolution compute_direct_light(const Scene& scene, const Building& building, const PatchGrid& grid,
                                    const Visibility& visibility, Progress& progress);

RadiositySolution compute_interreflection(const Scene& scene, const Building& building, const PatchGrid& grid,
                                          const FormFactors& form_factors, const DirectSolution& direct,
                                          const RadiosityOptions& options, Progress& progress);

/// The mean of the patches that meet at each node, weighted by their area: the article's IRC of nodes. [grid.nodes]
/// patch_values: [indoor_patch_count] or more.
std::vector<LightBySource> mean_of_patches_at_nodes(const PatchGrid& grid, std::span<const LightBySource> patch_values);

/// IRC at the nodes, [grid.nodes].
std::vector<LightBySource> indirect_on_nodes(const Building& building, const PatchGrid& grid, const Visibility& visibility,
                                             const RadiositySolution& radiosity, const DaylightOptions& options,
                                             Progress& progress);

/// What a point collects from the exitance of what it sees, lx. row: of gather_row().
LightBySource collect(const FormFactorRow& row, std::span<const LightBySource> exitance_lm_m2, FormFactorRepair repair);

/// The whole calculation but for assembly and grid.
DaylightSolution compute_daylight(const Scene& scene, const Building& building, const PatchGrid& grid,
                                  const Visibility& visibility, const DaylightOptions& options, Progress& progress);

/// The same for other sensors than those of the scene.
DaylightSolution compute_daylight(const Scene& scene, const Building& building, const PatchGrid& grid,
                                  const Visibility& visibility, const DaylightOptions& options,
                                  std::vector<Sensor> sensors, Progress& progress);

/// Light on sensors from a solution of the radiosity: [sensors]. Those in a solid stay dark.
std::vector<PointIlluminance> light_on_sensors(const Scene& scene, const Building& building, const PatchGrid& grid,
                                               const Visibility& visibility, const OutdoorLight& outdoors,
                                               const RadiositySolution& radiosity, const DaylightOptions& options,
                                               std::span<const Sensor> sensors, Progress& progress);

}  // namespace naturel
