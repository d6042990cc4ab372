#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/building.h"
#include "core/colour.h"
#include "core/daylight.h"
#include "core/error_estimate.h"
#include "core/patch_grid.h"

namespace naturel {

/// A finished calculation by one backend, and everything it came from: what the writers see. Refers to its
/// parts.
struct Result {
    const RunOptions& options;
    const Scene& scene;
    const Building& building;
    const PatchGrid& grid;
    const Visibility& visibility;
    const DaylightSolution& solution;
    const Primaries& primaries;
    std::optional<ErrorEstimate> error{};
};

/// Indoor illuminance due to the sky over the illuminance of the unobstructed horizontal plane, %; empty
/// under a sky without light.
std::optional<double> daylight_factor_percent(const Result& result, const PointIlluminance& point);

/// Luminous parts of an illuminance, lx; they add up to the whole.
struct Components {
    double sky_lx = 0.0, sun_lx = 0.0;
    double erc_ground_lx = 0.0, erc_buildings_lx = 0.0;  ///< externally reflected, by what reflected it last
    double irc_lx = 0.0;
};
Components components_of(const Primaries& primaries, const DirectIlluminance& direct, const LightBySource& indirect_lx);

/// A set of numbers in short.
struct Statistics {
    double mean = 0.0, median = 0.0, min = 0.0, max = 0.0;
};

/// Statistics of at least one number.
Statistics statistics_of(std::vector<double> values);

/// What a set of sensors shows. Points inside solid matter do not count in the statistics.
struct SensorSetStatistics {
    std::string id;
    std::size_t points = 0;  ///< all of the set
    std::size_t points_in_solid = 0, points_outdoors = 0;
    std::optional<Statistics> daylight_factor_percent;
    std::optional<Statistics> illuminance_lx;
    std::optional<Components> mean_components;
};

/// [Scene::sensors]
std::vector<SensorSetStatistics> sensor_set_statistics(const Result& result);

/// Luminous flux of the radiosity solution, lm.
struct FluxBalance {
    double in_lm = 0.0, absorbed_lm = 0.0, lost_lm = 0.0;
    double relative_gap = 0.0;  ///< |in - absorbed - lost| / in
};
FluxBalance flux_balance(const Result& result);

/// How the illuminance of a set of sensors differs between two backends.
struct SensorSetDifference {
    std::string id;
    std::size_t points = 0;  ///< points inside solid matter left out
    double mean_reference_lx = 0.0;
    double mean_lx = 0.0;  ///< signed: the backend minus the reference
    double root_mean_square_lx = 0.0;
    double worst_lx = 0.0;  ///< signed, at the point where its size is largest
    std::string worst_point;
};

/// total_lx, reference_lx: luminous, [sensors]. Sets without points are left out.
std::vector<SensorSetDifference> compare_sensor_sets(const Scene& scene, std::span<const Sensor> sensors,
                                                     std::span<const double> total_lx,
                                                     std::span<const double> reference_lx);

}  // namespace naturel
