#include "cli/run_account.h"

#include <fmt/format.h>

#include <cmath>

namespace naturel {
namespace {

/// Rounded to one decimal, without the "-0.0" that rounding noise would print.
double in_tenths(double value) {
    return std::round(value * 10.0) / 10.0 + 0.0;
}

}  // namespace

std::string run_account(const Result& result, const std::vector<SensorSetStatistics>& sets) {
    const RadiositySolution& radiosity = result.solution.radiosity;
    const FluxBalance flux = flux_balance(result);
    std::string text =
        fmt::format("{}: {} patches, {} nodes, {} sensors; outdoors {:.0f} lx without the sun\n",
                    result.visibility.name(), result.grid.patches.size(), result.grid.nodes.size(),
                    result.solution.sensors.size(), result.solution.outdoors.horizontal_illuminance().value);
    for (const SensorSetStatistics& set : sets) {
        text += fmt::format("  {} ({} points)", set.id, set.points);
        if (set.daylight_factor_percent)
            text += fmt::format(": daylight factor mean {:.2f} %, min {:.2f} %, max {:.2f} %",
                                set.daylight_factor_percent->mean, set.daylight_factor_percent->min,
                                set.daylight_factor_percent->max);
        if (set.illuminance_lx)
            text += fmt::format("; illuminance mean {:.1f} lx, min {:.1f} lx, max {:.1f} lx",
                                set.illuminance_lx->mean, set.illuminance_lx->min, set.illuminance_lx->max);
        text += '\n';
    }
    if (result.error) {
        const ErrorEstimate& error = *result.error;
        text += fmt::format(
            "  estimated error of illuminance, 95 % of sensors: {:.2f} % (sampling {:.2f} %, grid {}, direct "
            "light {:.2f} %)\n",
            100.0 * error.total(), 100.0 * error.sampling,
            error.grid ? fmt::format("{:.2f} %", 100.0 * *error.grid) : "not estimated",
            100.0 * error.direct);
    }
    text += fmt::format(
        "  flux in {:.1f} lm, absorbed {:.1f} lm, lost {:.1f} lm (gap {:.1e}); radiosity {} after {} "
        "iterations, "
        "residual {:.1e}\n",
        flux.in_lm, flux.absorbed_lm, in_tenths(flux.lost_lm), flux.relative_gap,
        radiosity.converged ? "converged" : "NOT converged", radiosity.iterations,
        radiosity.relative_residual);
    return text;
}

std::string difference_account(const std::string& backend, const std::string& reference,
                               const std::vector<SensorSetDifference>& sets) {
    std::string text = fmt::format("{} minus {}, illuminance:\n", backend, reference);
    for (const SensorSetDifference& set : sets)
        text += fmt::format(
            "  {} ({} points): mean {:+.2f} lx, RMS {:.2f} lx, worst {:+.2f} lx at {} ({} has {:.1f} lx on "
            "average)\n",
            set.id, set.points, set.mean_lx, set.root_mean_square_lx, set.worst_lx, set.worst_point,
            reference, set.mean_reference_lx);
    return text;
}

std::string misplaced_sensors(const std::vector<SensorSetStatistics>& sets) {
    std::string text;
    for (const SensorSetStatistics& set : sets)
        if (set.points_in_solid > 0 || set.points_outdoors > 0)
            text += fmt::format(
                "sensors \"{}\": of {} points {} inside a solid (left empty in sensors.csv), {} outdoors\n",
                set.id, set.points, set.points_in_solid, set.points_outdoors);
    return text;
}

}  // namespace naturel
