#pragma once
#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "core/band3.h"
#include "core/scene.h"
#include "core/spectrum.h"

namespace naturel {

/// The three-band basis of a scene: phosphor-like primaries whose sum has the colour of D65 (docs/method.md, "Colour").
class Primaries {
public:
    explicit Primaries(const PrimariesDescription& description);
    explicit Primaries(PrimariesName name) : Primaries(PrimariesDescription{.name = name}) {}

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

/// Whether three primaries of these chromaticities (red, green, blue) can be mixed to D65, each with a positive share.
bool can_mix_d65(const std::array<Chromaticity, 3>& primaries);

/// Bands that fit into [0, limit].
struct FittedBands {
    Band3 band;
    Desaturation desaturation{};
};

/// Bands that show the colour `xyz`. A colour outside the gamut of the primaries, or too bright in one band, is
/// desaturated at constant Y, as little as possible (docs/method.md eq. (Colour 5)).
/// slack: bands that miss [0, limit] by no more than this are clamped, and the colour counts as shown.
FittedBands fit_bands(const Primaries& primaries, const glm::dvec3& xyz, double limit, double slack = 1e-13);

/// Three-band reflectance (limit 1 or less) that shows the colour xyY under D65; grey to the last bit for the
/// chromaticity of D65 itself.
FittedBands reflectance_from_xyY(const Primaries& primaries, double x, double y, double Y, double limit);

/// The same for a spectrum of reflectance or transmittance.
FittedBands bands_from_spectrum(const Primaries& primaries, const Spectrum& spectrum, double limit);

/// A light of luminance 1. A colour outside the gamut is desaturated.
LightColour light_colour(const Primaries& primaries, const Chromaticity& chromaticity);

/// XYZ as they look to an eye adapted to `white`, for an eye adapted to `to_white`: Bradford's transform.
glm::dmat3 chromatic_adaptation(const glm::dvec3& white, const glm::dvec3& to_white);

/// Linear sRGB (not yet curved, not clamped) of a band triple.
glm::dvec3 linear_srgb(const Primaries& primaries, const Band3& band);
/// The sRGB curve, linear [0, 1] -> display [0, 1]; clamps.
double srgb_curve(double linear);

}  // namespace naturel
