#pragma once
#include "core/sky_description.h"

// R. Perez' all-weather sky (docs/method.md, "Perez").
namespace naturel {

/// What the model makes of the weather: clearness epsilon in [1, 12), brightness delta.
struct PerezCondition {
    double clearness = 1.0;
    double brightness = 0.01;
};

struct PerezCoefficients {
    double a, b, c, d, e;
};

/// Irradiances, with the light they carry.
struct PerezLight {
    PerezCondition condition;
    double direct_normal_W_m2 = 0.0, diffuse_horizontal_W_m2 = 0.0;
    double direct_normal_lx = 0.0, diffuse_horizontal_lx = 0.0;
    double direct_efficacy_lm_W = 0.0, diffuse_efficacy_lm_W = 0.0;
};

/// Relative optical air mass (F. Kasten 1966). sun_zenith_rad: the sun's angle from the zenith, below pi / 2.
double air_mass_kasten(double sun_zenith_rad);

/// Correction of the mean extraterrestrial irradiance for the day of the year, 1 to 366 (J. W. Spencer 1971).
double eccentricity_of_day(int day_of_year);

/// Not clipped to what the model is used for: see PerezLight.
PerezCondition perez_condition(double direct_normal_W_m2, double diffuse_horizontal_W_m2, double sun_zenith_rad,
                               double eccentricity);

/// Bin of clearness, 0 to 7.
int perez_bin(double clearness);

/// A brightness below 0.2 counts as 0.2 for a clearness between 1.065 and 2.8, as in Radiance.
PerezCoefficients perez_coefficients(const PerezCondition& condition, double sun_zenith_rad);

/// Irradiances into illuminances, or the other way round when the weather gives illuminances (by iteration).
/// condition: clipped as Radiance does: 1 <= clearness < 12, 0.01 <= brightness <= 0.6.
PerezLight perez_light(const PerezWeather& weather, double sun_zenith_rad);

}  // namespace naturel
