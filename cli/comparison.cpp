#include "cli/comparison.h"

#include <algorithm>
#include <cmath>

namespace naturel {

std::vector<PointSet> point_sets(const Comparison& comparison) {
    std::vector<PointSet> sets;
    for (std::size_t set = 0; set < comparison.scene.sensors.size(); ++set) {
        const bool indoors = std::ranges::any_of(comparison.budget.sensors, [&](const Sensor& sensor) {
            return sensor.set == set && sensor.medium == Medium::indoor_air;
        });
        if (indoors) sets.push_back({comparison.scene.sensors[set].id, false, set});
    }
    if (!comparison.grid.nodes.empty()) sets.push_back({"nodes of the grid", true, 0});
    return sets;
}

DifferenceStatistics difference_statistics(const Comparison& comparison, const LightState& a, const LightState& b,
                                           std::size_t component, const PointSet& set) {
    const ErrorBudget& budget = comparison.budget;
    DifferenceStatistics found;
    std::vector<double> sizes;
    const auto add = [&](const ComponentsAndTotal& now, const ComponentsAndTotal& then, const ComponentsAndTotal& reference, const auto& name) {
        const double difference_lx = now.lx[component] - then.lx[component];
        if (sizes.empty() || std::abs(difference_lx) > std::abs(found.worst_lx)) {
            found.worst_lx = difference_lx;
            found.worst_point = name();
        }
        found.mean_reference_lx += reference.lx[component];
        found.mean_lx += difference_lx;
        found.rms_lx += difference_lx * difference_lx;
        sizes.push_back(std::abs(difference_lx));
    };
    if (set.nodes) {
        for (std::size_t n = 0; n < budget.reference.nodes.size(); ++n)
            add(a.nodes[n], b.nodes[n], budget.reference.nodes[n], [&] { return "node " + std::to_string(n); });
    } else {
        for (std::size_t s = 0; s < budget.sensors.size(); ++s)
            if (budget.sensors[s].set == set.set && budget.sensors[s].medium == Medium::indoor_air)
                add(a.sensors[s], b.sensors[s], budget.reference.sensors[s], [&] { return budget.sensors[s].id; });
    }
    found.points = sizes.size();
    if (sizes.empty()) return found;
    const auto n = static_cast<double>(sizes.size());
    found.mean_reference_lx /= n;
    found.mean_lx /= n;
    found.rms_lx = std::sqrt(found.rms_lx / n);
    std::ranges::sort(sizes);
    found.percentile_95_lx = sizes[(95 * sizes.size() + 99) / 100 - 1];
    return found;
}

const LightState& state_before(const ErrorBudget& budget, std::size_t ingredient) {
    return ingredient == 0 ? budget.reference : budget.ingredients[ingredient - 1].in_sequence;
}

bool is_resolved(const Comparison& comparison, std::size_t ingredient, const PointSet& set) {
    const ErrorBudget& budget = comparison.budget;
    const auto rms = [&](const LightState& a, const LightState& b) {
        return difference_statistics(comparison, a, b, ComponentsAndTotal::total_index, set).rms_lx;
    };
    return rms(budget.ingredients[ingredient].in_sequence, state_before(budget, ingredient)) > rms(budget.again, budget.reference);
}

}  // namespace naturel
