#include "cli/comparison_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <set>
#include <span>

#include "cli/comparison_values.h"
#include "cli/svg_sheet.h"
#include "core/false_colour.h"

namespace naturel {
namespace {

using glm::dvec2;

constexpr double sheet_mm = 180.0, edge_mm = 6.0, top_mm = 17.0;

// Okabe and Ito's set, with darker neighbours of its light members: lines and marks on white paper.
constexpr std::array<std::string_view, 6> series_colours{"#0072b2", "#d55e00", "#007a5a",
                                                         "#b0588f", "#8a6d00", "#2b2f33"};
constexpr std::string_view blue = series_colours[0], vermilion = series_colours[1], pale_blue = "#a9d0e8",
                           amber = "#f6dca3", dark = "#2b2f33";

std::string filled(std::string_view colour) {
    return fmt::format("style=\"fill:{}\"", colour);
}

std::string drawn(std::string_view colour, double width_mm, std::string_view dashes = "none") {
    return fmt::format("style=\"fill:none;stroke:{};stroke-width:{};stroke-dasharray:{}\"", colour, width_mm,
                       dashes);
}

std::string hex(const Rgb8& colour) {
    return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]);
}

/// Blue where the method is too dark, orange where it is too bright; place: -1 to 1, clamped.
Rgb8 diverging(double place) {
    constexpr std::array<Rgb8, 7> anchors{{{8, 64, 129},
                                           {44, 123, 182},
                                           {146, 197, 222},
                                           {247, 247, 245},
                                           {246, 177, 103},
                                           {222, 108, 18},
                                           {140, 52, 0}}};
    const double at = (std::clamp(place, -1.0, 1.0) + 1.0) * 0.5 * (anchors.size() - 1);
    const std::size_t first = std::min(static_cast<std::size_t>(at), anchors.size() - 2);
    Rgb8 colour{};
    for (std::size_t k = 0; k < colour.size(); ++k)
        colour[k] = static_cast<std::uint8_t>(std::lround(
            std::lerp(anchors[first][k], anchors[first + 1][k], at - static_cast<double>(first))));
    return colour;
}

/// Part of a file name.
std::string file_word(std::string_view id) {
    std::string word;
    for (const char c : id) {
        const bool keep = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
        if (keep)
            word += c;
        else if (c >= 'A' && c <= 'Z')
            word += static_cast<char>(c - 'A' + 'a');
        else if (!word.empty() && word.back() != '_')
            word += '_';
    }
    while (!word.empty() && word.back() == '_')
        word.pop_back();
    return word.substr(0, 40);
}

std::string tick_text(double value) {
    const std::string text = round_text(std::abs(value));
    return (value < 0.0 ? "−" : "") + text;
}

/// How values of one axis lie on paper.
struct Axis {
    double low = 0.0, high = 1.0;
    bool logarithmic = false;
    double low_mm = 0.0, high_mm = 1.0;
    std::vector<std::string> names{};  ///< of the values 1, 2, ..., where they are no numbers

    double at(double value) const {
        const double share =
            logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
        return std::lerp(low_mm, high_mm, std::clamp(share, 0.0, 1.0));
    }

    std::vector<double> ticks() const {
        std::vector<double> values;
        for (std::size_t k = 1; k <= names.size(); ++k)
            values.push_back(static_cast<double>(k));
        if (!names.empty()) return values;
        if (logarithmic) {
            const auto collect = [&](std::initializer_list<double> digits) {
                values.clear();
                for (int power = static_cast<int>(std::floor(std::log10(low))); power <= std::log10(high);
                     ++power)
                    for (const double digit : digits) {
                        const double value = digit * std::pow(10.0, power);
                        if (value >= low && value <= high) values.push_back(value);
                    }
            };
            collect({1.0});
            if (values.size() < 3) collect({1.0, 2.0, 5.0});
            return values;
        }
        const double wanted = (high - low) / 8.0, power = std::pow(10.0, std::floor(std::log10(wanted)));
        double step = 10.0 * power;
        for (const double digit : {5.0, 2.0, 1.0})
            if (digit * power >= wanted) step = digit * power;
        for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
            values.push_back(k * step + 0.0);
        return values;
    }
};

