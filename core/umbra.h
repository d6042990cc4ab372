#pragma once
#include <array>
#include <vector>

#include "core/building.h"
#include "core/convex_solid.h"

namespace naturel {

struct UmbraOptions {
    /// How often an aperture is halved, at most, where occluders may hide it together though none of them hides all of it.
    int halvings = 2;
    double smallest_m2 = 1e-2;  ///< halving leaves out islands smaller than this: 10 x 10 cm
};

/// A convex solid that may hide an aperture.
struct Occluder {
    ConvexSolid solid;
    std::vector<glm::dvec3> corners_m;              ///< each vertex of the solid once
    std::vector<std::array<std::size_t, 2>> edges;  ///< pairs of corners
};

/// Finds the umbra zones on the faces of a building. Refers to the building: keep it alive.
class UmbraFinder {
public:
    /// solids: see convex_occluders().
    UmbraFinder(const Building& building, std::vector<ConvexSolid> solids, const UmbraOptions& options = {});

    /// The part of an indoor face, in Face::plane, from which no point of any exterior aperture is seen: behind the plane of an
    /// aperture, or where each part of it is in the umbra of one occluder. For one convex occluder and one convex aperture the
    /// umbra is the intersection of the occluder's shadows from the corners of the aperture (Nishita & Nakamae 1983).
    Region on_face(FaceId face) const;

private:
    struct Window {
        std::vector<glm::dvec3> vertices_m;  ///< convex part of an exterior aperture
        glm::dvec3 normal{};                 ///< into the room
    };

    const Building& building_;
    UmbraOptions options_;
    std::vector<Occluder> occluders_;
    std::vector<Window> windows_;
};

}  // namespace naturel
