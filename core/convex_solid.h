#pragma once
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/building.h"
#include "core/scene.h"

namespace naturel {

/// Points x with dot(normal, x) <= offset_m.
struct HalfSpace {
    glm::dvec3 normal{};  ///< unit length, out of the half-space
    double offset_m = 0.0;
};

/// A bounded convex body, or a plane convex polygon (`planes` empty): something that can hide an aperture.
struct ConvexSolid {
    struct Side {
        HalfSpace plane;
        std::vector<glm::dvec3> vertices_m;  ///< counter-clockwise seen from outside
    };
    std::vector<Side> sides;
    glm::dvec3 low_m{}, high_m{};  ///< bounding box
};

/// The part of a solid in a half-space; empty when nothing thicker than a micrometre is left.
std::optional<ConvexSolid> clip(const ConvexSolid& solid, const HalfSpace& keep);

/// True when no point of `inner` is outside `outer` by more than a micrometre.
bool contains(const ConvexSolid& outer, const ConvexSolid& inner);

/// The solid matter of a scene as its maximal convex parts, which overlap: fills in file order, less what later polyhedra
/// carve away; bodies that touch or overlap are joined wherever that gives a larger convex body, so that a box made of two
/// counts as one, and an L of two boxes as the two longest boxes in it (docs/method.md, "Umbra zones").
std::vector<ConvexSolid> convex_occluders(const Scene& scene, const Building& building);

}  // namespace naturel
