#pragma once
#include <vector>

#include "core/daylight.h"

namespace naturel {

/// A picture of the solution, rows from the top.
struct Picture {
    int width = 0, height = 0;
    std::vector<Band3> luminance_cd_m2{};  ///< [width x height], per band
    /// [width x height], of the indoor surface that is seen, also through panes; NaN where none is.
    std::vector<Band3> illuminance_lx{};
    std::vector<Band3> sky_illuminance_lx{};  ///< the part of it that stems from the sky: over the outdoor illuminance the daylight factor
};

/// Draws a view: surfaces with illuminance interpolated over each patch, and sky, ground and outdoor surfaces as seen
/// through the apertures.
Picture draw_view(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                  const DaylightSolution& solution, const View& view, Progress& progress);

}  // namespace naturel
