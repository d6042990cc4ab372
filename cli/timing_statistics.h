#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace naturel {

struct Interval {
    double low = 0.0, high = 0.0;
};

/// A number from repeated measurements. No interval where there is but one.
struct Estimate {
    double value = 0.0;
    std::optional<Interval> interval{};
};

/// Of at least one value; of an even number the mean of the two in the middle.
double median(std::vector<double> values);

/// A statistic of some of the repeats, which are named by number and may occur several times.
using RepeatStatistic = std::function<double(std::span<const std::size_t> repeats)>;

/// A statistic of `repeats` repeats with its 95 % confidence interval: percentiles of the statistic of repeats drawn with replacement
/// (fixed seed), moved outwards for few repeats (Hesterberg 2015, "expanded percentile interval"). What is measured
/// together in a repeat is drawn together. Of a median of five or fewer, the interval is from the smallest to the largest value, which covers
/// the truth in 1 - 2^(1 - n) of all cases.
Estimate bootstrap(std::size_t repeats, const RepeatStatistic& statistic);

/// The share s of Amdahl's law T(p) = T(1) (s + (1 - s) / p), by least squares over all thread counts. Below 0 where threads gain more than
/// their number, above 1 where they lose. At least two different counts, else NaN.
double serial_fraction(std::span<const int> threads, std::span<const double> seconds);

/// The serial fraction that one speed-up amounts to (Karp & Flatt 1990). threads > 1
double karp_flatt(int threads, double speed_up);

}  // namespace naturel
