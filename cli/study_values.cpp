#include "cli/study_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "cli/study_keys.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

constexpr double most_values = 1e6;

/// How many steps lead from 0 to a length; ends that rounding misses count.
std::size_t step_count(const JsonValue& source, double length, double step) {
    const double steps = std::floor(length / step + 1e-9);
    if (steps + 1.0 > most_values)
        source.refuse(fmt::format("there are more than {:.0f} values (a larger step would be right)", most_values));
    return static_cast<std::size_t>(steps);
}

/// Whole numbers as people write them, without a fraction: options that count take no other.
Json json_of_number(double number) {
    constexpr double exact = 9007199254740992.0;  // 2^53
    if (number == std::floor(number) && std::abs(number) <= exact) return static_cast<std::int64_t>(number);
    return number;
}

std::vector<StudyValue> read_range(const JsonValue& value) {
    const SceneObject object(value, study_keys::range);
    constexpr Range any{-1e300, 1e300};
    const double first = read_number(object.at("first"), any), last = read_number(object.at("last"), any);
    const auto step = object.find("step"), count = object.find("count");
    if (step.has_value() == count.has_value()) object.refuse("one of \"step\" and \"count\" is needed (how the range is divided)");
    std::vector<StudyValue> values;
    if (count) {
        const int n = read_integer(object, "count", {2.0, most_values}, 0);
        for (int k = 0; k < n; ++k) {
            const double share = static_cast<double>(k) / (n - 1);
            values.push_back({json_of_number((1.0 - share) * first + share * last), value});
        }
        return values;
    }
    const double width = read_number(*step, any);
    if (width == 0.0 || (last - first) / width < 0.0)
        step->refuse(fmt::format("a step of {} does not lead from {} to {} (its sign or size is wrong)", width, first, last));
    // Rounded to what people write: 0.3 rather than 0.30000000000000004.
    for (std::size_t k = 0, n = step_count(value, last - first, width); k <= n; ++k)
        values.push_back({json_of_number(std::strtod(fmt::format("{:.12g}", first + static_cast<double>(k) * width).c_str(), nullptr)), value});
    return values;
}

/// form: 0 stands for any digit, every other character for itself.
bool looks_like(std::string_view text, std::string_view form) {
    return std::ranges::equal(text, form, [](char c, char wanted) { return wanted == '0' ? c >= '0' && c <= '9' : c == wanted; });
}

std::chrono::year_month_day read_date(const JsonValue& value) {
    const std::string& text = read_text(value);
    int year = 0;
    unsigned month = 0, day = 0;
    const bool has_form = looks_like(text, "0000-00-00") && std::sscanf(text.c_str(), "%4d-%2u-%2u", &year, &month, &day) == 3;
    const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
    if (!has_form || !date.ok()) value.refuse(fmt::format("{} is no date (\"2026-06-21\" would be right)", in_quotes(text)));
    return date;
}

std::vector<StudyValue> read_dates(const JsonValue& value) {
    using namespace std::chrono;
    const SceneObject object(value, study_keys::dates);
    const year_month_day first = read_date(object.at("first")), last = read_date(object.at("last"));
    if (last < first) object.at("last").refuse("the last date comes before the first (it must not)");
    if (object.has("step_days") && object.has("step_months"))
        object.refuse("both of \"step_days\" and \"step_months\" are given (one is enough)");
    const int months_apart = read_integer(object, "step_months", {1.0, 1200.0}, 0);
    const int days_apart = read_integer(object, "step_days", {1.0, 36600.0}, 1);
    std::vector<StudyValue> values;
    for (int k = 0;; ++k) {
        year_month_day date = first;
        if (months_apart > 0) {
            date = first + months(k * months_apart);
            if (!date.ok()) date = date.year() / date.month() / std::chrono::last;  // a month without that day: its last one
        } else {
            date = sys_days(first) + days(k * days_apart);
        }
        if (date > last) return values;
        if (static_cast<double>(values.size()) == most_values)
            value.refuse(fmt::format("there are more than {:.0f} dates (fewer would be right)", most_values));
        values.push_back({fmt::format("{:04d}-{:02d}-{:02d}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                                      static_cast<unsigned>(date.day())),
                          value});
    }
}

int read_minutes(const JsonValue& value) {
    const std::string& text = read_text(value);
    int hour = 0, minute = 0;
    const bool has_form = looks_like(text, "00:00") && std::sscanf(text.c_str(), "%2d:%2d", &hour, &minute) == 2;
    if (!has_form || hour > 23 || minute > 59)
        value.refuse(fmt::format("{} is no time of the day (\"08:30\" would be right)", in_quotes(text)));
    return 60 * hour + minute;
}

std::vector<StudyValue> read_times(const JsonValue& value) {
    const SceneObject object(value, study_keys::times);
    const int first = read_minutes(object.at("first")), last = read_minutes(object.at("last"));
    if (last < first) object.at("last").refuse("the last time comes before the first (it must not)");
    const int step = read_integer(object, "step_min", {1.0, 1440.0, "minutes"}, 60);
    std::vector<StudyValue> values;
    for (int minutes = first; minutes <= last; minutes += step)
        values.push_back({fmt::format("{:02d}:{:02d}", minutes / 60, minutes % 60), value});
    return values;
}

}  // namespace

Json json_of(const JsonValue& value) {
    switch (value.kind()) {
        case JsonKind::null:
            return nullptr;
        case JsonKind::boolean:
            return value.boolean();
        case JsonKind::number:
            return json_of_number(value.number());
        case JsonKind::text:
            return value.text();
        case JsonKind::list: {
            Json list = Json::array();
            for (const JsonValue& item : value.items()) list.push_back(json_of(item));
            return list;
        }
        case JsonKind::object:
            break;
    }
    Json object = Json::object();
    for (const JsonMember& member : value.members()) object[member.key.text()] = json_of(member.value);
    return object;
}

std::vector<StudyValue> read_study_values(const SceneObject& parameter) {
    std::vector<StudyValue> values;
    int kinds = 0;
    const auto take = [&](std::string_view key, const auto& read) {
        const auto value = parameter.find(key);
        if (!value) return;
        ++kinds;
        values = read(*value);
    };
    take("values", [](const JsonValue& value) {
        std::vector<StudyValue> list;
        for (const JsonValue& item : read_list(value, "values")) list.push_back({json_of(item), item});
        if (list.empty()) value.refuse("the list is empty (at least one value is needed)");
        return list;
    });
    take("range", read_range);
    take("dates", read_dates);
    take("times", read_times);
    if (kinds != 1)
        parameter.refuse(fmt::format("{} of \"values\", \"range\", \"dates\" and \"times\" {} given (exactly one is needed)",
                                     kinds == 0 ? "none" : "more than one", kinds == 0 ? "is" : "are"));
    return values;
}

}  // namespace naturel
