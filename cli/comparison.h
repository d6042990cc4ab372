#pragma once
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/sweeps.h"
#include "core/building.h"
#include "core/error_budget.h"
#include "core/patch_grid.h"

namespace naturel {

/// How far the colours of a picture are from those of the reference: CIEDE2000 over its pixels.
struct PictureDifference {
    std::string view;
    double mean = 0.0, percentile_95 = 0.0, worst = 0.0;
};

/// A finished comparison, and everything it came from: what its writers see. Refers to its parts.
struct Comparison {
    const CompareOptions& options;
    const Scene& scene;
    const Building& building;
    const PatchGrid& grid;
    const BudgetVisibilities& visibilities;
    const ErrorBudget& budget;
    const BudgetFormFactors& form_factors;
    const std::vector<Sweep>& sweeps;
    const std::vector<PictureDifference>& pictures;
};

/// A set of sensors, or all nodes of the grid.
struct PointSet {
    std::string id;
    bool nodes = false;
    std::size_t set = 0;  ///< into Scene::sensors
};

/// Those that have points indoors: every set of sensors, and the nodes.
std::vector<PointSet> point_sets(const Comparison& comparison);

/// Signed differences of the points of a set, with the mean of the reference there.
struct DifferenceStatistics {
    std::size_t points = 0;
    double mean_reference_lx = 0.0;
    double mean_lx = 0.0, rms_lx = 0.0, percentile_95_lx = 0.0;  ///< the last of the sizes
    double worst_lx = 0.0;                                       ///< signed
    std::string worst_point;
};

/// a minus b, one component, over the points of a set that are indoors.
DifferenceStatistics difference_statistics(const Comparison& comparison, const LightState& a, const LightState& b,
                                           std::size_t component, const PointSet& set);

/// What an ingredient was added to.
const LightState& state_before(const ErrorBudget& budget, std::size_t ingredient);

/// Whether what an ingredient does in sequence to the total illuminance of a set shows beside the error of the reference: RMS
/// against RMS.
bool is_resolved(const Comparison& comparison, std::size_t ingredient, const PointSet& set);

}  // namespace naturel
