#pragma once
#include <optional>

#include "core/sky_description.h"

// Absolute levels by standard formulas, for skies and suns of which the scene tells no level (docs/method.md, "Levels").
namespace naturel {

/// cd/m2; empty for Perez' sky, tables and expressions. sun_altitude_rad: above 0.
std::optional<double> formula_zenith_luminance_cd_m2(const SkyDescription& description, double sun_altitude_rad);

/// The sun that belongs to the sky, lx on a plane that faces it: 0 under an overcast sky; empty for tables and expressions.
std::optional<double> formula_direct_normal_lx(const SkyDescription& description, double sun_altitude_rad);

/// Radiance's gensky: 1.5e9 (1.147 - 0.147 / max(sin h, 0.16)) cd/m2 x 6e-5 sr.
double gensky_direct_normal_lx(double sun_altitude_rad);
/// IES clear sky: 127.5 exp(-0.21 / sin h) klx.
double ies_direct_normal_lx(double sun_altitude_rad);
/// 133.8 exp(-a_v m T_v) klx, m by Kasten & Young 1989, a_v = 1 / (9.9 + 0.043 m).
double turbid_direct_normal_lx(double sun_altitude_rad, double luminous_turbidity);

}  // namespace naturel
