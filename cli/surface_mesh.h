#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "cli/result.h"

namespace naturel {

/// Light on a place of a surface.
struct SurfaceLight {
    Components parts{};  ///< luminous; zero on outdoor surfaces, of which only the luminance is known
    Band3 total_lx{};
    double daylight_factor_percent = 0.0;  ///< 0 under a sky without light
    Band3 luminance_cd_m2{};

    double illuminance_lx() const;  ///< sum of the parts
};

/// The patches as polygons, with light at every corner: what files for other programs and the report are made of. Patches of an
/// indoor face share their corners, which are nodes of the grid; those of windows and outdoor faces have corners of their own.
struct SurfaceMesh {
    std::vector<glm::dvec3> positions_m;    ///< nodes of the grid first, in their order
    std::vector<SurfaceLight> light;        ///< [positions_m]
    std::vector<SurfaceLight> patch_light;  ///< [patches], means
    std::vector<SurfaceLight> centre_light; ///< [patches], interpolated between the corners at the centroid
    std::vector<std::uint32_t> first{0};    ///< [patches + 1], into outlines
    std::vector<std::uint32_t> outlines;    ///< into positions_m, counter-clockwise seen from the air

    std::span<const std::uint32_t> outline_of(std::size_t patch) const {
        return {outlines.data() + first[patch], first[patch + 1] - first[patch]};
    }
};

SurfaceMesh make_surface_mesh(const Result& result);

/// What shows as white when surfaces are seen for themselves: as in the automatic exposure of a picture in which each patch of
/// [first, last) takes room by its area.
double white_of_patches_cd_m2(const Result& result, const SurfaceMesh& mesh, std::size_t first, std::size_t last);

}  // namespace naturel
