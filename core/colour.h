#pragma once
#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "core/band3.h"
#include "core/scene.h"

namespace naturel {

/// The three-band basis of a scene: phosphor-like primaries whose sum has the colour of D65 (docs/method.md, "Colour").
class Primaries {
public:
    explicit Primaries(PrimariesName name);

    /// CIE XYZ of a band triple; white {1,1,1} has Y = 1.
    glm::dvec3 xyz(const Band3& band) const;
    Band3 from_xyz(const glm::dvec3& xyz) const;

    /// The photometric value: illuminance from band illuminances, luminance from band luminances, ...
    double luminous(const Band3& band) const { return luminous_.r * band.r + luminous_.g * band.g + luminous_.b * band.b; }

private:
    glm::dmat3 xyz_from_band_;
    glm::dmat3 band_from_xyz_;
    Band3 luminous_;  // second row of xyz_from_band_
};

/// XYZ of a chromaticity x, y and luminance factor Y; black when y = 0.
glm::dvec3 xyz_from_xyY(double x, double y, double Y);
/// (x, y, Y); black gives (0, 0, 0).
glm::dvec3 xyY_from_xyz(const glm::dvec3& xyz);

/// A reflectance that fits into [0, max_reflectance] per band.
struct FittedReflectance {
    Band3 reflectance;
    double saturation_kept = 1.0;  ///< 1: the colour fitted as it was; less: drawn towards the grey of the same Y
};

/// Three-band reflectance that shows the colour xyY under D65. A colour outside the gamut of the primaries is
/// desaturated at constant Y, as little as possible.
FittedReflectance reflectance_from_xyY(const Primaries& primaries, double x, double y, double Y, double max_reflectance);

/// Linear sRGB (not yet curved, not clamped) of a band triple.
glm::dvec3 linear_srgb(const Primaries& primaries, const Band3& band);
/// The sRGB curve, linear [0, 1] -> display [0, 1]; clamps.
double srgb_curve(double linear);

}  // namespace naturel
