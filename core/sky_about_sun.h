#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/gauss_legendre.h"
#include "core/sky_shape.h"
#include "core/units.h"

// Skies whose luminance depends on the altitude and on the angle from the sun.
namespace naturel {

/// Angle whose cosine is c, within 2e-8 rad (Abramowitz & Stegun 4.4.46). A third of the time of std::acos,
/// and the clear skies change by less than 7e-8 of their value.
inline double fast_acos(double c) {
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

/// sin(altitude), kept off 0 so that exp(b / s) is defined on the horizon; its limit there is reached long before.
inline double above_horizon(double s) { return std::max(s, 1e-6); }

/// Integral over the sky in polar coordinates about an axis, where an integrand that peaks at the axis has no peak: chi from the axis,
/// psi around it from the upward vertical. Circles about the axis lie wholly above the horizon, or cross it.
/// along_arc(chi, level, swing, half_arc): mean over psi in [0, half_arc] of the integrand, where sin(altitude) = level + swing cos(psi).
/// One half of psi is integrated; docs/method.md eq. (Sky 6).
template <class AlongArc>
double integrate_half_sky_about(const glm::dvec3& axis, const QuadratureRule& rule, const AlongArc& along_arc) {
    const double sin_axis = axis.z, cos_axis = std::hypot(axis.x, axis.y);
    const double from_horizon = std::abs(std::atan2(sin_axis, cos_axis));
    // Circles about the axis up to the first border, and from the second on, lie on one side of the horizon.
    const std::array<double, 4> borders{0.0, from_horizon, pi - from_horizon, pi};
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
            const double level = sin_axis * std::cos(chi), swing = cos_axis * std::sin(chi);
            if (level <= -swing) continue;
            const double half_arc = level >= swing ? pi : std::acos(-level / swing);
            sum += dchi * std::sin(chi) * half_arc * along_arc(chi, level, swing, half_arc);
        }
    }
    return sum;
}

/// Integrates luminance x sin(altitude) over the sky about the sun: scattering depends on chi alone. Half of psi is enough, the sky
/// being symmetrical about the sun's vertical.
/// luminance(sin_altitude, cos_from_sun) -> double. Nodes per part: 48 leave a relative error below 1e-9 on the clear skies.
template <class Function>
double integrate_about_sun(const glm::dvec3& sun, const Function& luminance, int node_count = 64) {
    const QuadratureRule rule = gauss_legendre(node_count);
    return 2.0 * integrate_half_sky_about(sun, rule, [&](double chi, double level, double swing, double half_arc) {
        double mean = 0.0;
        for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
            const double s = level + swing * std::cos(half_arc * rule.nodes[k]);
            mean += rule.weights[k] * s * luminance(s, std::cos(chi));
        }
        return mean;
    });
}

/// Function: double (double sin_altitude, double cos_from_sun) const.
template <class Function>
class SkyAboutSun final : public SkyShape {
public:
    SkyAboutSun(const Function& function, const glm::dvec3& sun, int node_count = 64)
        : function_(function), sun_(sun), horizontal_(integrate_about_sun(sun, function, node_count)) {}

    double luminance(const glm::dvec3& direction) const override {
        return function_(direction.z, glm::dot(direction, sun_));
    }
    double horizontal() const override { return horizontal_; }

private:
    Function function_;
    glm::dvec3 sun_;
    double horizontal_;
};

}  // namespace naturel
