#pragma once
#include <vector>

#include "core/building.h"
#include "core/convex_solid.h"

namespace naturel {

/// Finds the umbra zones on the faces of a building. Refers to the building: keep it alive.
class UmbraFinder {
public:
    /// occluders: see convex_occluders().
    UmbraFinder(const Building& building, std::vector<ConvexSolid> occluders);

    /// The part of an indoor face, in Face::plane, from which no point of any exterior aperture is seen: behind the plane of an
    /// aperture, or in the umbra of one occluder. For one convex occluder and one convex aperture the umbra is the
    /// intersection of the occluder's shadows from the corners of the aperture (Nishita & Nakamae 1983).
    Region on_face(FaceId face) const;

private:
    struct Window {
        std::vector<glm::dvec3> vertices_m;  ///< convex part of an exterior aperture
        glm::dvec3 normal{};                 ///< into the room
    };

    const Building& building_;
    std::vector<ConvexSolid> occluders_;
    std::vector<Window> windows_;
};

}  // namespace naturel
