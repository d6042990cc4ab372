#pragma once
#include <glm/vec3.hpp>
#include <string>

namespace naturel {

/// "south, tilt 90 deg" for the way a surface looks; 0 deg looks straight up, 90 deg at the horizon.
/// outward: unit length; north_rad: azimuth of the model's +y axis.
std::string orientation(const glm::dvec3& outward, double north_rad);

/// The same without the tilt: "south", and "up" or "down" for what is level.
std::string compass_word(const glm::dvec3& outward, double north_rad);

}  // namespace naturel
