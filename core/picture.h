#pragma once
#include <vector>

#include "core/daylight.h"

namespace naturel {

/// A picture of the solution, rows from the top.
struct Picture {
    int width = 0, height = 0;
    /// [width x height], per band: the mean over what a pixel shows, and 0 where it shows nothing. Solids that are cut open are black.
    std::vector<Band3> luminance_cd_m2{};
    /// [width x height], of the indoor surface that is seen, also through panes; NaN where none is.
    std::vector<Band3> illuminance_lx{};
    /// [width x height], share of a pixel that shows anything: less than 1 along the rim of a fisheye, 0 outside, and where all
    /// is cut away. Empty: all 1.
    std::vector<float> coverage{};
};

/// Draws a view: surfaces with illuminance interpolated over each patch, and sky, sun, ground and outdoor surfaces as seen
/// through the apertures. docs/pictures.md
Picture draw_view(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                  const DaylightSolution& solution, const View& view, Progress& progress);

}  // namespace naturel
