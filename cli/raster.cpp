#include "cli/raster.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace naturel {
namespace {

/// A letter of 5 x 7 pixels and two rows for what hangs below the line, from the top, the leftmost pixel in the highest of five bits.
using Glyph = std::array<std::uint8_t, 9>;

/// ASCII from the blank to the tilde. Pictures must not depend on the fonts of a machine.
constexpr std::array<Glyph, 95> ascii_glyphs{{
    {0, 0, 0, 0, 0, 0, 0},                       // blank
    {4, 4, 4, 4, 4, 0, 4},                       // !
    {10, 10, 10, 0, 0, 0, 0},                    // "
    {10, 10, 31, 10, 31, 10, 10},                // #
    {4, 15, 20, 14, 5, 30, 4},                   // $
    {24, 25, 2, 4, 8, 19, 3},                    // %
    {12, 18, 20, 8, 21, 18, 13},                 // &
    {4, 4, 4, 0, 0, 0, 0},                       // '
    {2, 4, 8, 8, 8, 4, 2},                       // (
    {8, 4, 2, 2, 2, 4, 8},                       // )
    {0, 4, 21, 14, 21, 4, 0},                    // *
    {0, 4, 4, 31, 4, 4, 0},                      // +
    {0, 0, 0, 0, 12, 4, 8},                      // ,
    {0, 0, 0, 31, 0, 0, 0},                      // -
    {0, 0, 0, 0, 0, 12, 12},                     // .
    {0, 1, 2, 4, 8, 16, 0},                      // /
    {14, 17, 19, 21, 25, 17, 14},                // 0
    {4, 12, 4, 4, 4, 4, 14},                     // 1
    {14, 17, 1, 2, 4, 8, 31},                    // 2
    {31, 2, 4, 2, 1, 17, 14},                    // 3
    {2, 6, 10, 18, 31, 2, 2},                    // 4
    {31, 16, 30, 1, 1, 17, 14},                  // 5
    {6, 8, 16, 30, 17, 17, 14},                  // 6
    {31, 1, 2, 4, 8, 8, 8},                      // 7
    {14, 17, 17, 14, 17, 17, 14},                // 8
    {14, 17, 17, 15, 1, 2, 12},                  // 9
    {0, 12, 12, 0, 12, 12, 0},                   // :
    {0, 12, 12, 0, 12, 4, 8},                    // ;
    {2, 4, 8, 16, 8, 4, 2},                      // <
    {0, 0, 31, 0, 31, 0, 0},                     // =
    {8, 4, 2, 1, 2, 4, 8},                       // >
    {14, 17, 1, 2, 4, 0, 4},                     // ?
    {14, 17, 1, 13, 21, 21, 14},                 // @
    {14, 17, 17, 17, 31, 17, 17},                // A
    {30, 17, 17, 30, 17, 17, 30},                // B
    {14, 17, 16, 16, 16, 17, 14},                // C
    {28, 18, 17, 17, 17, 18, 28},                // D
    {31, 16, 16, 30, 16, 16, 31},                // E
    {31, 16, 16, 30, 16, 16, 16},                // F
    {14, 17, 16, 23, 17, 17, 15},                // G
    {17, 17, 17, 31, 17, 17, 17},                // H
    {14, 4, 4, 4, 4, 4, 14},                     // I
    {7, 2, 2, 2, 2, 18, 12},                     // J
    {17, 18, 20, 24, 20, 18, 17},                // K
    {16, 16, 16, 16, 16, 16, 31},                // L
    {17, 27, 21, 21, 17, 17, 17},                // M
    {17, 17, 25, 21, 19, 17, 17},                // N
    {14, 17, 17, 17, 17, 17, 14},                // O
    {30, 17, 17, 30, 16, 16, 16},                // P
    {14, 17, 17, 17, 21, 18, 13},                // Q
    {30, 17, 17, 30, 20, 18, 17},                // R
    {15, 16, 16, 14, 1, 1, 30},                  // S
    {31, 4, 4, 4, 4, 4, 4},                      // T
    {17, 17, 17, 17, 17, 17, 14},                // U
    {17, 17, 17, 17, 17, 10, 4},                 // V
    {17, 17, 17, 21, 21, 21, 10},                // W
    {17, 17, 10, 4, 10, 17, 17},                 // X
    {17, 17, 17, 10, 4, 4, 4},                   // Y
    {31, 1, 2, 4, 8, 16, 31},                    // Z
    {14, 8, 8, 8, 8, 8, 14},                     // [
    {0, 16, 8, 4, 2, 1, 0},                      // backslash
    {14, 2, 2, 2, 2, 2, 14},                     // ]
    {4, 10, 17, 0, 0, 0, 0},                     // ^
    {0, 0, 0, 0, 0, 0, 31},                      // _
    {8, 4, 2, 0, 0, 0, 0},                       // `
    {0, 0, 14, 1, 15, 17, 15},                   // a
    {16, 16, 22, 25, 17, 17, 30},                // b
    {0, 0, 14, 16, 16, 17, 14},                  // c
    {1, 1, 13, 19, 17, 17, 15},                  // d
    {0, 0, 14, 17, 31, 16, 14},                  // e
    {6, 9, 8, 28, 8, 8, 8},                      // f
    {0, 0, 15, 17, 17, 17, 15, 1, 14},  // g
    {16, 16, 22, 25, 17, 17, 17},                // h
    {4, 0, 12, 4, 4, 4, 14},                     // i
    {2, 0, 6, 2, 2, 2, 2, 18, 12},  // j
    {16, 16, 18, 20, 24, 20, 18},                // k
    {12, 4, 4, 4, 4, 4, 14},                     // l
    {0, 0, 26, 21, 21, 17, 17},                  // m
    {0, 0, 22, 25, 17, 17, 17},                  // n
    {0, 0, 14, 17, 17, 17, 14},                  // o
    {0, 0, 30, 17, 17, 17, 30, 16, 16},  // p
    {0, 0, 15, 17, 17, 17, 15, 1, 1},  // q
    {0, 0, 22, 25, 16, 16, 16},                  // r
    {0, 0, 14, 16, 14, 1, 30},                   // s
    {8, 8, 28, 8, 8, 9, 6},                      // t
    {0, 0, 17, 17, 17, 19, 13},                  // u
    {0, 0, 17, 17, 17, 10, 4},                   // v
    {0, 0, 17, 17, 21, 21, 10},                  // w
    {0, 0, 17, 10, 4, 10, 17},                   // x
    {0, 0, 17, 17, 17, 17, 15, 1, 14},  // y
    {0, 0, 31, 2, 4, 8, 31},                     // z
    {2, 4, 4, 8, 4, 4, 2},                       // {
    {4, 4, 4, 4, 4, 4, 4},                       // |
    {8, 4, 4, 2, 4, 4, 8},                       // }
    {0, 0, 8, 21, 2, 0, 0},                      // ~
}};
constexpr Glyph at_most_sign{2, 4, 8, 4, 2, 0, 31}, at_least_sign{8, 4, 2, 4, 8, 0, 31};
constexpr Glyph square_sign{12, 18, 4, 8, 30, 0, 0}, degree_sign{12, 18, 18, 12, 0, 0, 0},
    unknown_sign{31, 17, 17, 17, 17, 17, 31};

/// Takes the next character off a UTF-8 text.
const Glyph& next_glyph(std::string_view& utf8) {
    const auto byte = static_cast<unsigned char>(utf8.front());
    const bool is_square = utf8.starts_with("\u00b2"), is_degree = utf8.starts_with("\u00b0");
    const bool is_at_most = utf8.starts_with("\u2264"), is_at_least = utf8.starts_with("\u2265");
    std::size_t length = 1;
    while (byte >= 0xc0 && length < utf8.size() && (static_cast<unsigned char>(utf8[length]) & 0xc0u) == 0x80u)
        ++length;
    utf8.remove_prefix(length);
    if (is_square) return square_sign;
    if (is_degree) return degree_sign;
    if (is_at_most) return at_most_sign;
    if (is_at_least) return at_least_sign;
    return byte >= ' ' && byte <= '~' ? ascii_glyphs[byte - std::size_t{' '}] : unknown_sign;
}

}  // namespace

