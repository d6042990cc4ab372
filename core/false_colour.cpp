#include "core/false_colour.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/errors.h"

namespace naturel {

Rgb8 viridis(double place) {
    // S. van der Walt & N. Smith for Matplotlib 1.5 (CC0), at 0, 1/9, ... 1.
    constexpr std::array<Rgb8, 10> anchors{{{0x44, 0x01, 0x54},
                                            {0x48, 0x28, 0x78},
                                            {0x3e, 0x49, 0x89},
                                            {0x31, 0x68, 0x8e},
                                            {0x26, 0x82, 0x8e},
                                            {0x1f, 0x9e, 0x89},
                                            {0x35, 0xb7, 0x79},
                                            {0x6e, 0xce, 0x58},
                                            {0xb5, 0xde, 0x2b},
                                            {0xfd, 0xe7, 0x25}}};
    const double at = std::clamp(place, 0.0, 1.0) * (anchors.size() - 1);
    const std::size_t first = std::min(static_cast<std::size_t>(at), anchors.size() - 2);
    const double share = at - static_cast<double>(first);
    Rgb8 colour{};
    for (std::size_t channel = 0; channel < 3; ++channel) {
        const double value = (1.0 - share) * anchors[first][channel] + share * anchors[first + 1][channel];
        colour[channel] = static_cast<std::uint8_t>(std::lround(value));
    }
    return colour;
}

ColourScale::ColourScale(ColourScaleKind kind, double maximum, double decades)
    : kind_(kind), maximum_(maximum), decades_(decades) {
    NATUREL_EXPECT(maximum > 0.0 && std::isfinite(maximum) && decades > 0.0);
}

double ColourScale::place(double value) const {
    const double share = value / maximum_;
    if (!(share > 0.0)) return 0.0;
    return std::clamp(kind_ == ColourScaleKind::linear ? share : 1.0 + std::log10(share) / decades_, 0.0, 1.0);
}

double ColourScale::value_at(double place) const {
    return kind_ == ColourScaleKind::linear ? place * maximum_
                                            : maximum_ * std::pow(10.0, (place - 1.0) * decades_);
}

std::vector<double> ColourScale::round_values(int most) const {
    NATUREL_EXPECT(most >= 2);
    // A round value at the very end of the scale counts although rounding may put it just outside.
    constexpr double slack = 1e-9;
    std::vector<double> values;
    if (kind_ == ColourScaleKind::linear) {
        const double least_step = maximum_ / (most - 1);
        const double power = std::pow(10.0, std::floor(std::log10(least_step)));
        double step = 10.0 * power;
        for (const double digit : {5.0, 2.0, 1.0}) {
            if (digit * power >= least_step * (1.0 - slack)) step = digit * power;
        }
        for (int k = 0; k * step <= maximum_ * (1.0 + slack); ++k)
            values.push_back(k * step);
        return values;
    }
    const double minimum = value_at(0.0);
    const int lowest = static_cast<int>(std::floor(std::log10(minimum)));
    const int highest = static_cast<int>(std::ceil(std::log10(maximum_)));
    const auto collect = [&](std::initializer_list<double> digits, int stride) {
        values.clear();
        for (int exponent = lowest; exponent <= highest; ++exponent) {
            if (exponent % stride != 0) continue;
            for (const double digit : digits) {
                const double value = digit * std::pow(10.0, exponent);
                if (value >= minimum * (1.0 - slack) && value <= maximum_ * (1.0 + slack)) values.push_back(value);
            }
        }
        return static_cast<int>(values.size()) <= most;
    };
    if (collect({1.0, 2.0, 5.0}, 1)) return values;
    for (int stride = 1; !collect({1.0}, stride); ++stride) {
    }
    return values;
}

double round_maximum(std::span<const double> values) {
    double largest = 0.0;
    for (const double value : values) {
        if (std::isfinite(value)) largest = std::max(largest, value);
    }
    // Denormal numbers have no decade of their own.
    if (largest < 1e-300) return 1.0;
    const double power = std::pow(10.0, std::floor(std::log10(largest)));
    for (const double digit : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0}) {
        if (digit * power >= largest * (1.0 - 1e-12)) return digit * power;
    }
    return 10.0 * power;
}

std::string round_text(double value) {
    const bool plain = value == 0.0 || (std::abs(value) >= 1e-3 && std::abs(value) < 1e7);
    if (!plain) return fmt::format("{:.3g}", value);
    // Digits left of the point are all shown: "12500", not "1.25e+04".
    return std::abs(value) >= 1000.0 ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
}

}  // namespace naturel
