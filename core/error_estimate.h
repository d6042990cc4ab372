#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>

#include "core/daylight.h"
#include "core/light_zones.h"

namespace naturel {

/// How far the illuminance of sensors indoors is from what ever finer settings would give, as a share of the
/// illuminance of each: 95 % of the sensors are estimated to be nearer. (docs/method.md, "Quality")
struct ErrorEstimate {
    std::size_t points = 0;  ///< sensors looked at
    double sampling = 0.0;   ///< of the visibility method at the sensor: noise of rays, aliasing of cells
    std::optional<double>
        grid{};           ///< patches of one exitance; empty where another grid would have cost too much
    double direct = 0.0;  ///< numerical integration over the apertures

    /// The parts are independent: root of the sum of their squares.
    double total() const;
};

/// The visibility methods that a solution is compared with.
enum class Companion {
    other_seed,   ///< as that of the solution, with other random numbers, or more exact where it uses none
    other_grid,   ///< as that of the solution at a point; rows of patches may be coarser
};
using MakeCompanion = std::function<std::unique_ptr<Visibility>(const PatchGrid&, Companion)>;

/// Computes some of the sensors again, with other random numbers and a tighter tolerance, and from a solution
/// on a grid of twice the spacing, or of half of it where a small grid cannot be made coarser. Costs about a fifth of the solution.
/// Empty where no sensor indoors has light. grid_zones: what the grid of the solution was cut by.
std::optional<ErrorEstimate> estimate_error(const Scene& scene, const Building& building,
                                            const PatchGrid& grid, const LightZones& grid_zones,
                                            const DaylightSolution& solution, const DaylightOptions& options,
                                            const MakeCompanion& make_companion, Progress& progress);

}  // namespace naturel
