#pragma once
#include <glm/vec2.hpp>
#include <vector>

#include "core/light_zones.h"
#include "core/patch_grid.h"

namespace naturel {

/// Light straight from the sun on the patches of a grid that was not cut along its sunspots. Made once for all suns; refers to
/// its arguments: keep them alive.
class SunOnPatches {
public:
    SunOnPatches(const Building& building, const PatchGrid& grid);

    struct LitPatch {
        PatchId patch{};
        Band3 mean_lx{};  ///< over all of the patch
    };
    /// The patches of indoor faces that the sun reaches, in increasing order. The area of a patch that is lit is exact, so that the
    /// flux is that of the sunspots.
    std::vector<LitPatch> lit_by(const Scene& scene, const SunBeam& sun) const;

private:
    double lit_area_m2(const Sunspot& spot, PatchId patch) const;
    std::vector<PatchId> patches_near(const Sunspot& spot) const;

    const Building& building_;
    const PatchGrid& grid_;
    std::vector<glm::dvec2> corners_m_;  ///< [grid.corners] in Face::plane; of indoor patches
};

}  // namespace naturel
