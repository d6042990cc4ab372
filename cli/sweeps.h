#pragma once
#include <string>
#include <vector>

#include "cli/backends.h"
#include "core/error_budget.h"

namespace naturel {

/// One setting of a sweep: what it costs, and what it makes of the illuminance of sensors.
struct SweepPoint {
    std::string label;  ///< the value in words
    double value = 0.0;
    double rms_percent = 0.0, percentile_95_percent = 0.0;  ///< of the mean illuminance of the reference
    double seconds = 0.0, seconds_low = 0.0, seconds_high = 0.0;  ///< of all form factors, by the wall clock: median and range
    bool pareto = false;  ///< none of all sweeps is both faster and closer
};

struct Sweep {
    std::string parameter, unit;
    std::vector<SweepPoint> points;
    /// Of log error against log value, with its 95 % confidence interval; without meaning where there are fewer than three numbers.
    double slope = 0.0, slope_low = 0.0, slope_high = 0.0;
    bool has_slope = false;
};

struct SweepRequest {
    const Scene& scene;
    const Building& building;
    const PatchGrid& grid;
    const Visibility& reference;
    const Backend& rays;           ///< ray casting
    BackendOptions backends{};     ///< of the method under study
    LightState reference_state{};
    RadiosityOptions radiosity{};
    double reference_tolerance = 1e-4;
    int repeats = 3;
};

/// Varies one option of the form factors after the other, all else being as in the reference: cells, d/h, spacing of cells and
/// viewpoints of the projection, rays of the hemisphere. Last, the spacing of the grid, with rays, against half the
/// spacing of the scene.
std::vector<Sweep> run_sweeps(const SweepRequest& request, Progress& progress);

}  // namespace naturel
