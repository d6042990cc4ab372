#pragma once
#include "core/band3.h"

namespace naturel {

/// What became of a colour that the primaries cannot show (core/colour.h).
struct Desaturation {
    double saturation_kept = 1.0;     ///< 1: nothing happened; less: drawn towards the grey of the same Y
    double chromaticity_shift = 0.0;  ///< distance in CIE 1931 (x, y) from the colour asked for to that shown
};

/// Colour of a light source: the bands of a light of luminance or illuminance 1.
struct LightColour {
    Band3 band = grey(1.0);  ///< D65 unless the scene says otherwise
    Desaturation desaturation{};
};

}  // namespace naturel
