#include "cli/result.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/errors.h"

namespace naturel {
namespace {

constexpr std::array component_parts{&Components::sky_lx, &Components::sun_lx, &Components::erc_ground_lx,
                                     &Components::erc_buildings_lx, &Components::irc_lx};

}  // namespace

std::optional<double> daylight_factor_percent(const Result& result, const PointIlluminance& point) {
    const double outdoors_lx = result.solution.outdoors.horizontal_illuminance().value;
    if (outdoors_lx <= 0.0) return std::nullopt;
    return 100.0 * result.primaries.luminous(point.from_sky_lx()) / outdoors_lx;
}

Components components_of(const Primaries& primaries, const DirectIlluminance& direct, const LightBySource& indirect_lx) {
    const double ground_lx = primaries.luminous(direct.ground_lx.total());
    return {.sky_lx = primaries.luminous(direct.sky_lx),
            .sun_lx = primaries.luminous(direct.sun_lx),
            .erc_ground_lx = ground_lx,
            .erc_buildings_lx = std::max(0.0, primaries.luminous(direct.outdoor_lx.total()) - ground_lx),
            .irc_lx = primaries.luminous(indirect_lx.total())};
}

Statistics statistics_of(std::vector<double> values) {
    NATUREL_EXPECT(!values.empty());
    std::ranges::sort(values);
    const std::size_t n = values.size();
    return {.mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(n),
            .median = 0.5 * (values[(n - 1) / 2] + values[n / 2]),
            .min = values.front(),
            .max = values.back()};
}

std::vector<SensorSetStatistics> sensor_set_statistics(const Result& result) {
    std::vector<SensorSetStatistics> sets(result.scene.sensors.size());
    std::vector<std::vector<double>> factors(sets.size()), illuminances(sets.size());
    std::vector<Components> sums(sets.size());
    for (std::size_t k = 0; k < result.solution.sensors.size(); ++k) {
        const Sensor& sensor = result.solution.sensors[k];
        SensorSetStatistics& set = sets[sensor.set];
        ++set.points;
        if (sensor.medium == Medium::outdoor_air) ++set.points_outdoors;
        if (sensor.medium == Medium::solid) {
            ++set.points_in_solid;
            continue;
        }
        const PointIlluminance& point = result.solution.sensor_values[k];
        illuminances[sensor.set].push_back(result.primaries.luminous(point.total_lx()));
        const Components parts = components_of(result.primaries, point.direct, point.indirect_lx);
        Components& sum = sums[sensor.set];
        for (const auto part : component_parts) sum.*part += parts.*part;
        if (const auto factor = daylight_factor_percent(result, point))
            factors[sensor.set].push_back(*factor);
    }
    for (std::size_t s = 0; s < sets.size(); ++s) {
        sets[s].id = result.scene.sensors[s].id;
        if (!factors[s].empty()) sets[s].daylight_factor_percent = statistics_of(factors[s]);
        if (illuminances[s].empty()) continue;
        sets[s].illuminance_lx = statistics_of(illuminances[s]);
        for (const auto part : component_parts) sums[s].*part /= static_cast<double>(illuminances[s].size());
        sets[s].mean_components = sums[s];
    }
    return sets;
}

FluxBalance flux_balance(const Result& result) {
    const RadiositySolution& radiosity = result.solution.radiosity;
    FluxBalance flux{.in_lm = result.primaries.luminous(radiosity.flux_in_lm),
                     .absorbed_lm = result.primaries.luminous(radiosity.flux_absorbed_lm),
                     .lost_lm = result.primaries.luminous(radiosity.flux_lost_lm)};
    if (flux.in_lm > 0.0)
        flux.relative_gap = std::abs(flux.in_lm - flux.absorbed_lm - flux.lost_lm) / flux.in_lm;
    return flux;
}

std::vector<SensorSetDifference> compare_sensor_sets(const Scene& scene, std::span<const Sensor> sensors,
                                                     std::span<const double> total_lx,
                                                     std::span<const double> reference_lx) {
    std::vector<SensorSetDifference> sets(scene.sensors.size());
    for (std::size_t k = 0; k < sensors.size(); ++k) {
        if (sensors[k].medium == Medium::solid) continue;
        SensorSetDifference& set = sets[sensors[k].set];
        const double difference_lx = total_lx[k] - reference_lx[k];
        if (set.points == 0 || std::abs(difference_lx) > std::abs(set.worst_lx)) {
            set.worst_lx = difference_lx;
            set.worst_point = sensors[k].id;
        }
        ++set.points;
        set.mean_reference_lx += reference_lx[k];
        set.mean_lx += difference_lx;
        set.root_mean_square_lx += difference_lx * difference_lx;
    }
    for (std::size_t s = 0; s < sets.size(); ++s) {
        const auto n = static_cast<double>(sets[s].points);
        sets[s].id = scene.sensors[s].id;
        sets[s].mean_reference_lx /= n;
        sets[s].mean_lx /= n;
        sets[s].root_mean_square_lx = std::sqrt(sets[s].root_mean_square_lx / n);
    }
    std::erase_if(sets, [](const SensorSetDifference& set) { return set.points == 0; });
    return sets;
}

}  // namespace naturel
