#include "cli/false_colour.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "core/errors.h"
#include "core/isolines.h"

namespace naturel {
namespace {

constexpr Rgb8 paper{245, 245, 245}, ink{30, 30, 30}, no_value{200, 200, 200};
/// Sizes in pixels. They grow with the field, so that what is written stays as large beside it: 1 up to 1349 pixels.
struct PictureSizes {
    int factor, line_height, bar_width, gap;

    PictureSizes(int width, int height) : factor(std::max(1, static_cast<int>(std::lround(std::max(width, height) / 900.0)))),
                                   line_height(factor * (2 * glyph_height + 4)), bar_width(factor * 24), gap(factor * 12) {}
    int text_scale() const { return 2 * factor; }
    int width_of(std::string_view text) const { return text_width(text, text_scale()); }
};

/// Dark signs on bright colours and the other way round.
Rgb8 sign_colour(const ColourScale& scale, double value) { return scale.place(value) > 0.5 ? Rgb8{0, 0, 0} : Rgb8{255, 255, 255}; }

struct LabelPatch {
    int left, top, columns, rows;

    bool overlaps(const LabelPatch& other) const {
        return left < other.left + other.columns && other.left < left + columns && top < other.top + other.rows && other.top < top + rows;
    }
};

/// Lines through the centres of pixels, and the value on each that is long enough, where it has a place without another label.
void draw_contours(std::span<const double> field, int width, int height, const FalseColourOptions& options, const ColourScale& scale,
                   const PictureSizes& sizes, int top, Raster& raster) {
    struct LevelLine {
        std::vector<glm::dvec2> points;
        double value;
    };
    std::vector<LevelLine> lines;
    for (const double value : options.contours) {
        for (Isoline& line : isolines(field, width, height, value, options.parts)) {
            if (line.closed) line.points.push_back(line.points.front());
            for (std::size_t k = 1; k < line.points.size(); ++k) {
                const glm::dvec2 a = line.points[k - 1] + 0.5, b = line.points[k] + 0.5;
                raster.line(a.x, a.y + top, b.x, b.y + top, sign_colour(scale, value), sizes.factor);
            }
            lines.push_back({std::move(line.points), value});
        }
    }
    // Over all lines, on a patch of the colour of the line. The longest choose first.
    std::ranges::stable_sort(lines, std::ranges::greater{}, [](const LevelLine& line) { return line.points.size(); });
    std::vector<LabelPatch> labels;
    for (const LevelLine& line : lines) {
        // A line crosses about one edge of a pixel per pixel of its length.
        const std::string text = round_text(line.value);
        if (line.points.size() <= 2 * static_cast<std::size_t>(sizes.width_of(text))) continue;
        for (const double share : {0.5, 0.35, 0.65, 0.2, 0.8}) {
            const glm::dvec2 middle = line.points[static_cast<std::size_t>(share * static_cast<double>(line.points.size()))] + 0.5;
            const int columns = sizes.width_of(text) + 4 * sizes.factor, rows = sizes.line_height - 4 * sizes.factor;
            if (columns > width || rows > height) break;
            const LabelPatch box{std::clamp(static_cast<int>(middle.x) - columns / 2, 0, width - columns),
                          top + std::clamp(static_cast<int>(middle.y) - rows / 2, 0, height - rows), columns, rows};
            if (std::ranges::any_of(labels, [&](const LabelPatch& other) { return box.overlaps(other); })) continue;
            labels.push_back(box);
            const Rgb8 colour = sign_colour(scale, line.value);
            raster.fill(box.left, box.top, box.columns, box.rows, colour);
            raster.text(box.left + 3 * sizes.factor, box.top + 3 * sizes.factor, text, colour[0] == 0 ? Rgb8{255, 255, 255} : Rgb8{0, 0, 0}, sizes.text_scale());
            break;
        }
    }
}

struct Label {
    double value;
    std::string text;
};

/// Where the colours of the legend stand.
struct ColourBar {
    int left, top, rows;

