#include "core/colour.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/matrix.hpp>

namespace naturel {
namespace {

struct Chromaticity {
    double x, y;
};

/// CIE standard illuminant D65, 2 degree observer, to the four digits that every definition of primaries
/// uses.
constexpr Chromaticity d65{0.3127, 0.3290};

struct PrimaryChromaticities {
    Chromaticity red, green, blue;
};

PrimaryChromaticities chromaticities(PrimariesName name) {
    switch (name) {
        case PrimariesName::srgb:  // IEC 61966-2-1, ITU-R BT.709
            return {{0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}};
        case PrimariesName::ebu:  // PAL monitors: ITU-R BT.470 systems B and G
            return {{0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}};
        case PrimariesName::p22:  // EBU Tech. 3213-E, ITU-T H.273 colour primaries 22
            return {{0.630, 0.340}, {0.295, 0.605}, {0.155, 0.077}};
    }
    std::abort();  // every name has returned
}

/// docs/method.md eq. (Colour 2): the column of each primary, scaled so that the three add up to D65 of Y
/// = 1.
glm::dmat3 xyz_from_band_matrix(const PrimaryChromaticities& primary) {
    const glm::dmat3 unscaled(xyz_from_xyY(primary.red.x, primary.red.y, 1.0),
                              xyz_from_xyY(primary.green.x, primary.green.y, 1.0),
                              xyz_from_xyY(primary.blue.x, primary.blue.y, 1.0));
    const glm::dvec3 scale = glm::inverse(unscaled) * xyz_from_xyY(d65.x, d65.y, 1.0);
    return {scale.x * unscaled[0], scale.y * unscaled[1], scale.z * unscaled[2]};
}

/// How far a band may go from `grey` towards `full` without leaving [0, limit]: 1 = all the way.
double saturation_that_fits(double full, double grey, double limit) {
    // A hundred times what rounding does to a band. Without it a white of exactly the largest reflectance
    // would count as too bright.
    constexpr double rounding = 1e-13;
    if (full > limit + rounding) return grey < limit ? (limit - grey) / (full - grey) : 0.0;
    if (full < -rounding) return grey / (grey - full);
    return 1.0;
}

}  // namespace

Primaries::Primaries(PrimariesName name)
    : xyz_from_band_(xyz_from_band_matrix(chromaticities(name))),
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

FittedReflectance reflectance_from_xyY(const Primaries& primaries, double x, double y, double Y,
                                       double max_reflectance) {
    const Band3 wanted = primaries.from_xyz(xyz_from_xyY(x, y, Y));
    const double grey_level = primaries.luminous(wanted);  // Y, or 0 where y = 0 makes the colour black
    const double kept = std::min({saturation_that_fits(wanted.r, grey_level, max_reflectance),
                                  saturation_that_fits(wanted.g, grey_level, max_reflectance),
                                  saturation_that_fits(wanted.b, grey_level, max_reflectance)});
    // docs/method.md eq. (Colour 5). The clamp removes rounding, and the surplus of a Y above
    // max_reflectance, which no desaturation can fit.
    const auto fitted = [&](double band) {
        return std::clamp(grey_level + kept * (band - grey_level), 0.0, max_reflectance);
    };
    return {{fitted(wanted.r), fitted(wanted.g), fitted(wanted.b)}, kept};
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
