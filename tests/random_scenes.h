#pragma once
#include <cstdint>
#include <random>

#include "core/scene.h"

namespace naturel::tests {

/// A parallelepiped with edges along the axes.
Polyhedron box(std::string id, Effect effect, glm::dvec3 low_m, glm::dvec3 high_m);

/// A scene with the "unglazed" glazing, one material of the given reflectance and no polyhedra.
Scene empty_scene(double reflectance = 0.5);

/// A hollow box: solid walls of 0.3 m around the air from (0,0,floor_z) to size, and nothing else. Closed.
Scene closed_room(glm::dvec3 size_m, double reflectance = 0.5, double floor_z_m = 0.0);

enum class Placement {
    free,     ///< any position and orientation
    lattice,  ///< corners on a coarse lattice, so that faces, edges and corners coincide often
};

/// `count` polyhedra of all three kinds, filling and carving, between low_z and low_z + 8 m.
Scene random_scene(std::uint64_t seed, int count, Placement placement, double low_z_m);

}  // namespace naturel::tests
