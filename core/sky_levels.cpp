#include "core/sky_levels.h"

#include <algorithm>
#include <cmath>

#include "core/cie_general_types.h"
#include "core/perez.h"

namespace naturel {
namespace {

/// J. Krochmann 1963, docs/method.md eq. (Level 1).
double overcast_zenith(double h) { return 123.0 + 8600.0 * std::sin(h); }

/// R. Dogniaux & J. Krochmann, docs/method.md eq. (Level 2); gensky's turbidity and its limit of 87 degrees.
double clear_zenith(double h, double turbidity) {
    return 1000.0 * ((1.376 * turbidity - 1.81) * std::tan(std::min(h, radians_from_degrees(87.0))) + 0.38);
}
constexpr double gensky_turbidity = 2.45;

/// R. Kittler & S. Darula, docs/method.md eqs. (Level 3) and (Level 4); the same limit, cos h standing below a line.
double cie_general_zenith(const CieGeneralType& type, std::optional<double> turbidity, double altitude_rad) {
    const double h = std::min(altitude_rad, radians_from_degrees(87.0));
    const ZenithLevel& z = type.zenith;
    const double s = std::sin(h), peak = std::pow(s, z.c) / std::pow(std::cos(h), z.d);
    const double t = turbidity.value_or(z.turbidity);
    const double klx = type.shows_sun() ? (z.a1 * t + z.a2) * s + 0.7 * (t + 1.0) * peak + 0.04 * t
                                        : z.diffuse_share * (z.b * peak + z.e * s);
    return 1000.0 * std::max(0.0, klx);
}

const CieGeneralType& type_of(const SkyDescription& description) {
    return cie_general_types.at(static_cast<std::size_t>(description.cie_type - 1));
}

}  // namespace

std::optional<double> formula_zenith_luminance_cd_m2(const SkyDescription& description, double sun_altitude_rad) {
    const double h = sun_altitude_rad;
    const double clear = clear_zenith(h, description.turbidity.value_or(gensky_turbidity));
    switch (description.model) {
        case SkyModel::uniform:
        case SkyModel::moon_spencer:
            return overcast_zenith(h);
        case SkyModel::cie_clear:
        case SkyModel::cie_clear_polluted:
            return clear;
        case SkyModel::intermediate:
            return 0.5 * (clear + overcast_zenith(h));
        case SkyModel::cie_general:
            if (description.cie_type == 16) return overcast_zenith(h);
            return cie_general_zenith(type_of(description), description.turbidity, h);
        case SkyModel::perez:
        case SkyModel::table:
        case SkyModel::expression:
            break;
    }
    return std::nullopt;
}

std::optional<double> formula_direct_normal_lx(const SkyDescription& description, double sun_altitude_rad) {
    switch (description.model) {
        case SkyModel::uniform:
        case SkyModel::moon_spencer:
            return 0.0;
        case SkyModel::cie_clear:
        case SkyModel::cie_clear_polluted:
            return gensky_direct_normal_lx(sun_altitude_rad);
        case SkyModel::intermediate:
            return 0.15 * gensky_direct_normal_lx(sun_altitude_rad);  // gensky's "fudge factor"
        case SkyModel::cie_general:
            if (description.cie_type == 16 || !type_of(description).shows_sun()) return 0.0;
            return turbid_direct_normal_lx(
                sun_altitude_rad, description.turbidity.value_or(type_of(description).zenith.turbidity));
        case SkyModel::perez:
            return perez_light(description.perez, 0.5 * pi - sun_altitude_rad).direct_normal_lx;
        case SkyModel::table:
        case SkyModel::expression:
            break;
    }
    return std::nullopt;
}

double gensky_direct_normal_lx(double sun_altitude_rad) {
    return 1.5e9 * (1.147 - 0.147 / std::max(std::sin(sun_altitude_rad), 0.16)) * 6e-5;
}

double ies_direct_normal_lx(double sun_altitude_rad) {
    return 127500.0 * std::exp(-0.21 / std::sin(sun_altitude_rad));
}

double turbid_direct_normal_lx(double sun_altitude_rad, double luminous_turbidity) {
    const double air_mass =
        1.0 / (std::sin(sun_altitude_rad) +
               0.50572 * std::pow(degrees_from_radians(sun_altitude_rad) + 6.07995, -1.6364));
    return 133800.0 * std::exp(-air_mass * luminous_turbidity / (9.9 + 0.043 * air_mass));
}

}  // namespace naturel
