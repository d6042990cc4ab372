#pragma once
#include <string_view>
#include <vector>

#include "core/false_colour.h"

namespace naturel {

/// An 8-bit sRGB picture to draw on; rows from the top.
struct Raster {
    Raster(int columns, int rows, Rgb8 background);

    int width, height;
    std::vector<Rgb8> pixels;  ///< [width x height]

    Rgb8& at(int column, int row) { return pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)]; }
    const Rgb8& at(int column, int row) const { return pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)]; }

    /// What lies outside the picture is not drawn.
    void fill(int left, int top, int columns, int rows, Rgb8 colour);
    void line(double x0, double y0, double x1, double y1, Rgb8 colour, int thickness = 1);
    /// left, top: of the first letter. Letters are glyph_width x glyph_height pixels times `scale`.
    void text(int left, int top, std::string_view utf8, Rgb8 colour, int scale = 2);
};

inline constexpr int glyph_width = 6, glyph_height = 10;  ///< with the gaps to the next letter and line

/// Width of a text, pixels.
int text_width(std::string_view utf8, int scale = 2);

}  // namespace naturel
