#include "core/scene_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {
namespace {

/// Levenshtein distance, capitals counted as small letters.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j)
        row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replace = diagonal + (lower(a[i - 1]) != lower(b[j - 1]));
            diagonal = row[j];
            row[j] = std::min({replace, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row[b.size()];
}

}  // namespace

std::string suggestion(std::string_view wrong, std::span<const std::string_view> known) {
    constexpr std::size_t longest_compared = 64, most_listed = 16;
    std::string_view nearest;
    std::size_t nearest_distance = std::max<std::size_t>(2, wrong.size() / 3) + 1;
    for (const std::string_view candidate : known) {
        if (wrong.size() > longest_compared || candidate.size() > longest_compared) continue;
        const std::size_t distance = edit_distance(wrong, candidate);
        // Two words of which hardly a letter agrees are not near, however short they are.
        if (distance < nearest_distance && 2 * distance <= candidate.size()) {
            nearest = candidate, nearest_distance = distance;
        }
    }
    if (!nearest.empty()) return fmt::format("(did you mean {}?)", in_quotes(nearest));
    if (known.empty()) return "(there are none)";
    std::string list;
    for (std::size_t i = 0; i < std::min(known.size(), most_listed); ++i) {
        list += (i == 0 ? "" : ", ") + in_quotes(known[i]);
    }
    return fmt::format("(known: {}{})", list, known.size() > most_listed ? ", ..." : "");
}

SceneObject::SceneObject(const JsonValue& value, const SceneObjectKeys& keys) : value_(value) {
    members_ = read_table(value, "keys and values");
    std::vector<std::string_view> known(keys.required.begin(), keys.required.end());
    known.insert(known.end(), keys.optional.begin(), keys.optional.end());
    std::erase(known, std::string_view());
    for (const JsonMember& member : members_) {
        const std::string& key = member.key.text();
        if (std::find(known.begin(), known.end(), key) == known.end()) {
            member.key.refuse(fmt::format("unknown key {} {}", in_quotes(key), suggestion(key, known)));
        }
    }
    for (const std::string_view key : keys.required) {
        if (!key.empty() && !has(key)) {
            refuse(fmt::format("the key {} is missing (it must be given here)", in_quotes(key)));
        }
    }
}

std::optional<JsonValue> SceneObject::find(std::string_view key) const {
    for (const JsonMember& member : members_) {
        if (member.key.text() == key) return member.value;
    }
    return std::nullopt;
}

std::string Range::words() const {
    return fmt::format("{} to {}{}{}", low, high, unit.empty() ? "" : " ", unit);
}

double read_number(const JsonValue& value, const Range& range) {
    if (value.kind() != JsonKind::number) {
        value.refuse(fmt::format("{} stands where a number belongs ({})", value.describe(), range.words()));
    }
    const double number = value.number();
    if (!(number >= range.low && number <= range.high)) {
        value.refuse(fmt::format("{} is out of range ({} would be right)", number, range.words()));
    }
    return number;
}

double read_number(const SceneObject& object, std::string_view key, const Range& range, double otherwise) {
    const auto value = object.find(key);
    return value ? read_number(*value, range) : otherwise;
}

int read_integer(const SceneObject& object, std::string_view key, const Range& range, int otherwise) {
    const auto value = object.find(key);
    if (!value) return otherwise;
    const double number = read_number(*value, range);
    if (number != std::floor(number)) {
        value->refuse(fmt::format("{} is not a whole number ({} would be right)", number, range.words()));
    }
    return static_cast<int>(number);
}

const std::string& read_text(const JsonValue& value) {
    if (value.kind() != JsonKind::text) {
        value.refuse(fmt::format("{} stands where a text belongs (in double quotes)", value.describe()));
    }
    return value.text();
}

bool read_boolean(const JsonValue& value) {
    if (value.kind() != JsonKind::boolean) {
        value.refuse(fmt::format("{} stands where true or false belongs (without quotes)", value.describe()));
    }
    return value.boolean();
}

std::vector<JsonValue> read_list(const JsonValue& value, std::string_view of) {
    if (value.kind() != JsonKind::list) {
        value.refuse(fmt::format("{} stands where a list belongs ([...] of {})", value.describe(), of));
    }
    return value.items();
}

std::vector<JsonValue> read_list(const SceneObject& object, std::string_view key, std::string_view of) {
    const auto value = object.find(key);
    return value ? read_list(*value, of) : std::vector<JsonValue>();
}

std::vector<JsonMember> read_table(const JsonValue& value, std::string_view of) {
    if (value.kind() != JsonKind::object) {
        value.refuse(fmt::format("{} stands where an object belongs ({{...}} of {})", value.describe(), of));
    }
    return value.members();
}

glm::dvec3 read_position(const JsonValue& value) {
    const auto [x, y, z] =
        read_numbers<3>(value, "x, y, z", {coordinate_range, coordinate_range, coordinate_range});
    return {x, y, z};
}

glm::dvec3 read_direction(const JsonValue& value) {
    const glm::dvec3 direction = read_position(value);
    const double length = glm::length(direction);
    if (length < shortest_m) value.refuse("the direction has no length (it must point somewhere)");
    return direction / length;
}

Band3 read_bands(const JsonValue& value, const Range& range) {
    if (value.kind() == JsonKind::number) return grey(read_number(value, range));
    if (value.kind() != JsonKind::list) {
        value.refuse(fmt::format("{} stands where a number or [r, g, b] belongs (each {})", value.describe(),
                                 range.words()));
    }
    const auto [r, g, b] = read_numbers<3>(value, "r, g, b", {range, range, range});
    return {r, g, b};
}

const std::string& read_name(const JsonValue& value) {
    constexpr std::size_t longest = 100;
    const std::string& name = read_text(value);
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
    if (name.empty() || name.size() > longest || std::any_of(name.begin(), name.end(), is_control)) {
        value.refuse(fmt::format("{} cannot be a name (1 to {} bytes without control characters)",
                                 in_quotes(name), longest));
    }
    return name;
}

const std::string& read_id(const JsonValue& value) {
    const std::string& id = read_name(value);
    if (id.find_first_of("/\\") != std::string::npos || id.front() == '.') {
        value.refuse(
            fmt::format("{} cannot be an id (without / and \\, not starting with a dot)", in_quotes(id)));
    }
    return id;
}

}  // namespace naturel
