#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

// The maths of false colour: which colour stands for which value (docs/method.md, "False colour"). Drawing is in cli.
namespace naturel {

using Rgb8 = std::array<std::uint8_t, 3>;  ///< 8-bit sRGB, red first

/// Matplotlib's viridis, ten anchors with straight lines between; place: 0 dark violet to 1 yellow, clamped.
Rgb8 viridis(double place);

enum class ColourScaleKind { linear, logarithmic };

/// Maps values to places on a colour bar.
class ColourScale {
public:
    /// maximum: at place 1, above 0. decades: of a logarithmic scale, below the maximum.
    ColourScale(ColourScaleKind kind, double maximum, double decades = 3.0);

    double place(double value) const;     ///< in [0, 1], clamped
    double value_at(double place) const;  ///< inverse of place()
    Rgb8 colour(double value) const { return viridis(place(value)); }
    double maximum() const { return maximum_; }
    ColourScaleKind kind() const { return kind_; }

    /// Values for a legend, increasing, at most `most` (>= 2): round multiples of 1, 2 or 5 times a power of ten on a linear
    /// scale; powers of ten, with 2 and 5 between when there is room, on a logarithmic one.
    std::vector<double> round_values(int most) const;

private:
    ColourScaleKind kind_;
    double maximum_;
    double decades_;
};

/// The smallest of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten that is not below the largest finite value; 1 if none is positive.
double round_maximum(std::span<const double> values);

/// A value as a person writes it: 12 500 -> "12500", 0.05 -> "0.05"; at most four significant digits.
std::string round_text(double value);

}  // namespace naturel
