#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "cli/raster.h"

namespace naturel {

struct FalseColourOptions {
    std::string title;  ///< above the picture; none if empty
    std::string unit;   ///< on the legend, e.g. "cd/m²"
    ColourScaleKind scale = ColourScaleKind::linear;
    std::optional<double> maximum{};  ///< default: round_maximum() of the field
    double decades = 3.0;             ///< of a logarithmic scale
    std::vector<double> contours{};   ///< values at which lines are drawn
    std::span<const std::uint32_t> parts{};  ///< lines do not pass from one to the next: isolines()
    std::string grey_means{};  ///< for the legend: what pixels without a value are; no such key if empty
};

/// The scale that the options and the field ask for.
ColourScale colour_scale(std::span<const double> field, const FalseColourOptions& options);

/// A field as a picture in false colour, with a legend at its right.
/// field: [width x height], rows from the top; what is not finite has no value and is grey.
/// The field keeps its pixels: it begins at column 0 and row field_top(). The upper end of
/// the legend has "≥" where values exceed it, the lower one "≤".
Raster draw_false_colour(std::span<const double> field, int width, int height, const FalseColourOptions& options);

/// Rows above a field that the title takes.
int field_top(const FalseColourOptions& options, int width, int height);

}  // namespace naturel
