#include "cli/comparison_report.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string_view>

#include "cli/comparison_values.h"
#include "cli/page_template.h"
#include "cli/report_assets.h"
#include "cli/svg_sheet.h"

namespace naturel {
namespace {

struct Size {
    double value;
    std::string unit;

    std::string text(bool plus = false) const { return report_number(value, plus, 2) + "\u00a0" + unit; }
};

/// A statistic of the total illuminance, per cent of the mean where that is known.
std::optional<Size> size_of(const ComparisonJson& sets, const std::string& set, const std::string& name) {
    if (const auto percent = number_below(sets, {set, "total", name + "_percent"}))
        return Size{*percent, "%"};
    if (const auto lx = number_below(sets, {set, "total", name + "_lx"})) return Size{*lx, "lx"};
    return std::nullopt;
}

/// Of the ingredients that are resolved, the one with the largest RMS error.
const ComparisonJson* largest_ingredient(const ComparisonJson& comparison, const std::string& set) {
    const ComparisonJson* largest = nullptr;
    double most = 0.0;
    const ComparisonJson& ingredients = value_below(comparison, {"ingredients"});
    if (!ingredients.is_array()) return nullptr;
    for (const ComparisonJson& ingredient : ingredients) {
        const auto rms = number_below(ingredient, {"sets", set, "total", "rms_lx"});
        if (rms && *rms > most && is_resolved(comparison, ingredient, set))
            most = *rms, largest = &ingredient;
    }
    return largest;
}

}  // namespace

std::string comparison_headline(const ComparisonJson& comparison) {
    const std::string set = largest_set(comparison);
    const ComparisonJson& total = value_below(comparison, {"total", "sets"});
    const ComparisonJson& reference = value_below(comparison, {"reference_error", "sets"});
    const auto mean = size_of(total, set, "mean"), rms = size_of(total, set, "rms");
    if (!rms) return "The comparison holds no total error.";

    std::string words =
        fmt::format("On “{}”, the method differs from the reference by {} RMS", set, rms->text());
    if (mean) {
        const Size size{std::abs(mean->value), mean->unit};
        words += mean->value == 0.0 ? ", neither too dark nor too bright on average"
                                    : fmt::format(" and is {} too {} on average", size.text(),
                                                  mean->value < 0.0 ? "dark" : "bright");
    }
    if (const auto worst = number_below(total, {set, "total", "worst_lx"}))
        words += fmt::format("; at the worst place by {}\u00a0lx", report_number(*worst, true, 2));
    words += ".";

    if (const ComparisonJson* largest = largest_ingredient(comparison, set)) {
        words += fmt::format(" The largest ingredient is {}", text_below(*largest, {"name"}));
        const ComparisonJson& sets = value_below(*largest, {"sets"});
        if (const auto size = size_of(sets, set, "rms")) words += fmt::format(" with {} RMS", size->text());
        if (const auto size = size_of(sets, set, "mean"))
            words += fmt::format(" and a mean of {}", size->text(true));
        words += ".";
    }
    if (const auto own = size_of(reference, set, "rms")) {
        const auto own_lx = number_below(reference, {set, "total", "rms_lx"});
        const auto total_lx = number_below(total, {set, "total", "rms_lx"});
        const bool resolved = !own_lx || !total_lx || *total_lx > *own_lx;
        words += fmt::format(" The reference's own error is {} RMS{}.", own->text(),
                             resolved ? "" : ": the difference is not resolved");
    }
    return words;
}

std::string comparison_report(const ComparisonJson& comparison) {
    std::string scene = text_below(comparison, {"scene", "name"});
    if (scene.empty()) scene = text_below(comparison, {"scene", "file"});
    if (scene.empty()) scene = "Comparison of methods";
    const std::string title = xml_text(scene), headline = xml_text(comparison_headline(comparison));
    const std::string page_title = title + " · naturel compare", data = script_text(comparison);
    return fill_template(comparison_page, {{"TITLE", page_title},
                                           {"SCENE", title},
                                           {"HEADLINE", headline},
                                           {"DATA", data},
                                           {"STYLE", page_style},
                                           {"CHART_LICENCE", chart_licence},
                                           {"CHART", chart_script},
                                           {"PAGE", page_script},
                                           {"SCRIPT", comparison_script}});
}

}  // namespace naturel
