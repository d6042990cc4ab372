#include "core/sky_about_sun.h"

namespace naturel {
namespace {

/// Y. Nakamura, M. Oki & Y. Hayashi 1985 in the form of K. Matsuura 1987, Radiance's intermediate sky:
/// docs/method.md eq. (Sky 8). Angles: altitude phi, sun's altitude phis.
struct IntermediateSky {
    double sun_altitude;
    double scale;    // 1 / (Z3 Z4)
    double sine;     // sin(2.6 phis + 0.316)

    explicit IntermediateSky(double phis) : sun_altitude(phis), sine(std::sin(2.6 * phis + 0.316)) {
        const double z3 = 0.99224 * sine + 2.73852;
        const double z4 = std::exp(-0.563 * (0.5 * pi - phis) * (2.6298 * (phis - 0.008) + 0.812));
        scale = 1.0 / (z3 * z4);
    }

    double operator()(double sin_altitude, double cos_from_sun) const {
        const double phi = 0.5 * pi - fast_acos(sin_altitude), chi = fast_acos(cos_from_sun);
        const double z1 = (1.35 * (std::sin(3.59 * phi - 0.009) + 2.31) * sine + phi + 4.799) / 2.326;
        const double z2 = std::exp(-0.563 * chi * ((sun_altitude - 0.008) * (phi + 1.059) + 0.812));
        return scale * z1 * z2;
    }
};

}  // namespace

std::unique_ptr<SkyShape> make_intermediate_sky(const SkyDescription&, const glm::dvec3& sun) {
    // The altitude has the shape of a cone at the zenith, which converges slowly: 3e-7 with these nodes.
    constexpr int node_count = 200;
    return std::make_unique<SkyAboutSun<IntermediateSky>>(IntermediateSky(std::asin(std::clamp(sun.z, -1.0, 1.0))),
                                                          sun, node_count);
}

}  // namespace naturel
