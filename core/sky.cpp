#include "core/sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/errors.h"
#include "core/gauss_legendre.h"

namespace naturel {
namespace {

/// Angle whose cosine is c, within 2e-8 rad (Abramowitz & Stegun 4.4.46). A third of the time of std::acos,
/// and the clear skies change by less than 7e-8 of their value.
double fast_acos(double c) {
    const double x = std::min(std::abs(c), 1.0);
    double p = -0.0012624911;
    p = p * x + 0.0066700901;
    p = p * x - 0.0170881256;
    p = p * x + 0.0308918810;
    p = p * x - 0.0501743046;
    p = p * x + 0.0889789874;
    p = p * x - 0.2145988016;
    p = p * x + 1.5707963050;
    const double acute = std::sqrt(1.0 - x) * p;
    return c < 0.0 ? pi - acute : acute;
}

/// How a clear sky brightens towards the horizon, docs/method.md eq. (Sky 4); s = sin(altitude).
double clear_gradation(double s) {
    // Keeps exp(b / s) defined on the horizon itself; its value there, 0, is reached long before.
    constexpr double horizon_guard = 1e-6;
    return 1.0 - std::exp(-0.32 / std::max(s, horizon_guard));
}

}  // namespace

Sky::Sky(const SkyDescription& description, const glm::dvec3& sun_direction)
    : model_(description.model), sun_direction_(sun_direction) {
    NATUREL_EXPECT(description.zenith_luminance_cd_m2.has_value() !=
                   description.horizontal_illuminance_lx.has_value());
    double horizontal_per_zenith = pi;
    switch (model_) {
        case SkyModel::uniform:
            break;
        case SkyModel::moon_spencer:
            horizontal_per_zenith = 7.0 * pi / 9.0;
            break;
        case SkyModel::cie_clear:
        case SkyModel::cie_clear_polluted: {
            // CIE Publ. 22 (1973), Kittler: low turbidity and polluted atmosphere.
            indicatrix_ =
                model_ == SkyModel::cie_clear ? Indicatrix{0.91, 10.0, 0.45} : Indicatrix{0.856, 16.0, 0.30};
            const double at_zenith = clear_relative_luminance(1.0, sun_direction_.z);
            indicatrix_ = {indicatrix_.a / at_zenith, indicatrix_.b / at_zenith, indicatrix_.c / at_zenith};
            horizontal_per_zenith = clear_horizontal_per_zenith();
            break;
        }
    }
    if (description.zenith_luminance_cd_m2) {
        zenith_luminance_ = {*description.zenith_luminance_cd_m2};
        horizontal_illuminance_ = {horizontal_per_zenith * zenith_luminance_.value};
    } else {
        horizontal_illuminance_ = {*description.horizontal_illuminance_lx};
        zenith_luminance_ = {horizontal_illuminance_.value / horizontal_per_zenith};
    }
}

Luminance Sky::luminance(const glm::dvec3& direction) const {
    if (direction.z < 0.0) return {0.0};
    return relative_luminance(direction) * zenith_luminance_;
}

double Sky::relative_luminance(const glm::dvec3& direction) const {
    switch (model_) {
        case SkyModel::uniform:
            return 1.0;
        case SkyModel::moon_spencer:
            return (1.0 + 2.0 * direction.z) / 3.0;
        case SkyModel::cie_clear:
        case SkyModel::cie_clear_polluted:
            break;
    }
    return clear_relative_luminance(direction.z, glm::dot(direction, sun_direction_));
}

/// docs/method.md eq. (Sky 3)
double Sky::clear_relative_luminance(double sin_altitude, double cos_from_sun) const {
    const double scattering = indicatrix_.a + indicatrix_.b * std::exp(-3.0 * fast_acos(cos_from_sun)) +
                              indicatrix_.c * cos_from_sun * cos_from_sun;
    return clear_gradation(sin_altitude) * scattering;
}

/// Integrates relative luminance x sin(altitude) over the sky, docs/method.md eq. (Sky 6).
/// In polar coordinates about the sun (chi from it, psi around it from the upward vertical), because there
/// the integrand has no peak: scattering depends on chi alone. Half of psi is enough, the sky being
/// symmetrical about the sun's vertical.
double Sky::clear_horizontal_per_zenith() const {
    constexpr int node_count = 48;  // relative error below 1e-9 for any sun: 200 nodes give the same
    const QuadratureRule rule = gauss_legendre(node_count);
    const double sin_sun = sun_direction_.z;
    const double cos_sun = std::hypot(sun_direction_.x, sun_direction_.y);
    const double sun_from_horizon = std::abs(std::atan2(sin_sun, cos_sun));
    // Circles about the sun up to the first border, and from the second on, lie on one side of the horizon.
    const std::array<double, 4> borders{0.0, sun_from_horizon, pi - sun_from_horizon, pi};
    double sum = 0.0;
    for (std::size_t part = 0; part + 1 < borders.size(); ++part) {
        const double width = borders[part + 1] - borders[part];
        for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
            // t^2 (3 - 2 t) crowds the nodes at the borders, where the arc above the horizon starts with a
            // root.
            const double t = rule.nodes[i];
            const double chi = borders[part] + width * t * t * (3.0 - 2.0 * t);
            const double dchi = width * 6.0 * t * (1.0 - t) * rule.weights[i];

            // sin(altitude) = level + swing cos(psi), positive for psi in [0, half_arc)
            const double level = sin_sun * std::cos(chi), swing = cos_sun * std::sin(chi);
            if (level <= -swing) continue;
            const double half_arc = level >= swing ? pi : std::acos(-level / swing);
            double arc_sum = 0.0;
            for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
                const double s = level + swing * std::cos(half_arc * rule.nodes[k]);
                arc_sum += rule.weights[k] * s * clear_relative_luminance(s, std::cos(chi));
            }
            sum += dchi * std::sin(chi) * 2.0 * half_arc * arc_sum;
        }
    }
    return sum;
}

}  // namespace naturel
