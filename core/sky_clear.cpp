#include "core/sky_about_sun.h"

namespace naturel {
namespace {

/// CIE Publ. 22 (1973), Kittler: docs/method.md eqs. (Sky 3) and (Sky 4).
struct ClearSky {
    double a, b, c;

    double operator()(double sin_altitude, double cos_from_sun) const {
        const double gradation = 1.0 - std::exp(-0.32 / above_horizon(sin_altitude));
        const double scattering = a + b * std::exp(-3.0 * fast_acos(cos_from_sun)) + c * cos_from_sun * cos_from_sun;
        return gradation * scattering;
    }
};

}  // namespace

std::unique_ptr<SkyShape> make_clear_sky(const SkyDescription& description, const glm::dvec3& sun) {
    const ClearSky sky =
        description.model == SkyModel::cie_clear ? ClearSky{0.91, 10.0, 0.45} : ClearSky{0.856, 16.0, 0.30};
    const double zenith = sky(1.0, sun.z);
    return std::make_unique<SkyAboutSun<ClearSky>>(ClearSky{sky.a / zenith, sky.b / zenith, sky.c / zenith}, sun);
}

}  // namespace naturel
