#include "core/cie_general_types.h"
#include "core/sky_about_sun.h"

namespace naturel {
namespace {

/// ISO 15469:2004 (CIE S 011): docs/method.md eq. (Sky 7).
class CieGeneralSky {
public:
    CieGeneralSky(const CieGeneralType& type, const glm::dvec3& sun)
        : type_(type), constant_(1.0 - type.c * std::exp(0.5 * pi * type.d)) {
        scale_ = 1.0 / (*this)(1.0, sun.z);
    }

    double operator()(double sin_altitude, double cos_from_sun) const {
        double gradation = 1.0, scattering = 1.0;
        if (type_.a != 0.0) gradation += type_.a * std::exp(type_.b / above_horizon(sin_altitude));
        if (type_.depends_on_sun())
            scattering = constant_ + type_.c * std::exp(type_.d * fast_acos(cos_from_sun)) +
                         type_.e * cos_from_sun * cos_from_sun;
        return scale_ * gradation * scattering;
    }

private:
    CieGeneralType type_;
    double constant_;
    double scale_ = 1.0;
};

}  // namespace

std::unique_ptr<SkyShape> make_cie_general_sky(const SkyDescription& description, const glm::dvec3& sun) {
    if (description.cie_type == 16) return make_moon_spencer_sky(description, sun);
    const CieGeneralType& type = cie_general_types.at(static_cast<std::size_t>(description.cie_type - 1));
    return std::make_unique<SkyAboutSun<CieGeneralSky>>(CieGeneralSky(type, sun), sun);
}

}  // namespace naturel