    int row_of(const ColourScale& scale, double value) const { return top + static_cast<int>(std::lround((1.0 - scale.place(value)) * (rows - 1))); }
};

/// Both ends of the scale, and the round values between them that leave the ends room. Values beyond an end have its colour: it says so.
std::vector<Label> legend_labels(std::span<const double> field, const ColourScale& scale, const ColourBar& bar, const PictureSizes& sizes) {
    const double lowest = scale.value_at(0.0), highest = scale.maximum();
    const auto beyond = [&](auto is_beyond) { return std::ranges::any_of(field, [&](double value) { return std::isfinite(value) && is_beyond(value); }); };
    // Rounding of the values at the ends does not count as beyond.
    constexpr double slack = 1e-9;
    std::vector<Label> labels;
    labels.push_back({lowest, (beyond([&](double value) { return value < lowest * (1.0 - slack); }) ? "\u2264 " : "") + round_text(lowest)});
    labels.push_back({highest, (beyond([&](double value) { return value > highest * (1.0 + slack); }) ? "\u2265 " : "") + round_text(highest)});
    for (const double value : scale.round_values(std::clamp(bar.rows / (sizes.line_height + 6 * sizes.factor), 2, 12))) {
        const int row = bar.row_of(scale, value);
        if (row - bar.top >= sizes.line_height && bar.top + bar.rows - 1 - row >= sizes.line_height) labels.push_back({value, round_text(value)});
    }
    return labels;
}

void draw_legend(const ColourScale& scale, const FalseColourOptions& options, const std::vector<Label>& labels, const PictureSizes& sizes,
                 const ColourBar& bar, Raster& raster) {
    raster.text(bar.left, bar.top - sizes.line_height - 8 * sizes.factor, options.unit, ink, sizes.text_scale());
    for (int row = 0; row < bar.rows; ++row)
        raster.fill(bar.left, bar.top + row, sizes.bar_width, 1, viridis(1.0 - (row + 0.5) / bar.rows));
    for (const double contour : options.contours) {
        if (contour < scale.value_at(0.0) || contour > scale.maximum()) continue;  // it has no place
        raster.fill(bar.left, bar.row_of(scale, contour), sizes.bar_width, sizes.factor, sign_colour(scale, contour));
    }
    for (const Label& label : labels) {
        const int row = bar.row_of(scale, label.value);
        raster.fill(bar.left + sizes.bar_width, row, 5 * sizes.factor, sizes.factor, ink);
        raster.text(bar.left + sizes.bar_width + 9 * sizes.factor, row - sizes.factor * (glyph_height - 3), label.text, ink, sizes.text_scale());
    }
}

/// Words in two lines: what grey means stands beside its square.
std::pair<std::string, std::string> in_two_lines(const std::string& words) {
    const std::size_t blank = words.rfind(' ');
    if (blank == std::string::npos) return {words, ""};
    return {words.substr(0, blank), words.substr(blank + 1)};
}

}  // namespace

ColourScale colour_scale(std::span<const double> field, const FalseColourOptions& options) {
    return ColourScale(options.scale, options.maximum.value_or(round_maximum(field)), options.decades);
}

int field_top(const FalseColourOptions& options, int width, int height) {
    const PictureSizes sizes(width, height);
    return options.title.empty() ? 0 : sizes.line_height + 8 * sizes.factor;
}

Raster draw_false_colour(std::span<const double> field, int width, int height, const FalseColourOptions& options) {
    NATUREL_EXPECT(field.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const ColourScale scale = colour_scale(field, options);
    const PictureSizes sizes(width, height);
    const int top = field_top(options, width, height);
    const bool has_grey = !options.grey_means.empty() && std::ranges::any_of(field, [](double value) { return !std::isfinite(value); });
    const int key_rows = has_grey ? 2 * sizes.line_height + sizes.gap : 0;

    // The legend needs room for two values whatever the size of the field.
    const int bar_top = top + sizes.line_height + 10 * sizes.factor, below_bar = sizes.factor * (glyph_height + 2) + key_rows;
    const ColourBar bar{width + sizes.gap, bar_top, std::max(3 * sizes.line_height, top + height - bar_top - below_bar)};
    const std::vector<Label> labels = legend_labels(field, scale, bar, sizes);
    const auto [key, rest_of_key] = in_two_lines(options.grey_means);
    int label_width = sizes.width_of(options.unit) - sizes.bar_width;
    for (const Label& label : labels) label_width = std::max(label_width, 9 * sizes.factor + sizes.width_of(label.text));
    if (has_grey) label_width = std::max(label_width, 9 * sizes.factor + std::max(sizes.width_of(key), sizes.width_of(rest_of_key)));
    const int whole_height = std::max(top + height, bar_top + bar.rows + below_bar);
    const int whole_width = std::max(width + sizes.gap + sizes.bar_width + label_width + sizes.gap, sizes.width_of(options.title) + 2 * sizes.gap);

    Raster raster(whole_width, whole_height, paper);
    raster.text(sizes.gap, 6 * sizes.factor, options.title, ink, sizes.text_scale());
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            const double value = field[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                       static_cast<std::size_t>(column)];
            raster.at(column, row + top) = std::isfinite(value) ? scale.colour(value) : no_value;
        }
    }
    draw_contours(field, width, height, options, scale, sizes, top, raster);
    draw_legend(scale, options, labels, sizes, bar, raster);
    if (has_grey) {
        const int key_top = bar_top + bar.rows + below_bar - key_rows + sizes.gap / 2;
        const int text_left = bar.left + sizes.bar_width + 9 * sizes.factor;
        raster.fill(bar.left, key_top, sizes.bar_width, sizes.line_height, no_value);
        raster.text(text_left, key_top, key, ink, sizes.text_scale());
        raster.text(text_left, key_top + sizes.line_height, rest_of_key, ink, sizes.text_scale());
    }
    return raster;
}

}  // namespace naturel
