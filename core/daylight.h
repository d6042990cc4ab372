#pragma once
#include <vector>

#include "core/direct.h"
#include "core/form_factors.h"
#include "core/radiosity.h"
#include "core/sensors.h"

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
    std::vector<std::pair<std::string, double>> stage_seconds{};  ///< wall clock, in the order of the stages
};

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
