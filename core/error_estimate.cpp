#include "core/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "core/colour.h"

namespace naturel {
namespace {

/// Evenly chosen sensors indoors: enough for a 95th percentile, a quarter of many, to be cheap. Neighbours may err together, so that the
/// noise found from two dozen differs by a factor of two from seed to seed.
std::vector<std::size_t> chosen_sensors(const DaylightSolution& solution) {
    std::vector<std::size_t> indoors;
    for (std::size_t s = 0; s < solution.sensors.size(); ++s)
        if (solution.sensors[s].medium == Medium::indoor_air) indoors.push_back(s);
    const std::size_t wanted = std::clamp<std::size_t>(indoors.size() / 4, 64, 256);
    if (indoors.size() <= wanted) return indoors;
    std::vector<std::size_t> chosen;
    for (std::size_t k = 0; k < wanted; ++k)
        chosen.push_back(indoors[(2 * k + 1) * indoors.size() / (2 * wanted)]);
    return chosen;
}

constexpr double normal_90 = 1.2816;  // 90 % of a normal distribution are below so many standard deviations

/// The standard deviation that is found from `count` values is exceeded by this many times by the true one in one case of ten:
/// sqrt(count / chi^2_0.1(count)) by Wilson and Hilferty's cube root, 1.43 for 10 values and 1.13 for 64.
double upper_share(std::size_t count) {
    const double v = 2.0 / (9.0 * static_cast<double>(count));
    const double root = std::max(0.2, 1.0 - v - normal_90 * std::sqrt(v));
    return 1.0 / std::sqrt(root * root * root);
}

/// A grid to compare a solution with, and what share of the difference is the error of the solution.
struct OtherGrid {
    PatchGrid grid;
    double spacing_ratio;
    double share_of_difference;
};

/// The error is of second order in the spacing where light is smooth, of first order along edges and in corners. From a grid of
/// twice the spacing the solution differs by three times its error in the one case and once in the other; from one of half the spacing by
/// 3/4 and 1/2 of it. The shares are between: 1/2, and 1.6 between 4/3 and 2.
std::optional<OtherGrid> other_grid(const Scene& scene, const Building& building, const PatchGrid& grid,
                                    const LightZones& grid_zones) {
    const auto at = [&](double ratio) {
        GridOptions options = scene.grid;
        options.spacing_m *= ratio;
        options.outdoor_spacing_m *= ratio;
        return make_patch_grid(building, options, grid_zones);
    };
    const auto nodes = [](const PatchGrid& g) { return static_cast<double>(g.nodes.size()); };
    PatchGrid coarse = at(2.0);
    if (nodes(coarse) <= 0.45 * nodes(grid)) return OtherGrid{std::move(coarse), 2.0, 0.5};
    // Cells are whole facets or parts of zones already. A finer grid takes the time of several such runs, so it must be small.
    constexpr double most_nodes = 4000;
    if (nodes(grid) > most_nodes / 3.0) return std::nullopt;
    PatchGrid fine = at(0.5);
    if (nodes(fine) > most_nodes || nodes(fine) < 1.5 * nodes(grid)) return std::nullopt;
    return OtherGrid{std::move(fine), 0.5, 1.6};
}

/// 95 % of the values are not larger (nearest rank).
constexpr double percentile_95 = 0.95;

/// The share of `count` values below which, in nine cases of ten, the 95th percentile of all lies: the share that is found below it
/// scatters by sqrt(p (1 - p) / count).
double upper_percentile_95(std::size_t count) {
    return std::min(1.0, percentile_95 + normal_90 * std::sqrt(percentile_95 * (1.0 - percentile_95) / static_cast<double>(count)));
}

/// The smallest of the values that is not exceeded by a share of them (nearest rank).
double percentile(std::vector<double> values, double share) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(rank - 1));
    return values[rank - 1];
}

}  // namespace

double ErrorEstimate::total() const {
    return std::sqrt(sampling * sampling + grid.value_or(0.0) * grid.value_or(0.0) + direct * direct);
}

