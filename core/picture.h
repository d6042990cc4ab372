#pragma once
#include <cstdint>
#include <vector>

#include "core/daylight.h"

namespace naturel {

/// What all samples of a pixel show.
enum class PixelContent : std::uint8_t {
    mixed,    ///< not one surface, or nothing
    solid,    ///< black: solid matter or ground that is cut open, or the back of a surface
    indoors,  ///< an indoor surface, not through an aperture
    other,
};

/// A picture of the solution, rows from the top.
struct Picture {
    int width = 0, height = 0;
    /// [width x height], per band: the mean over what a pixel shows, and 0 where it shows nothing. Solids that are cut open are black.
    std::vector<Band3> luminance_cd_m2{};
    /// [width x height], of the indoor surface that is seen, also through panes; NaN where none is.
    std::vector<Band3> illuminance_lx{};
    std::vector<Band3> sky_illuminance_lx{};  ///< the part of it that stems from the sky: over the outdoor illuminance the daylight factor
    /// [width x height], share of a pixel that shows anything: less than 1 along the rim of a fisheye, 0 outside, and where all
    /// is cut away. Empty: all 1.
    std::vector<float> coverage{};
    /// [width x height] Empty: nothing is known, all `other`.
    std::vector<PixelContent> shown{};
    /// [width x height], the same number in pixels that show one surface whose light is smooth, on one side of the edge of a sunspot and
    /// through the same panes; 0 in pixels that show several or none.
    std::vector<std::uint32_t> surface{};
    /// Parallel, or cut open, or through walls: what is around the rooms may take any share of it.
    bool around_rooms = false;
};

/// Draws a view: surfaces with illuminance interpolated over each patch, and sky, sun, ground and outdoor surfaces as seen
/// through the apertures. docs/pictures.md
Picture draw_view(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                  const DaylightSolution& solution, const View& view, Progress& progress);

}  // namespace naturel
