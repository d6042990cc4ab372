#include "cli/false_colour.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/isolines.h"

namespace naturel {
namespace {

constexpr Rgb8 paper{245, 245, 245}, ink{30, 30, 30}, no_value{200, 200, 200};
constexpr int line_height = 2 * glyph_height + 4;
constexpr int bar_width = 24, gap = 12;

/// Dark signs on bright colours and the other way round.
Rgb8 sign_colour(const ColourScale& scale, double value) { return scale.place(value) > 0.5 ? Rgb8{0, 0, 0} : Rgb8{255, 255, 255}; }

/// Lines through the centres of pixels, and the value on the longest of each level.
void draw_contours(std::span<const double> field, int width, int height, const std::vector<double>& values,
                   const ColourScale& scale, int top, Raster& raster) {
    struct Place {
        glm::dvec2 middle;
        std::string text;
        Rgb8 colour;
    };
    std::vector<Place> labels;
    for (const double value : values) {
        const Rgb8 colour = sign_colour(scale, value);
        std::vector<glm::dvec2> longest;
        for (Isoline& line : isolines(field, width, height, value)) {
            if (line.closed) line.points.push_back(line.points.front());
            for (std::size_t k = 1; k < line.points.size(); ++k) {
                const glm::dvec2 a = line.points[k - 1] + 0.5, b = line.points[k] + 0.5;
                raster.line(a.x, a.y + top, b.x, b.y + top, colour);
            }
            if (line.points.size() > longest.size()) longest = std::move(line.points);
        }
        // A line crosses about one edge of a pixel per pixel of its length.
        const std::string text = round_text(value);
        if (longest.size() > 2 * static_cast<std::size_t>(text_width(text))) labels.push_back({longest[longest.size() / 2] + 0.5, text, colour});
    }
    // Over all lines, on a patch of the colour of the line.
    for (const Place& label : labels) {
        const int columns = text_width(label.text) + 4, rows = line_height - 4;
        const int left = std::clamp(static_cast<int>(label.middle.x) - columns / 2, 0, std::max(0, width - columns));
        const int first = top + std::clamp(static_cast<int>(label.middle.y) - rows / 2, 0, std::max(0, height - rows));
        raster.fill(left, first, std::min(columns, width - left), std::min(rows, top + height - first), label.colour);
        raster.text(left + 3, first + 3, label.text, label.colour[0] == 0 ? Rgb8{255, 255, 255} : Rgb8{0, 0, 0});
    }
}

struct Label {
    double value;
    std::string text;
};

/// bar_top, bar_rows: where the colours stand.
void draw_legend(const ColourScale& scale, const FalseColourOptions& options, const std::vector<Label>& labels,
                 int left, int bar_top, int bar_rows, Raster& raster) {
    raster.text(left, bar_top - line_height - 8, options.unit, ink);
    for (int row = 0; row < bar_rows; ++row) {
        const double place = 1.0 - (row + 0.5) / bar_rows;
        raster.fill(left, bar_top + row, bar_width, 1, viridis(place));
    }
    const auto row_of = [&](double value) {
        return bar_top + static_cast<int>(std::lround((1.0 - scale.place(value)) * (bar_rows - 1)));
    };
    for (const double contour : options.contours)
        raster.fill(left, row_of(contour), bar_width, 1, sign_colour(scale, contour));
    for (const Label& label : labels) {
        raster.fill(left + bar_width, row_of(label.value), 5, 1, ink);
        raster.text(left + bar_width + 9, row_of(label.value) - glyph_height + 3, label.text, ink);
    }
}

}  // namespace

ColourScale colour_scale(std::span<const double> field, const FalseColourOptions& options) {
    return ColourScale(options.scale, options.maximum.value_or(round_maximum(field)), options.decades);
}

int field_top(const FalseColourOptions& options) { return options.title.empty() ? 0 : line_height + 8; }

Raster draw_false_colour(std::span<const double> field, int width, int height, const FalseColourOptions& options) {
    NATUREL_EXPECT(field.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const ColourScale scale = colour_scale(field, options);
    const int top = field_top(options);

    // The legend needs room for two values whatever the size of the field.
    const int least_bar_rows = 3 * line_height;
    const int bar_top = top + line_height + 10;
    const int bar_rows = std::max(least_bar_rows, top + height - bar_top - glyph_height - 2);
    std::vector<Label> labels;
    int label_width = text_width(options.unit) - bar_width;
    for (const double value : scale.round_values(std::clamp(bar_rows / (line_height + 6), 2, 12))) {
        labels.push_back({value, round_text(value)});
        label_width = std::max(label_width, 9 + text_width(labels.back().text));
    }
    const int whole_height = std::max(top + height, bar_top + bar_rows + glyph_height + 2);
    const int whole_width = std::max(width + gap + bar_width + label_width + gap, text_width(options.title) + 2 * gap);

    Raster raster(whole_width, whole_height, paper);
    raster.text(gap, 6, options.title, ink);
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            const double value = field[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                       static_cast<std::size_t>(column)];
            raster.at(column, row + top) = std::isfinite(value) ? scale.colour(value) : no_value;
        }
    }
    draw_contours(field, width, height, options.contours, scale, top, raster);
    draw_legend(scale, options, labels, width + gap, bar_top, bar_rows, raster);
    return raster;
}

}  // namespace naturel
