#pragma once
#include <cstdint>

#include "core/scene.h"

namespace naturel::tests {

/// A building of two rooms with a glazed door between them, windows of all shapes and transmittances, things in the rooms and
/// outdoors, some of them touching, and a shelf without thickness: up to 30 polyhedra. Every third one has a basement with
/// a pit for a window.
Scene random_building(std::uint64_t seed);

/// A room of polygons, (0,0,0) to size_m, with walls of no thickness and no apertures. Its south wall is y = 0.
Scene polygon_room(glm::dvec3 size_m);

/// Unit vector; at least 6 degrees above the horizon.
glm::dvec3 random_sun(std::uint64_t seed);

}  // namespace naturel::tests
