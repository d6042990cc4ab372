#pragma once
#include <cstdint>
#include <memory>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

enum class ProjectionSurface {
    hemicube,      ///< Cohen & Greenberg 1985: five faces of a half cube
    single_plane,  ///< Sillion & Puech 1989 and the article: one square above the patch
};

/// How a single plane is divided into cells; the faces of a hemi-cube are always uniform.
enum class CellSpacing {
    equal_solid_angle,  ///< the article
    equal_form_factor,
    equal_plane_angle,  ///< strips seen under equal angles, both ways
    uniform,
};

/// What becomes of the light that passes below the rim of a single plane (docs/hemicube.md, "The rim").
enum class RimShare {
    left_out,      ///< FormFactorRow::truncated says how much it is
    renormalised,  ///< the row is scaled to what it would be if the rim looked like the rest
    strip,         ///< four strips of cells between the rim and the horizon are drawn, too
};

struct HemicubeOptions {
    ProjectionSurface surface = ProjectionSurface::hemicube;
    int resolution = 256;  ///< cells along a side of the square, or of the top of the hemi-cube; 1 to 4096
    double half_side_over_height = 14.0;  ///< d/h of the single plane
    CellSpacing spacing = CellSpacing::equal_solid_angle;
    RimShare rim = RimShare::left_out;
    int viewpoints = 1;  ///< of a patch: 1, as published, its centroid; more: spread over it; at most 4096
    bool random_rotation = true;  ///< turn the projection about the normal by a seeded angle, so that aliasing averages out
    std::uint64_t seed = 1;
};

/// Visibility by projection: facets are drawn into a z-buffered item buffer, and what a cell shows is what is seen.
std::unique_ptr<Visibility> make_hemicube_visibility(const Building& building, const PatchGrid& grid,
                                                     const HemicubeOptions& options = {});

}  // namespace naturel
