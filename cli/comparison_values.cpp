#include "cli/comparison_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace naturel {
namespace {

const ComparisonJson nothing;

}  // namespace

const ComparisonJson& value_below(const ComparisonJson& json, std::vector<std::string> keys) {
    const ComparisonJson* at = &json;
    for (const std::string& key : keys) {
        if (!at->is_object()) return nothing;
        const auto found = at->find(key);
        if (found == at->end()) return nothing;
        at = &*found;
    }
    return *at;
}

std::optional<double> number_below(const ComparisonJson& json, const std::vector<std::string>& keys) {
    const ComparisonJson& value = value_below(json, keys);
    if (!value.is_number()) return std::nullopt;
    const double number = value.get<double>();
    return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::string text_below(const ComparisonJson& json, const std::vector<std::string>& keys) {
    const ComparisonJson& value = value_below(json, keys);
    return value.is_string() ? value.get<std::string>() : std::string();
}

std::vector<double> numbers_below(const ComparisonJson& json, const std::vector<std::string>& keys) {
    std::vector<double> numbers;
    const ComparisonJson& values = value_below(json, keys);
    if (!values.is_array()) return numbers;
    for (const ComparisonJson& value : values)
        numbers.push_back(value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN());
    return numbers;
}

std::vector<std::string> sensor_sets(const ComparisonJson& comparison) {
    std::vector<std::string> ids;
    const auto collect = [&](const char* list, const char* key) {
        const ComparisonJson& entries = value_below(comparison, {list});
        if (!entries.is_array()) return;
        for (const ComparisonJson& entry : entries) {
            const ComparisonJson& id = value_below(entry, {key});
            if (id.is_string() && std::ranges::find(ids, id.get<std::string>()) == ids.end())
                ids.push_back(id);
        }
    };
    collect("sets", "id");
    if (ids.empty()) collect("points", "set");
    return ids;
}

std::string largest_set(const ComparisonJson& comparison) {
    std::string largest;
    std::ptrdiff_t most = -1;
    const ComparisonJson& points = value_below(comparison, {"points"});
    for (const std::string& set : sensor_sets(comparison)) {
        const std::ptrdiff_t count =
            points.is_array()
                ? std::ranges::count_if(points,
                                        [&](const auto& point) { return text_below(point, {"set"}) == set; })
                : 0;
        if (count > most) most = count, largest = set;
    }
    return largest;
}

bool is_resolved(const ComparisonJson& comparison, const ComparisonJson& ingredient, const std::string& set) {
    const ComparisonJson& flag = value_below(ingredient, {"resolved"});
    if (flag.is_boolean() && !flag.get<bool>()) return false;
    const ComparisonJson& told = value_below(ingredient, {"resolved_sets", set});
    if (told.is_boolean()) return told.get<bool>();
    const auto own = number_below(ingredient, {"sets", set, "total", "rms_lx"});
    const auto band = number_below(comparison, {"reference_error", "sets", set, "total", "rms_lx"});
    return !own || !band || *own > *band;
}

std::string report_number(double value, bool plus, int digits) {
    if (!std::isfinite(value)) return "–";
    if (value == 0.0) return "0";
    const double size = std::abs(value);
    std::string text;
    if (size >= 1e7 || size < 1e-4) {
        text = fmt::format("{:.{}e}", size, digits - 1);
    } else {
        const int decimals = std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(size))));
        text = fmt::format("{:.{}f}", size, decimals);
    }
    return (value < 0.0 ? "−" : plus ? "+" : "") + text;
}

}  // namespace naturel
