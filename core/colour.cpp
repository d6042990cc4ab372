#include "core/colour.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/matrix.hpp>
#include <limits>

namespace naturel {
namespace {

std::array<Chromaticity, 3> chromaticities(const PrimariesDescription& description) {
    switch (description.name) {
        case PrimariesName::srgb:  // IEC 61966-2-1, ITU-R BT.709
            return {{{0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}}};
        case PrimariesName::ebu:  // PAL monitors: ITU-R BT.470 systems B and G
            return {{{0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}}};
        case PrimariesName::p22:  // EBU Tech. 3213-E, ITU-T H.273 colour primaries 22
            return {{{0.630, 0.340}, {0.295, 0.605}, {0.155, 0.077}}};
        case PrimariesName::smpte_c:  // SMPTE RP 145, NTSC monitors
            return {{{0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}}};
        case PrimariesName::trinitron_p22:  // Sony's tubes, "Apple RGB"
            return {{{0.625, 0.340}, {0.280, 0.595}, {0.155, 0.070}}};
        case PrimariesName::custom:
            return description.custom;
    }
    std::abort();  // every name has returned
}

/// The columns are XYZ of the primaries, each of Y = 1.
glm::dmat3 unscaled_matrix(const std::array<Chromaticity, 3>& primaries) {
    const auto& [red, green, blue] = primaries;
    return {xyz_from_xyY(red.x, red.y, 1.0), xyz_from_xyY(green.x, green.y, 1.0),
            xyz_from_xyY(blue.x, blue.y, 1.0)};
}

/// Luminances of the primaries that add up to D65 of Y = 1.
glm::dvec3 shares_of_d65(const std::array<Chromaticity, 3>& primaries) {
    return glm::inverse(unscaled_matrix(primaries)) *
           xyz_from_xyY(d65_chromaticity.x, d65_chromaticity.y, 1.0);
}

/// docs/method.md eq. (Colour 2).
glm::dmat3 xyz_from_band_matrix(const std::array<Chromaticity, 3>& primaries) {
    const glm::dmat3 unscaled = unscaled_matrix(primaries);
    const glm::dvec3 scale = shares_of_d65(primaries);
    return {scale.x * unscaled[0], scale.y * unscaled[1], scale.z * unscaled[2]};
}

/// How far a band may go from `grey` towards `full` without leaving [0, limit]: 1 = all the way.
double saturation_that_fits(double full, double grey, double limit, double slack) {
    if (full > limit + slack) return grey < limit ? (limit - grey) / (full - grey) : 0.0;
    if (full < -slack) return grey / (grey - full);
    return 1.0;
}

}  // namespace

bool can_mix_d65(const std::array<Chromaticity, 3>& primaries) {
    // Below this share the primaries lie on a line with D65 for all that counts, and the matrix amplifies noise.
    constexpr double least = 1e-3;
    if (!(std::abs(glm::determinant(unscaled_matrix(primaries))) > 1e-9)) return false;
    const glm::dvec3 shares = shares_of_d65(primaries);
    return shares.x >= least && shares.y >= least && shares.z >= least;
}

Primaries::Primaries(const PrimariesDescription& description)
    : xyz_from_band_(xyz_from_band_matrix(chromaticities(description))),
      band_from_xyz_(glm::inverse(xyz_from_band_)),
      luminous_{xyz_from_band_[0].y, xyz_from_band_[1].y, xyz_from_band_[2].y} {}

glm::dvec3 Primaries::xyz(const Band3& band) const {
    return xyz_from_band_ * glm::dvec3(band.r, band.g, band.b);
}

Band3 Primaries::from_xyz(const glm::dvec3& xyz) const {
    const glm::dvec3 band = band_from_xyz_ * xyz;
    return {band.x, band.y, band.z};
}

glm::dvec3 xyz_from_xyY(double x, double y, double Y) {
    if (y == 0.0) return glm::dvec3(0.0);
    return {x * Y / y, Y, (1.0 - x - y) * Y / y};
}

glm::dvec3 xyY_from_xyz(const glm::dvec3& xyz) {
    const double sum = xyz.x + xyz.y + xyz.z;
    if (sum == 0.0) return glm::dvec3(0.0);
    return {xyz.x / sum, xyz.y / sum, xyz.y};
}

FittedBands fit_bands(const Primaries& primaries, const glm::dvec3& xyz, double limit, double slack) {
    const Band3 wanted = primaries.from_xyz(xyz);
    const double grey_level = primaries.luminous(wanted);
    const double kept = std::min({saturation_that_fits(wanted.r, grey_level, limit, slack),
                                  saturation_that_fits(wanted.g, grey_level, limit, slack),
                                  saturation_that_fits(wanted.b, grey_level, limit, slack)});
    // docs/method.md eq. (Colour 5). The clamp removes rounding, and the surplus of a Y above the limit, which
    // no desaturation can fit.
    const auto fitted = [&](double band) {
        return std::clamp(kept == 1.0 ? band : grey_level + kept * (band - grey_level), 0.0, limit);
    };
    FittedBands fit{{fitted(wanted.r), fitted(wanted.g), fitted(wanted.b)}, {.saturation_kept = kept}};
    if (kept < 1.0) {
        const glm::dvec3 asked = xyY_from_xyz(xyz), shown = xyY_from_xyz(primaries.xyz(fit.band));
        fit.desaturation.chromaticity_shift = std::hypot(shown.x - asked.x, shown.y - asked.y);
    }
    return fit;
}

FittedBands reflectance_from_xyY(const Primaries& primaries, double x, double y, double Y, double limit) {
    if (Chromaticity{x, y} == d65_chromaticity && Y <= limit) return {grey(Y)};
    return fit_bands(primaries, xyz_from_xyY(x, y, Y), limit);
}

FittedBands bands_from_spectrum(const Primaries& primaries, const Spectrum& spectrum, double limit) {
    // The table of D65 in steps of 5 nm has the chromaticity 0.31272, 0.32903 and not the four digits of
    // d65_chromaticity: bands of a white surface differ from 1 by up to 2.8e-4 (sRGB, blue). That is no reason to
    // call it out of gamut.
    constexpr double white_mismatch = 4e-4;
    return fit_bands(primaries, xyz_under_d65(spectrum), limit, white_mismatch);
}

LightColour light_colour(const Primaries& primaries, const Chromaticity& chromaticity) {
    if (chromaticity == d65_chromaticity) return {};
    const FittedBands fit = fit_bands(primaries, xyz_from_xyY(chromaticity.x, chromaticity.y, 1.0),
                                      std::numeric_limits<double>::infinity());
    return {fit.band, fit.desaturation};
}

glm::dmat3 chromatic_adaptation(const glm::dvec3& white, const glm::dvec3& to_white) {
    // Lam 1985; coefficients as in ICC.1 and CIECAM97s. glm takes columns.
    const glm::dmat3 cones = glm::transpose(
        glm::dmat3(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296));
    const glm::dvec3 ratio = (cones * to_white) / (cones * white);
    const glm::dmat3 scale(ratio.x, 0, 0, 0, ratio.y, 0, 0, 0, ratio.z);
    return glm::inverse(cones) * scale * cones;
}

glm::dvec3 linear_srgb(const Primaries& primaries, const Band3& band) {
    static const Primaries srgb(PrimariesName::srgb);
    const Band3 display = srgb.from_xyz(primaries.xyz(band));
    return {display.r, display.g, display.b};
}

double srgb_curve(double linear) {
    // IEC 61966-2-1.
    const double v = std::clamp(linear, 0.0, 1.0);
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

}  // namespace naturel
