#include "cli/timing_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace naturel {
namespace {

/// The 97.5 % point of Student's distribution, from that of the normal one (Abramowitz & Stegun 26.7.5); within 1 % from 3 degrees
/// of freedom. Below, every percentile interval ends at the extremes anyway.
double student_975(double degrees) {
    constexpr double z = 1.959964;
    const double z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
    return z + (z3 + z) / (4.0 * degrees) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * degrees * degrees) +
           (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * degrees * degrees * degrees);
}

double normal_below(double z) {
    return 0.5 * std::erfc(-z / std::sqrt(2.0));
}

}  // namespace

double median(std::vector<double> values) {
    const std::size_t half = values.size() / 2;
    std::ranges::sort(values);
    return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

Estimate bootstrap(std::size_t repeats, const RepeatStatistic& statistic) {
    std::vector<std::size_t> chosen(repeats);
    for (std::size_t k = 0; k < repeats; ++k) chosen[k] = k;
    Estimate estimate{.value = statistic(chosen)};
    if (repeats < 2) return estimate;

    constexpr std::size_t draws = 4000;  // 20 of them lie beyond an end of the interval of seven repeats
    std::mt19937_64 random(1);
    std::vector<double> found(draws);
    for (double& value : found) {
        for (std::size_t& k : chosen) k = static_cast<std::size_t>(random() % repeats);
        value = statistic(chosen);
    }
    std::ranges::sort(found);
    const auto n = static_cast<double>(repeats);
    const double tail = normal_below(-std::sqrt(n / (n - 1.0)) * student_975(n - 1.0));
    const auto below = std::min(static_cast<std::size_t>(tail * static_cast<double>(draws)), draws / 2);
    estimate.interval = Interval{found[below], found[draws - 1 - below]};
    return estimate;
}

double serial_fraction(std::span<const int> threads, std::span<const double> seconds) {
    // T = a + b / p is a straight line in 1 / p; s = a / (a + b).
    const auto n = static_cast<double>(threads.size());
    double x_mean = 0.0, t_mean = 0.0, xx = 0.0, xt = 0.0;
    for (std::size_t k = 0; k < threads.size(); ++k) {
        x_mean += 1.0 / threads[k] / n;
        t_mean += seconds[k] / n;
    }
    for (std::size_t k = 0; k < threads.size(); ++k) {
        const double x = 1.0 / threads[k] - x_mean;
        xx += x * x;
        xt += x * (seconds[k] - t_mean);
    }
    if (xx == 0.0) return std::numeric_limits<double>::quiet_NaN();
    const double b = xt / xx, a = t_mean - b * x_mean;
    return a / (a + b);
}

double karp_flatt(int threads, double speed_up) {
    const double share = 1.0 / threads;
    return (1.0 / speed_up - share) / (1.0 - share);
}

}  // namespace naturel
