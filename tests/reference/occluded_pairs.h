#pragma once
#include <cstdint>
#include <vector>

#include "core/building.h"
#include "core/scene.h"

namespace naturel::tests {

/// Two polygons of 3 to 6 corners, "emitter" and "receiver", that face each other 0.3 to 3 m apart, and 1 to 3 solids or sheets
/// about the way between them: boxes in any position, prisms, tetrahedra. Two patches where the spacing of the grid is large.
Scene random_occluded_pair(std::uint64_t seed);

/// A closed room of 4 x 3 x 2.5 m with 5 to 10 boxes that stand on the floor, hang or lean askew.
Scene random_furnished_room(std::uint64_t seed);

/// A closed room of 4 x 3 x 2.5 m with so many boxes, prisms and tetrahedra in any position, one through the other.
Scene room_of_oblique_solids(std::uint64_t seed, int count);

/// A room of 6 x 5 x 3 m with `count` boxes on its floor, in rows of six.
Scene room_with_boxes(int count);

/// The facets of a building as polygons that block from their fronts; those of sheets twice, turned.
std::vector<std::vector<glm::dvec3>> facet_polygons(const Building& building);

}  // namespace naturel::tests
