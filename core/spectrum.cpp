#include "core/spectrum.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"

namespace naturel {

double Spectrum::at(double nm) const {
    NATUREL_EXPECT(!value.empty() && value.size() == wavelength_nm.size());
    const auto above = std::upper_bound(wavelength_nm.begin(), wavelength_nm.end(), nm);
    if (above == wavelength_nm.begin()) return value.front();
    if (above == wavelength_nm.end()) return value.back();
    const auto k = static_cast<std::size_t>(above - wavelength_nm.begin());
    const double share = (nm - wavelength_nm[k - 1]) / (wavelength_nm[k] - wavelength_nm[k - 1]);
    return value[k - 1] + share * (value[k] - value[k - 1]);
}

glm::dvec3 xyz_under(const SpectrumTable<double>& illuminant, const Spectrum& spectrum) {
    // docs/method.md eq. (Colour 7).
    glm::dvec3 sum(0.0);
    double white = 0.0;
    for (std::size_t k = 0; k < table_wavelengths; ++k) {
        sum += illuminant[k] * spectrum.at(table_wavelength_nm(k)) * cie_1931_observer[k];
        white += illuminant[k] * cie_1931_observer[k].y;
    }
    return sum / white;
}

glm::dvec3 xyz_under_d65(const Spectrum& spectrum) {
    return xyz_under(cie_d65, spectrum);
}

Chromaticity daylight_chromaticity(double cct_k) {
    // CIE 15, method of calculating D illuminants; docs/method.md eq. (Colour 8).
    const double t = 1e3 / cct_k;
    const double x = cct_k <= 7000.0 ? 0.244063 + t * (0.09911 + t * (2.9678 - 4.6070 * t))
                                     : 0.237040 + t * (0.24748 + t * (1.9018 - 2.0064 * t));
    return {x, -0.275 + x * (2.870 - 3.000 * x)};
}

SpectrumTable<double> daylight_spectrum(double cct_k) {
    const auto [x, y] = daylight_chromaticity(cct_k);
    // The standard rounds both factors to three decimals.
    const auto rounded = [](double factor) { return std::round(1000.0 * factor) / 1000.0; };
    const double m = 0.0241 + 0.2562 * x - 0.7341 * y;
    const double m1 = rounded((-1.3515 - 1.7703 * x + 5.9114 * y) / m);
    const double m2 = rounded((0.0300 - 31.4424 * x + 30.0717 * y) / m);
    SpectrumTable<double> power;
    for (std::size_t k = 0; k < table_wavelengths; ++k) {
        const glm::dvec3& s = cie_daylight_components[k];
        power[k] = s.x + m1 * s.y + m2 * s.z;
    }
    return power;
}

}  // namespace naturel
