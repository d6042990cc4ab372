#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <vector>

#include "core/chromaticity.h"

namespace naturel {

/// A share (reflectance, transmittance) against wavelength: straight lines between the samples, the first and the last
/// value beyond them.
struct Spectrum {
    std::vector<double> wavelength_nm;  ///< increasing, at least one
    std::vector<double> value;          ///< [wavelength_nm]

    double at(double nm) const;
};

/// The wavelengths over which colours are summed: 380, 385, ... 780 nm.
inline constexpr std::size_t table_wavelengths = 81;
constexpr double table_wavelength_nm(std::size_t k) { return 380.0 + 5.0 * static_cast<double>(k); }
template <class Value>
using SpectrumTable = std::array<Value, table_wavelengths>;

extern const SpectrumTable<glm::dvec3> cie_1931_observer;        ///< x, y, z of the 2 degree observer
extern const SpectrumTable<double> cie_d65;                      ///< relative power, 100 at 560 nm
extern const SpectrumTable<glm::dvec3> cie_daylight_components;  ///< S0, S1, S2 of the D series

/// CIE XYZ of a surface or of a filter under D65; Y = 1 for a spectrum of 1 everywhere (docs/method.md, "Colour").
glm::dvec3 xyz_under_d65(const Spectrum& spectrum);

/// The same under an illuminant of any relative power.
glm::dvec3 xyz_under(const SpectrumTable<double>& illuminant, const Spectrum& spectrum);

/// Chromaticity of daylight of a correlated colour temperature of 4000 to 25000 K: the CIE's D series.
Chromaticity daylight_chromaticity(double cct_k);

/// Relative power of that daylight, 100 at 560 nm.
SpectrumTable<double> daylight_spectrum(double cct_k);

}  // namespace naturel
