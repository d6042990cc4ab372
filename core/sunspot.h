#pragma once
#include <vector>

#include "core/light_zones.h"

namespace naturel {

/// Finds the sunspots on the faces of a building. Made once per sun; refers to its arguments: keep them alive.
class SunspotFinder {
public:
    SunspotFinder(const Scene& scene, const Building& building, const SunBeam& sun);

    /// The sunspots of one indoor face: each aperture projected along the sun, less what stands between.
    std::vector<Sunspot> on_face(FaceId face) const;

private:
    const Building& building_;
    SunBeam sun_;
    std::vector<GlazingTransmission> glazings_;  // [aperture]
    // Facets through which a ray towards the sun enters solid matter, and sheets from either side.
    std::vector<FacetId> blockers_;
};

}  // namespace naturel
