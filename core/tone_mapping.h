#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/colour.h"
#include "core/picture.h"

namespace naturel {

/// A picture in the colours of a screen: linear sRGB, not yet curved; a colour the screen cannot show lies outside [0, 1].
struct ScreenPicture {
    int width = 0, height = 0;
    std::vector<glm::dvec3> linear_srgb{};  ///< [width x height], rows from the top
    /// Shown as white by linear tone mapping. By Reinhard's: the luminance that 0.18 / mean would make 1 in automatic
    /// exposure (before compression), else as for linear.
    double white_luminance_cd_m2 = 1.0;
};

/// Exposure, tone mapping and, if asked for, adaptation to the colour of the sky; docs/method.md, "Pictures".
/// sky_colour: bands of a light of luminance 1.
ScreenPicture map_to_screen(const Picture& picture, const Primaries& primaries, const PictureOptions& options,
                            const Band3& sky_colour);

/// 8-bit sRGB of a linear colour.
std::array<std::uint8_t, 3> srgb8(const glm::dvec3& linear);

/// The pixels that an automatic exposure, or one by percentile, looks at: those that show anything but solids cut open and backs, which
/// are black whatever the light; of pictures that show the rooms from around them, only those that show one indoor surface and nothing
/// else, where there are any. Numbers of pixels, increasing.
std::vector<std::size_t> pixels_for_exposure(const Picture& picture);

/// The luminance that an exposure shows as white, cd/m2. Automatic: the 99th percentile of the pixels, or five times
/// their median where that is less, as in a room whose window shows the sky: half of the picture is at least middle grey
/// then. Where the percentile is 0 the largest luminance, and 1 for a black picture.
double white_luminance_cd_m2(std::vector<double> luminance_cd_m2, const Exposure& exposure);

}  // namespace naturel
