#pragma once
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "core/visibility.h"

namespace naturel::tests {

/// Luminance, cd/m2, of what lies in a direction (unit).
using LuminanceOf = std::function<double(const glm::dvec3&)>;

/// A plane opening of any shape, counter-clockwise seen from the point that looks through it.
struct PlaneOpening {
    std::vector<glm::dvec3> outline_m{};
    std::vector<std::vector<glm::dvec3>> holes_m{};
};

/// Something opaque between the point and the sky.
struct Blocker {
    std::vector<glm::dvec3> outline_m{};  ///< convex, in any order of turning
    LuminanceOf luminance_cd_m2{};        ///< empty: black
};

/// Illuminance, lx, of a point through an opening, without a single ray: blockers are projected on the plane of the opening
/// and cut out of it (integer polygons of 1 nm), and luminance is integrated over what is left in the space of directions
/// by a rule of degree 5 on spherical triangles, divided until they agree to 1e-8 of the whole.
/// blockers: from near to far; behind: the light where nothing blocks, sky above and ground below the horizon.
double illuminance_by_clipping(const GatherPoint& point, const PlaneOpening& opening,
                               const std::vector<Blocker>& blockers, const LuminanceOf& behind);

}  // namespace naturel::tests