Raster::Raster(int columns, int rows, Rgb8 background)
    : width(columns), height(rows),
      pixels(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), background) {}

void Raster::fill(int left, int top, int columns, int rows, Rgb8 colour) {
    for (int row = std::max(0, top); row < std::min(height, top + rows); ++row) {
        for (int column = std::max(0, left); column < std::min(width, left + columns); ++column)
            at(column, row) = colour;
    }
}

void Raster::line(double x0, double y0, double x1, double y1, Rgb8 colour, int thickness) {
    const int steps = std::max(1, static_cast<int>(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
    for (int k = 0; k <= steps; ++k) {
        const double share = static_cast<double>(k) / steps;
        const int before = (thickness - 1) / 2;
        fill(static_cast<int>(std::floor(x0 + share * (x1 - x0))) - before, static_cast<int>(std::floor(y0 + share * (y1 - y0))) - before,
             thickness, thickness, colour);
    }
}

void Raster::text(int left, int top, std::string_view utf8, Rgb8 colour, int scale) {
    for (; !utf8.empty(); left += glyph_width * scale) {
        const Glyph& glyph = next_glyph(utf8);
        for (int row = 0; row < 9; ++row) {
            for (int column = 0; column < 5; ++column) {
                if ((glyph[static_cast<std::size_t>(row)] >> (4 - column) & 1) != 0)
                    fill(left + column * scale, top + row * scale, scale, scale, colour);
            }
        }
    }
}

int text_width(std::string_view utf8, int scale) {
    int width = 0;
    while (!utf8.empty()) {
        next_glyph(utf8);
        width += glyph_width * scale;
    }
    return width;
}

}  // namespace naturel
