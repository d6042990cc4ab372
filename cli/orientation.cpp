#include "cli/orientation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/units.h"

namespace naturel {
namespace {

constexpr std::array<const char*, 8> compass_words{"north", "north-east", "east", "south-east",
                                                   "south", "south-west", "west", "north-west"};

double tilt_deg(const glm::dvec3& outward) {
    return degrees_from_radians(std::acos(std::clamp(outward.z, -1.0, 1.0)));
}

}  // namespace

std::string compass_word(const glm::dvec3& outward, double north_rad) {
    if (tilt_deg(outward) < 0.5) return "up";
    if (tilt_deg(outward) > 179.5) return "down";
    const double azimuth_deg = degrees_from_radians(std::atan2(outward.x, outward.y) + north_rad);
    const auto eighth = std::lround(azimuth_deg / 45.0);
    return compass_words[static_cast<std::size_t>((eighth % 8 + 8) % 8)];
}

std::string orientation(const glm::dvec3& outward, double north_rad) {
    const std::string word = compass_word(outward, north_rad);
    return word == "up" || word == "down" ? word
                                          : fmt::format("{}, tilt {:.0f} deg", word, tilt_deg(outward));
}

}  // namespace naturel
