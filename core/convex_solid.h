#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "core/building.h"
#include "core/scene.h"

namespace naturel {

/// Bodies, gaps and overlaps thinner than this do not exist: as faces that coincide in the assembly.
inline constexpr double thinnest_m = 1e-6;

/// Points x with dot(normal, x) <= offset_m.
struct HalfSpace {
    glm::dvec3 normal{};  ///< unit length, out of the half-space
    double offset_m = 0.0;
};

/// A bounded convex body, or a sheet: a plane convex polygon, which is one side alone.
struct ConvexSolid {
    struct Side {
        HalfSpace plane;
        std::vector<glm::dvec3> vertices_m;  ///< counter-clockwise seen from outside
    };
    std::vector<Side> sides;
    glm::dvec3 low_m{}, high_m{};  ///< bounding box
};

/// Cuts a body (not a sheet) down to its part in a half-space. False when nothing thicker than `thinnest_m` is left; `solid` is
/// of no use then.
bool clip(ConvexSolid& solid, const HalfSpace& keep);

/// True when no point of `inner` is outside the body `outer` by more than `thinnest_m`.
bool contains(const ConvexSolid& outer, const ConvexSolid& inner);

double volume_m3(const ConvexSolid& solid);

/// Everything in a scene that light cannot pass (docs/method.md, "Umbra zones").
/// Solid matter as its maximal convex parts, which overlap: fills in file order, less what later polyhedra carve away;
/// bodies that touch or overlap are joined wherever that gives a larger convex body, so that a box made of two counts as
/// one, and an L of two boxes as the two longest boxes in it. Polygons as sheets, joined where they share a plane.
std::vector<ConvexSolid> convex_occluders(const Scene& scene, const Building& building);

}  // namespace naturel
