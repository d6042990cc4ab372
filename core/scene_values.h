#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/band3.h"
#include "core/json_document.h"
#include "core/scene_keys.h"

// Typed and checked reading of the values a scene file is made of: the words of the reader
// (core/scene_reader.cpp). Every function refuses a value that does not fit with an InputError that says
// where, what and what would be right.
namespace naturel {

/// `(did you mean "wall"?)`, or the list of what is known if nothing is near.
std::string suggestion(std::string_view wrong, std::span<const std::string_view> known);

/// An object whose keys are all known and whose required keys are all there.
class SceneObject {
public:
    SceneObject(const JsonValue& value, const SceneObjectKeys& keys);

    std::optional<JsonValue> find(std::string_view key) const;
    bool has(std::string_view key) const { return find(key).has_value(); }
    /// A required key: the constructor has made sure of it.
    JsonValue at(std::string_view key) const { return *find(key); }

    [[noreturn]] void refuse(const std::string& text) const { value_.refuse(text); }

private:
    JsonValue value_;
    std::vector<JsonMember> members_;
};

/// Inclusive limits of a number; unit as in "0 to 90 degrees", empty for pure numbers.
struct Range {
    double low, high;
    std::string_view unit = "";

    std::string words() const;
};

/// The world is 200 km wide: 1e5 m in units of 1 nm stays far within 64 bits.
inline constexpr Range coordinate_range{-1e5, 1e5, "m"};
inline constexpr Range share_range{0.0, 1.0};

/// Light levels above this (the sun's own luminance is 1.6e9 cd/m2) are slips of the pen.
inline constexpr double largest_light = 1e10;

/// Vectors and edges shorter than this have no direction: a thousand units of the plane coordinates (1 nm).
inline constexpr double shortest_m = 1e-6;

double read_number(const JsonValue& value, const Range& range);
double read_number(const SceneObject& object, std::string_view key, const Range& range, double otherwise);
int read_integer(const SceneObject& object, std::string_view key, const Range& range, int otherwise);
const std::string& read_text(const JsonValue& value);
bool read_boolean(const JsonValue& value);

/// of: what the list is made of, for messages.
std::vector<JsonValue> read_list(const JsonValue& value, std::string_view of);
/// Empty if the key is absent.
std::vector<JsonValue> read_list(const SceneObject& object, std::string_view key, std::string_view of);

/// Members of an object whose keys are the user's names.
std::vector<JsonMember> read_table(const JsonValue& value, std::string_view of);

/// m
glm::dvec3 read_position(const JsonValue& value);
/// Any length but none; unit length afterwards.
glm::dvec3 read_direction(const JsonValue& value);
/// A number for all bands, or one per band.
Band3 read_bands(const JsonValue& value, const Range& range);

/// 1 to 100 bytes without control characters.
const std::string& read_name(const JsonValue& value);
/// A name that may become part of a file name or of a longer name such as "room/bottom".
const std::string& read_id(const JsonValue& value);

/// One of some words; each stands for a value of an enum.
template <class Enum>
Enum read_word(const JsonValue& value, std::initializer_list<std::pair<std::string_view, Enum>> words) {
    const std::string& text = read_text(value);
    std::vector<std::string_view> known;
    for (const auto& [word, meaning] : words) {
        if (word == text) return meaning;
        known.push_back(word);
    }
    value.refuse("unknown word " + in_quotes(text) + " " + suggestion(text, known));
}

/// Exactly one number per range.
template <std::size_t N>
std::array<double, N> read_numbers(const JsonValue& value, std::string_view of,
                                   const std::array<Range, N>& ranges) {
    const std::vector<JsonValue> items = read_list(value, of);
    if (items.size() != N) {
        value.refuse("the list has " + std::to_string(items.size()) + " values (" + std::to_string(N) +
                     " are needed: " + std::string(of) + ")");
    }
    std::array<double, N> numbers;
    for (std::size_t i = 0; i < N; ++i)
        numbers[i] = read_number(items[i], ranges[i]);
    return numbers;
}

}  // namespace naturel