std::optional<ErrorEstimate> estimate_error(const Scene& scene, const Building& building,
                                            const PatchGrid& grid, const LightZones& grid_zones,
                                            const DaylightSolution& solution, const DaylightOptions& options,
                                            const MakeCompanion& make_companion, Progress& progress) {
    const Primaries primaries(scene.primaries);
    const std::vector<std::size_t> chosen = chosen_sensors(solution);
    const std::size_t count = chosen.size();
    std::vector<Sensor> sensors;
    std::vector<double> total_lx;
    double mean_lx = 0.0;
    for (const std::size_t s : chosen) {
        sensors.push_back(solution.sensors[s]);
        total_lx.push_back(primaries.luminous(solution.sensor_values[s].total_lx()));
        mean_lx += total_lx.back() / static_cast<double>(count);
    }
    if (!(mean_lx > 0.0)) return std::nullopt;
    // What is almost dark beside the others has no relative error worth speaking of.
    constexpr double dark = 0.01;
    for (double& lx : total_lx)
        lx = std::max(lx, dark * mean_lx);

    ErrorEstimate estimate{.points = count};
    const auto direct_lx = [&](const PointIlluminance& p) {
        return primaries.luminous(p.direct.by_source().total());
    };
    const auto indirect_lx = [&](const PointIlluminance& p) {
        return primaries.luminous(p.indirect_lx.total());
    };

    // The same points again: other random numbers for the interreflected light, a finer integral of the
    // direct light.
    constexpr double tighter = 0.25;
    Scene finer = scene;
    finer.direct.method = DirectMethod::adaptive;
    finer.direct.tolerance = scene.direct.tolerance * tighter;
    const std::unique_ptr<Visibility> reseeded = make_companion(grid, Companion::other_seed);
    const std::vector<PointIlluminance> again = light_on_sensors(
        finer, building, grid, *reseeded, solution.outdoors, solution.radiosity, options, sensors, progress);
    double variance = 0.0;
    std::vector<double> noises, direct_errors;
    for (std::size_t k = 0; k < count; ++k) {
        const PointIlluminance& found = solution.sensor_values[chosen[k]];
        // Two independent values differ by sqrt(2) of the standard deviation of either.
        const double noise = std::abs(indirect_lx(again[k]) - indirect_lx(found)) / (std::sqrt(2.0) * total_lx[k]);
        variance += noise * noise / static_cast<double>(count);
        noises.push_back(noise);
        direct_errors.push_back(std::abs(direct_lx(again[k]) - direct_lx(found)) / total_lx[k]);
    }
    // 95 % of a normal distribution are within 1.96 standard deviations. Where some sensors are much noisier than others (far from
    // the light) the 95 % reach further.
    constexpr double normal_95 = 1.96;
    estimate.sampling = std::max(normal_95 * upper_share(count) * std::sqrt(variance), percentile(std::move(noises), upper_percentile_95(count)));
    estimate.direct = percentile(std::move(direct_errors), percentile_95);

    // The whole again on another grid, seen by the same rays at the sensors, so that their noise cancels.
    const std::optional<OtherGrid> other = other_grid(scene, building, grid, grid_zones);
    if (!other) return estimate;
    Scene regridded = scene;
    regridded.grid.spacing_m *= other->spacing_ratio;
    regridded.grid.outdoor_spacing_m *= other->spacing_ratio;
    DaylightOptions other_options = options;
    other_options.node_indirect = IndirectMethod::patch;
    const std::unique_ptr<Visibility> other_visibility = make_companion(other->grid, Companion::other_grid);
    const DaylightSolution other_solution = compute_daylight(
        regridded, building, other->grid, *other_visibility, other_options, sensors, progress);
    std::vector<double> grid_errors;
    for (std::size_t k = 0; k < count; ++k) {
        const double difference_lx = primaries.luminous(other_solution.sensor_values[k].total_lx()) -
                                     primaries.luminous(solution.sensor_values[chosen[k]].total_lx());
        grid_errors.push_back(other->share_of_difference * std::abs(difference_lx) / total_lx[k]);
    }
    estimate.grid = percentile(std::move(grid_errors), percentile_95);
    return estimate;
}

}  // namespace naturel