/// An axis of powers around positive values; none if there are none.
std::optional<Axis> logarithmic_axis(const std::vector<double>& values, double low_mm, double high_mm) {
    double low = std::numeric_limits<double>::infinity(), high = 0.0;
    for (const double value : values)
        if (value > 0.0 && std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
    if (high == 0.0) return std::nullopt;
    const double room = std::max(1.15, std::pow(high / low, 0.06));
    return Axis{low / room, high * room, true, low_mm, high_mm};
}

/// Frame, grid and numbers of a plot. box: of the plot itself.
void draw_axes(SvgSheet& sheet, const PaperBox& box, const Axis& x, const Axis* y, std::string_view x_title,
               std::string_view y_title = {}) {
    for (const double value : x.ticks()) {
        const double at = x.at(value);
        sheet.path("",
                   fmt::format("M{0} {1}V{2}", millimetres(at), millimetres(box.low_mm.y),
                               millimetres(box.high_mm.y)),
                   drawn("#dde1e5", 0.15));
        // Names are long: every other one goes lower.
        const auto place = static_cast<std::size_t>(x.names.empty() ? 0.0 : value);
        sheet.text("small middle", {at, box.high_mm.y + (place % 2 == 0 ? 3.0 : 5.4)},
                   x.names.empty() ? tick_text(value) : x.names[place - 1]);
    }
    if (y)
        for (const double value : y->ticks()) {
            const double at = y->at(value);
            sheet.path("",
                       fmt::format("M{0} {1}H{2}", millimetres(box.low_mm.x), millimetres(at),
                                   millimetres(box.high_mm.x)),
                       drawn("#dde1e5", 0.15));
            sheet.text("small end", {box.low_mm.x - 1.0, at + 0.8}, tick_text(value));
        }
    sheet.rectangle("", box, drawn("#56606b", 0.2));
    sheet.text("middle",
               {0.5 * (box.low_mm.x + box.high_mm.x), box.high_mm.y + (x.names.empty() ? 7.0 : 9.0)},
               x_title);
    if (!y_title.empty()) sheet.text("", {box.low_mm.x, box.low_mm.y - 1.5}, y_title);
}

void draw_title(SvgSheet& sheet, const ComparisonJson& comparison, std::string_view what) {
    sheet.text("title", {edge_mm, 8.0}, what);
    std::string below = text_below(comparison, {"scene", "name"});
    const std::string version = text_below(comparison, {"naturel"});
    if (!version.empty()) below += (below.empty() ? "naturel " : " · naturel ") + version;
    sheet.text("subtitle", {edge_mm, 12.5}, below);
}

std::string finish(const SvgSheet& sheet, const ComparisonJson& comparison, double height_mm,
                   std::string_view what, std::string_view description) {
    const std::string scene = text_below(comparison, {"scene", "name"});
    return sheet.finish({sheet_mm, height_mm},
                        scene.empty() ? std::string(what) : fmt::format("{}: {}", scene, what), description);
}

// Budget

struct BudgetBar {
    std::string name;
    std::optional<double> value, alone;
    bool resolved = true;
};

std::string draw_budget(const ComparisonJson& comparison, const std::string& set) {
    const ComparisonJson& ingredients = value_below(comparison, {"ingredients"});
    if (!ingredients.is_array() || ingredients.empty()) return {};
    // Per cent of the mean reference unless that is not known of the total.
    const bool percent = number_below(comparison, {"total", "sets", set, "total", "rms_percent"}).has_value();
    const std::string unit = percent ? "%" : "lx";
    const auto bars_of = [&](const std::string& statistic) {
        const std::string key = statistic + (percent ? "_percent" : "_lx");
        std::vector<BudgetBar> bars;
        for (const ComparisonJson& ingredient : ingredients)
            bars.push_back({text_below(ingredient, {"name"}),
                            number_below(ingredient, {"sets", set, "total", key}),
                            number_below(ingredient, {"alone_sets", set, "total", key}),
                            is_resolved(comparison, ingredient, set)});
        bars.push_back(
            {"total", number_below(comparison, {"total", "sets", set, "total", key}), std::nullopt, true});
        return bars;
    };
    const std::array<std::vector<BudgetBar>, 2> panels{bars_of("mean"), bars_of("rms")};
    const bool empty = std::ranges::all_of(panels, [](const auto& bars) {
        return std::ranges::none_of(bars, [](const BudgetBar& bar) { return bar.value || bar.alone; });
    });
    if (empty) return {};
    const double band = number_below(comparison, {"reference_error", "sets", set, "total",
                                                  percent ? "rms_percent" : "rms_lx"})
                            .value_or(0.0);

    SvgSheet sheet;
    draw_title(sheet, comparison, fmt::format("Error budget of “{}”", set));
    constexpr double row_mm = 8.0, label_mm = 44.0, gap_mm = 8.0;
    const double plot_mm = 0.5 * (sheet_mm - 2.0 * edge_mm - label_mm - gap_mm);
    const double height_mm = row_mm * static_cast<double>(panels[0].size());
    const double first_mm = top_mm + 6.0;
    std::string description =
        fmt::format("Bars per ingredient, signed mean and RMS in {}, in sequence and alone.", unit);
    for (std::size_t panel = 0; panel < 2; ++panel) {
        double low = panel == 0 ? -band : 0.0, high = band;
        for (const BudgetBar& bar : panels[panel])
            for (const double value : {bar.value.value_or(0.0), bar.alone.value_or(0.0)})
                low = std::min(low, value), high = std::max(high, value);
        if (high - low <= 0.0) high = low + 1.0;
        const double room = 0.06 * (high - low),
                     left = edge_mm + label_mm + static_cast<double>(panel) * (plot_mm + gap_mm);
        const Axis x{panel == 0 ? low - room : 0.0, high + room, false, left, left + plot_mm};
        const PaperBox box{{left, first_mm}, {left + plot_mm, first_mm + height_mm}};
        if (band > 0.0)
            sheet.rectangle("", {{x.at(panel == 0 ? -band : 0.0), box.low_mm.y}, {x.at(band), box.high_mm.y}},
                            filled(amber));
        draw_axes(
            sheet, box, x, nullptr,
            panel == 0 ? fmt::format("signed mean, {}", unit) : fmt::format("root mean square, {}", unit));
        for (std::size_t k = 0; k < panels[panel].size(); ++k) {
            const BudgetBar& bar = panels[panel][k];
            const double middle = first_mm + row_mm * (static_cast<double>(k) + 0.5);
            const bool total = k + 1 == panels[panel].size();
            if (panel == 0) {
                sheet.text("end", {left - 2.0, middle + (bar.resolved ? 0.9 : -0.3)}, bar.name);
                if (!bar.resolved) sheet.text("small end", {left - 2.0, middle + 2.4}, "not resolved");
                description +=
                    fmt::format(" {}: {} {}.", bar.name, report_number(bar.value.value_or(0.0), true), unit);
            }
            const auto draw = [&](const std::optional<double>& value, double upper, double lower,
                                  std::string_view colour) {
                if (!value) return;
                const double from = std::min(x.at(0.0), x.at(*value)), to = std::max(x.at(0.0), x.at(*value));
                const std::string style =
                    bar.resolved
                        ? fmt::format("style=\"fill:{};stroke:{};stroke-width:0.15\"", colour,
                                      total ? dark : blue)
                        : fmt::format(
                              "style=\"fill:#fff;stroke:{};stroke-width:0.2;stroke-dasharray:0.8 0.5\"",
                              blue);
                sheet.rectangle("", {{from, middle + upper}, {to, middle + lower}}, style);
            };
            draw(bar.value, total ? -2.0 : -2.8, total ? 2.0 : 0.2, total ? dark : blue);
            draw(bar.alone, 0.4, 2.8, pale_blue);
        }
        sheet.path("",
                   fmt::format("M{} {}V{}", millimetres(x.at(0.0)), millimetres(box.low_mm.y),
                               millimetres(box.high_mm.y)),
                   drawn(dark, 0.25));
    }
    const double key_mm = first_mm + height_mm + 11.0;
    double at = edge_mm + label_mm;
    const auto key = [&](std::string_view words, const std::string& style) {
        sheet.rectangle("", {{at, key_mm - 2.0}, {at + 4.0, key_mm}}, style);
        sheet.text("", {at + 5.0, key_mm}, words);
        at += 9.0 + text_width_mm(words, 2.6);
    };
    key("in sequence", filled(blue));
    key("alone", filled(pale_blue));
    key("not resolved",
        fmt::format("style=\"fill:#fff;stroke:{};stroke-width:0.2;stroke-dasharray:0.8 0.5\"", blue));
    if (band > 0.0) key("reference's own RMS error", filled(amber));
    return finish(sheet, comparison, key_mm + 4.0, fmt::format("error budget of “{}”", set), description);
}

// Maps and histogram

struct MapPoint {
    dvec2 at{};  ///< m, in the plane drawn
    double reference_lx, method_lx;

    double difference_lx() const { return method_lx - reference_lx; }
};

struct PlanarSet {
    std::vector<MapPoint> points;
    std::array<std::string_view, 2> axes{"x", "y"};
    dvec2 cell_m{0.5};  ///< between neighbours along the axes
};

double median_of(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

/// The steps of a regular grid; else the usual distance between neighbours. points: one or more.
dvec2 cell_size_m(const std::vector<MapPoint>& points) {
    if (points.empty()) return dvec2(0.5);
    dvec2 step(0.0);
    double places = 1.0;
    for (int axis = 0; axis < 2; ++axis) {
        std::set<long> values;  // 0.1 mm
        for (const MapPoint& point : points)
            values.insert(std::lround(1e4 * point.at[axis]));
        std::vector<double> steps;
        for (auto next = values.begin(), last = next++; next != values.end(); last = next++)
            steps.push_back(1e-4 * static_cast<double>(*next - *last));
        if (!steps.empty()) step[axis] = median_of(steps);
        places *= static_cast<double>(values.size());
    }
    // A grid fills most of its rectangle: that of an L-shaped room nearly half.
    const bool regular = static_cast<double>(points.size()) >= 0.4 * places;
    if (regular && step.x > 0.0 && step.y > 0.0) return step;

    std::vector<double> nearest;
    for (const MapPoint& a : std::span(points).first(std::min<std::size_t>(points.size(), 500))) {
        double least = std::numeric_limits<double>::infinity();
        for (const MapPoint& b : points) {
            const double distance = glm::distance(a.at, b.at);
            if (distance >= 1e-6) least = std::min(least, distance);
        }
        if (std::isfinite(least)) nearest.push_back(least);
    }
    const double side = nearest.empty() ? 0.5 : median_of(nearest);
    return {regular && step.x > 0.0 ? step.x : side, regular && step.y > 0.0 ? step.y : side};
}

/// The points of a set in plan, or in elevation where they stand above one another.
PlanarSet planar_set(const ComparisonJson& comparison, const std::string& set) {
    PlanarSet planar;
    const std::vector<std::string> components = [&] {
        std::vector<std::string> names;
        const ComparisonJson& list = value_below(comparison, {"components"});
        if (list.is_array())
            for (const ComparisonJson& name : list)
                names.push_back(name.is_string() ? name.get<std::string>() : "");
        return names.empty() ? std::vector<std::string>{"sky", "sun", "erc", "irc", "total"} : names;
    }();
    const auto total = static_cast<std::size_t>(std::ranges::find(components, "total") - components.begin());
    std::vector<std::array<double, 3>> places;
    std::array<double, 3> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    const ComparisonJson& points = value_below(comparison, {"points"});
    if (!points.is_array()) return planar;
    for (const ComparisonJson& point : points) {
        if (text_below(point, {"set"}) != set) continue;
        const std::vector<double> reference = numbers_below(point, {"reference"}),
                                  method = numbers_below(point, {"method"});
        const auto x = number_below(point, {"x"}), y = number_below(point, {"y"}),
                   z = number_below(point, {"z"});
        if (total >= reference.size() || total >= method.size() || !x || !y || !z) continue;
        if (!std::isfinite(reference[total]) || !std::isfinite(method[total])) continue;
        places.push_back({*x, *y, *z});
        for (std::size_t k = 0; k < 3; ++k)
            low[k] = std::min(low[k], places.back()[k]), high[k] = std::max(high[k], places.back()[k]);
        planar.points.push_back({{}, reference[total], method[total]});
    }
    if (planar.points.empty()) return planar;
    const auto flat = [&](std::size_t axis) { return high[axis] - low[axis] < 1e-3; };
    std::array<std::size_t, 2> axes{0, 1};
    if (!flat(2) && flat(1))
        axes = {0, 2};
    else if (!flat(2) && flat(0))
        axes = {1, 2};
    constexpr std::array<std::string_view, 3> names{"x", "y", "z"};
    planar.axes = {names[axes[0]], names[axes[1]]};
    for (std::size_t k = 0; k < places.size(); ++k)
        planar.points[k].at = {places[k][axes[0]], places[k][axes[1]]};

    planar.cell_m = cell_size_m(planar.points);
    return planar;
}

std::vector<double> map_values(const PlanarSet& set, const std::function<double(const MapPoint&)>& value) {
    std::vector<double> values;
    std::ranges::transform(set.points, std::back_inserter(values), value);
    return values;
}

std::string draw_maps(const ComparisonJson& comparison, const std::string& id, const PlanarSet& set) {
    dvec2 low(std::numeric_limits<double>::infinity()), high(-std::numeric_limits<double>::infinity());
    for (const MapPoint& point : set.points)
        low = glm::min(low, point.at - 0.5 * set.cell_m), high = glm::max(high, point.at + 0.5 * set.cell_m);
    constexpr double gap_mm = 8.0, left_mm = edge_mm + 6.0;
    const double panel_mm = (sheet_mm - left_mm - edge_mm - 2.0 * gap_mm) / 3.0;
    const double scale = std::min(panel_mm / (high.x - low.x), 110.0 / (high.y - low.y));  // mm per m

    std::vector<double> levels = map_values(set, [](const MapPoint& p) { return p.reference_lx; });
    for (const MapPoint& point : set.points)
        levels.push_back(point.method_lx);
    const double largest = round_maximum(levels);
    std::ranges::sort(levels);
    // Sun beside shade, or a window: a linear scale would show the brightest place alone.
    const double median = levels[levels.size() / 2];
    const bool logarithmic = median > 0.0 && levels.back() > 8.0 * median;
    const auto first_lit = std::ranges::find_if(levels, [](double level) { return level > 0.0; });
    const double decades =
        logarithmic ? std::clamp(std::ceil(std::log10(largest / *first_lit) - 1e-9), 1.0, 3.0) : 1.0;
    const ColourScale scale_of_levels(logarithmic ? ColourScaleKind::logarithmic : ColourScaleKind::linear,
                                      largest, decades);
    std::vector<double> sizes =
        map_values(set, [](const MapPoint& p) { return std::abs(p.difference_lx()); });
    std::ranges::sort(sizes);
    // A few bad points must not bleach all others.
    const double most = sizes[(sizes.size() - 1) * 95 / 100];
    const bool beyond = most > 0.0 && sizes.back() > 5.0 * most;
    const double limit = round_maximum(std::array{beyond ? most : sizes.back()});

    SvgSheet sheet;
    draw_title(sheet, comparison, fmt::format("Total illuminance of “{}”", id));
    const double first_mm = top_mm + 5.0, map_height_mm = scale * (high.y - low.y);
    const std::string kind = logarithmic ? ", logarithmic" : "";
    const std::array<std::string, 3> titles{
        "Reference, lx" + kind, "Method, lx" + kind,
        fmt::format("Method − reference, lx{}", beyond ? "; worst beyond" : "")};
    for (std::size_t panel = 0; panel < 3; ++panel) {
        const double left = left_mm + static_cast<double>(panel) * (panel_mm + gap_mm);
        const PaperBox box{{left, first_mm}, {left + scale * (high.x - low.x), first_mm + map_height_mm}};
        sheet.rectangle("", box, filled("#e9ebee"));
        for (const MapPoint& point : set.points) {
            const dvec2 centre{left + scale * (point.at.x - low.x), first_mm + scale * (high.y - point.at.y)};
            // 0.03 mm over the edge, or seams show between the cells.
            const dvec2 half = 0.5 * scale * set.cell_m + 0.03;
            const Rgb8 colour =
                panel == 2 ? diverging(point.difference_lx() / limit)
                           : scale_of_levels.colour(panel == 0 ? point.reference_lx : point.method_lx);
            sheet.rectangle("", {centre - half, centre + half},
                            filled(hex(colour)) + " shape-rendering=\"crispEdges\"");
        }
        const Axis x{low.x, high.x, false, box.low_mm.x, box.high_mm.x},
            y{low.y, high.y, false, box.high_mm.y, box.low_mm.y};
        sheet.rectangle("", box, drawn("#56606b", 0.2));
        for (const double value : x.ticks())
            sheet.text("small middle", {x.at(value), box.high_mm.y + 3.0}, tick_text(value));
        for (const double value : y.ticks())
            sheet.text("small end", {left - 1.0, y.at(value) + 0.8}, tick_text(value));
        sheet.text("middle", {0.5 * (box.low_mm.x + box.high_mm.x), box.high_mm.y + 6.5},
                   fmt::format("{}, m ({} upwards)", set.axes[0], set.axes[1]));
        sheet.text("", {left, first_mm - 1.5}, titles[panel]);

        const PaperBox bar{{left, box.high_mm.y + 10.0}, {left + panel_mm, box.high_mm.y + 13.0}};
        constexpr int steps = 60;
        for (int k = 0; k < steps; ++k) {
            // Each step reaches to the end and the next covers it: no seams.
            const double from = static_cast<double>(k) / steps, middle = from + 0.5 / steps;
            sheet.rectangle("", {{std::lerp(bar.low_mm.x, bar.high_mm.x, from), bar.low_mm.y}, bar.high_mm},
                            filled(hex(panel == 2 ? diverging(2.0 * middle - 1.0) : viridis(middle))));
        }
        sheet.rectangle("", bar, drawn("#56606b", 0.15));
        const double marks = panel < 2 && logarithmic ? decades : 2.0;
        for (double mark = 0.0; mark <= marks; ++mark) {
            const double share = mark / marks;
            const double value = panel == 2 ? limit * (2.0 * share - 1.0) : scale_of_levels.value_at(share);
            const std::string text = (panel == 2 && value > 0.0 ? "+" : "") + tick_text(value);
            sheet.text(share == 0.0   ? "small"
                       : share == 1.0 ? "small end"
                                      : "small middle",
                       {std::lerp(bar.low_mm.x, bar.high_mm.x, share), bar.high_mm.y + 3.0}, text);
        }
    }
    return finish(sheet, comparison, first_mm + map_height_mm + 20.0, fmt::format("maps of “{}”", id),
                  fmt::format("Total illuminance at {} points in {}: reference and method on one scale up to "
                              "{} lx, and their difference up to {} lx either way.",
                              set.points.size(), set.axes[1] == "z" ? "elevation" : "plan",
                              round_text(largest), round_text(limit)));
}

std::string draw_histogram(const ComparisonJson& comparison, const std::string& id, const PlanarSet& set) {
    std::vector<double> percent;
    for (const MapPoint& point : set.points)
        if (point.reference_lx > 0.0) percent.push_back(100.0 * point.difference_lx() / point.reference_lx);
    if (percent.empty()) return {};
    std::ranges::sort(percent);
    const double low = percent.front(), high = percent.back();
    // Rice's rule, 2 n^(1/3), and a few more since the edges are round.
    const double wanted =
        std::clamp(std::ceil(2.0 * std::cbrt(static_cast<double>(percent.size()))) + 4.0, 9.0, 31.0);
    const double width = high > low ? round_maximum(std::array{(high - low) / wanted}) : 1.0;
    const double first = std::floor(low / width);
    std::vector<std::size_t> counts(static_cast<std::size_t>(std::floor(high / width) - first) + 1);
    for (const double value : percent)
        ++counts[static_cast<std::size_t>(std::floor(value / width) - first)];

    SvgSheet sheet;
    draw_title(sheet, comparison, fmt::format("Errors of “{}”", id));
    const PaperBox box{{edge_mm + 10.0, top_mm + 6.0}, {sheet_mm - edge_mm, top_mm + 66.0}};
    const Axis x{width * first, width * (first + static_cast<double>(counts.size())), false, box.low_mm.x,
                 box.high_mm.x};
    const Axis y{0.0, 1.08 * static_cast<double>(*std::ranges::max_element(counts)), false, box.high_mm.y,
                 box.low_mm.y};
    draw_axes(sheet, box, x, &y, "method − reference, % of the reference at the point", "points");
    for (std::size_t k = 0; k < counts.size(); ++k) {
        const double from = width * (first + static_cast<double>(k));
        sheet.rectangle(
            "", {{x.at(from), y.at(static_cast<double>(counts[k]))}, {x.at(from + width), box.high_mm.y}},
            fmt::format("style=\"fill:{};stroke:#fff;stroke-width:0.2\"",
                        from + 0.5 * width < 0.0 ? blue : "#e08214"));
    }
    const auto quantile = [&](double share) {
        const double at = share * static_cast<double>(percent.size() - 1);
        const auto below = static_cast<std::size_t>(at);
        return std::lerp(percent[below], percent[std::min(below + 1, percent.size() - 1)],
                         at - static_cast<double>(below));
    };
    std::string words = fmt::format("{} points", percent.size());
    for (const double share : {0.05, 0.5, 0.95})
        words += fmt::format("; {} at {:.0f} %", report_number(quantile(share), true) + " %", 100.0 * share);
    sheet.text("small", {box.low_mm.x, box.high_mm.y + 12.0}, "Quantiles: " + words);
    return finish(sheet, comparison, box.high_mm.y + 16.0, fmt::format("errors of “{}”", id), words);
}

// Convergence

struct CurvePoint {
    std::string label;  ///< the value in words, if it is one
    double value, rms_percent, seconds;
    bool pareto;
};

struct Curve {
    std::string parameter, unit, slope;
    std::vector<CurvePoint> points;

    /// Settings that are words, as the spacing of cells, have no order and no slope.
    bool in_words() const {
        return std::ranges::any_of(points, [](const CurvePoint& point) {
            return !point.label.empty() &&
                   std::string_view("0123456789.+-").find(point.label[0]) == std::string_view::npos;
        });
    }
};

std::string slope_text(double slope) {
    return fmt::format("{}{:.2f}", slope < 0.0 ? "−" : "", std::abs(slope));
}

std::vector<Curve> sweeps_of(const ComparisonJson& comparison) {
    std::vector<Curve> sweeps;
    const ComparisonJson& list = value_below(comparison, {"sweeps"});
    if (!list.is_array()) return sweeps;
    for (const ComparisonJson& entry : list) {
        Curve sweep{text_below(entry, {"parameter"}), text_below(entry, {"unit"}), {}, {}};
        if (const auto slope = number_below(entry, {"slope"})) {
            sweep.slope = "slope " + slope_text(*slope);
            const auto low = number_below(entry, {"slope_low"}), high = number_below(entry, {"slope_high"});
            if (low && high) sweep.slope += fmt::format(" ({} to {})", slope_text(*low), slope_text(*high));
        }
        const ComparisonJson& points = value_below(entry, {"points"});
        if (points.is_array())
            for (const ComparisonJson& point : points) {
                const ComparisonJson& front = value_below(point, {"pareto"});
                std::string label = text_below(point, {"label"});
                std::ranges::replace(label, '_', ' ');
                sweep.points.push_back({std::move(label), number_below(point, {"value"}).value_or(0.0),
                                        number_below(point, {"rms_percent"}).value_or(0.0),
                                        number_below(point, {"seconds"}).value_or(0.0),
                                        front.is_boolean() && front.get<bool>()});
            }
        if (std::ranges::any_of(sweep.points, [](const CurvePoint& p) { return p.rms_percent > 0.0; }))
            sweeps.push_back(std::move(sweep));
    }
    return sweeps;
}

/// Marks that differ in shape, not in colour alone.
void draw_mark(SvgSheet& sheet, std::size_t series, const dvec2& at, double size, bool front) {
    const std::string style = fmt::format("style=\"fill:{};stroke:{};stroke-width:{}\"",
                                          series_colours[series % series_colours.size()],
                                          front ? "#111" : "#fff", front ? 0.45 : 0.15);
    const auto x = [&](double shift) { return millimetres(at.x + shift * size); };
    const auto y = [&](double shift) { return millimetres(at.y + shift * size); };
    switch (series % 5) {
        case 0:
            sheet.path("",
                       fmt::format("M{0} {1}A{2} {2} 0 1 0 {3} {1}A{2} {2} 0 1 0 {0} {1}Z", x(-1.0), y(0.0),
                                   millimetres(size), x(1.0)),
                       style);
            break;
        case 1:
            sheet.path("",
                       fmt::format("M{} {}L{} {}L{} {}L{} {}Z", x(-1.2), y(0), x(0), y(-1.2), x(1.2), y(0),
                                   x(0), y(1.2)),
                       style);
            break;
        case 2:
            sheet.path("", fmt::format("M{} {}L{} {}L{} {}Z", x(-1.1), y(0.9), x(0), y(-1.1), x(1.1), y(0.9)),
                       style);
            break;
        case 3:
            sheet.path("",
                       fmt::format("M{} {}L{} {}L{} {}Z", x(-1.1), y(-0.9), x(0), y(1.1), x(1.1), y(-0.9)),
                       style);
            break;
        default:
            sheet.rectangle("", {at - 0.9 * size, at + 0.9 * size}, style);
    }
}

std::string draw_convergence(const ComparisonJson& comparison) {
    const std::vector<Curve> sweeps = sweeps_of(comparison);
    if (sweeps.empty()) return {};
    std::vector<double> errors, seconds;
    for (const Curve& sweep : sweeps)
        for (const CurvePoint& point : sweep.points)
            errors.push_back(point.rms_percent), seconds.push_back(point.seconds);

    SvgSheet sheet;
    draw_title(sheet, comparison, "Convergence");
    constexpr double gap_mm = 18.0, left_mm = edge_mm + 9.0, panel_height_mm = 52.0,
                     row_mm = panel_height_mm + 19.0;
    const double panel_mm = 0.5 * (sheet_mm - left_mm - edge_mm - gap_mm);
    std::size_t panels = 0;
    const auto next_box = [&] {
        const dvec2 low{left_mm + static_cast<double>(panels % 2) * (panel_mm + gap_mm),
                        top_mm + 7.0 + row_mm * static_cast<double>(panels / 2)};
        ++panels;
        return PaperBox{low, low + dvec2{panel_mm, panel_height_mm}};
    };
    const auto plot = [&](const PaperBox& box, const Axis& x, std::size_t series, const Curve& sweep,
                          double CurvePoint::*abscissa) {
        const Axis y = *logarithmic_axis(errors, box.high_mm.y, box.low_mm.y);
        std::string line;
        for (const CurvePoint& point : sweep.points)
            if (point.*abscissa > 0.0 && point.rms_percent > 0.0)
                line += fmt::format("{}{} {}", line.empty() ? 'M' : 'L', millimetres(x.at(point.*abscissa)),
                                    millimetres(y.at(point.rms_percent)));
        if (!sweep.in_words())
            sheet.path("", line, drawn(series_colours[series % series_colours.size()], 0.3));
        for (const CurvePoint& point : sweep.points)
            if (point.*abscissa > 0.0 && point.rms_percent > 0.0)
                draw_mark(sheet, series, {x.at(point.*abscissa), y.at(point.rms_percent)},
                          point.pareto ? 1.4 : 1.0, point.pareto);
    };
    if (const auto any = logarithmic_axis(seconds, 0.0, 1.0)) {
        const PaperBox box = next_box();
        const Axis x{any->low, any->high, true, box.low_mm.x, box.high_mm.x},
            y = *logarithmic_axis(errors, box.high_mm.y, box.low_mm.y);
        draw_axes(sheet, box, x, &y, "time, s", "RMS error, %, of all sweeps (dark rim: Pareto front)");
        for (std::size_t k = 0; k < sweeps.size(); ++k)
            plot(box, x, k, sweeps[k], &CurvePoint::seconds);
    }
    std::string description = "Root mean square error, on logarithmic axes.";
    for (std::size_t k = 0; k < sweeps.size(); ++k) {
        Curve sweep = sweeps[k];
        std::vector<double> values;
        std::vector<std::string> names;
        for (CurvePoint& point : sweep.points) {
            values.push_back(point.value);
            names.push_back(point.label);
            if (sweep.in_words()) point.value = static_cast<double>(names.size());
        }
        std::optional<Axis> x =
            sweep.in_words()
                ? Axis{.low = 0.5, .high = static_cast<double>(names.size()) + 0.5, .names = names}
                : logarithmic_axis(values, 0.0, 1.0);
        if (!x) continue;
        const PaperBox box = next_box();
        x->low_mm = box.low_mm.x;
        x->high_mm = box.high_mm.x;
        const Axis y = *logarithmic_axis(errors, box.high_mm.y, box.low_mm.y);
        const std::string name =
            sweep.unit.empty() ? sweep.parameter : fmt::format("{}, {}", sweep.parameter, sweep.unit);
        draw_axes(sheet, box, *x, &y, name,
                  sweep.slope.empty() ? "RMS error, %" : "RMS error, %: " + sweep.slope);
        plot(box, *x, k, sweep, &CurvePoint::value);
        description +=
            fmt::format(" {}: {}.", sweep.parameter, sweep.slope.empty() ? "no slope" : sweep.slope);
    }
    if (panels == 0) return {};
    const double key_mm = top_mm + 7.0 + row_mm * static_cast<double>((panels + 1) / 2) - 6.0;
    double at = left_mm;
    for (std::size_t k = 0; k < sweeps.size(); ++k) {
        draw_mark(sheet, k, {at + 1.5, key_mm - 0.9}, 1.1, false);
        sheet.text("", {at + 4.0, key_mm}, sweeps[k].parameter);
        at += 9.0 + text_width_mm(sweeps[k].parameter, 2.6);
    }
    return finish(sheet, comparison, key_mm + 4.0, "convergence", description);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> comparison_figures(const ComparisonJson& comparison) {
    std::vector<std::pair<std::string, std::string>> figures;
    const auto add = [&](std::string name, std::string svg) {
        if (!svg.empty()) figures.emplace_back(std::move(name), std::move(svg));
    };
    std::set<std::string> words;
    std::size_t number = 0;
    for (const std::string& id : sensor_sets(comparison)) {
        ++number;
        std::string word = file_word(id);
        // Ids that a file name can't tell apart are numbered.
        if (word.empty() || words.contains(word))
            word = fmt::format("{}{}set_{}", word, word.empty() ? "" : "_", number);
        words.insert(word);
        add(fmt::format("budget_{}.svg", word), draw_budget(comparison, id));
        const PlanarSet planar = planar_set(comparison, id);
        if (planar.points.empty()) continue;
        add(fmt::format("maps_{}.svg", word), draw_maps(comparison, id, planar));
        add(fmt::format("histogram_{}.svg", word), draw_histogram(comparison, id, planar));
    }
    add("convergence.svg", draw_convergence(comparison));
    return figures;
}

}  // namespace naturel
