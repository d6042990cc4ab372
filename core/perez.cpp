#include "core/perez.h"

#include <algorithm>
#include <cmath>

#include "core/perez_tables.h"
#include "core/sky_about_sun.h"
#include "core/sky_patches.h"

namespace naturel {
namespace {

constexpr double solar_irradiance_W_m2 = 1367.0, solar_illuminance_lx = 127500.0;  // as Perez and Radiance

/// docs/method.md eq. (Perez 3)
struct PerezSky {
    PerezCoefficients k;

    double operator()(double sin_altitude, double cos_from_sun) const {
        // The gradation of some bins grows without bound at the horizon; Radiance stops at 0.01.
        const double s = std::max(sin_altitude, 0.01);
        const double value = (1.0 + k.a * std::exp(k.b / s)) *
                             (1.0 + k.c * std::exp(k.d * fast_acos(cos_from_sun)) + k.e * cos_from_sun * cos_from_sun);
        return std::max(value, 0.0);
    }
};

class ScaledPerezSky final : public SkyShape {
public:
    ScaledPerezSky(const PerezSky& sky, const glm::dvec3& sun, double diffuse_lx, bool by_patches)
        : shape_(sky, sun, 96) {
        double sum = shape_.horizontal();
        if (by_patches) {
            sum = 0.0;
            const SkyPatches patches = tregenza_patches();
            for (int patch = 0; patch < patches.count(); ++patch) {
                const glm::dvec3 centre = patches.centre(patch);
                sum += shape_.luminance(centre) * centre.z * patches.solid_angle_sr(patch);
            }
        }
        scale_ = sum > 0.0 ? diffuse_lx / sum : 0.0;
    }

    double luminance(const glm::dvec3& direction) const override { return scale_ * shape_.luminance(direction); }
    double horizontal() const override { return scale_ * shape_.horizontal(); }

private:
    SkyAboutSun<PerezSky> shape_;
    double scale_ = 0.0;
};

double efficacy(const std::array<double, 4>& k, double water_cm, double third, double fourth) {
    return k[0] + k[1] * water_cm + k[2] * third + k[3] * fourth;
}

PerezCondition clipped(PerezCondition condition) {
    condition.clearness = std::clamp(condition.clearness, 1.0, 11.99);
    condition.brightness = std::clamp(condition.brightness, 0.01, 0.6);
    return condition;
}

}  // namespace

double air_mass_kasten(double sun_zenith_rad) {
    return 1.0 / (std::cos(sun_zenith_rad) + 0.15 * std::pow(93.885 - degrees_from_radians(sun_zenith_rad), -1.253));
}

double eccentricity_of_day(int day_of_year) {
    const double b = 2.0 * pi * (day_of_year - 1) / 365.0;
    return 1.00011 + 0.034221 * std::cos(b) + 0.00128 * std::sin(b) + 0.000719 * std::cos(2.0 * b) +
           0.000077 * std::sin(2.0 * b);
}

/// docs/method.md eq. (Perez 1)
PerezCondition perez_condition(double direct_normal_W_m2, double diffuse_horizontal_W_m2, double sun_zenith_rad,
                               double eccentricity) {
    const double k = 1.041 * sun_zenith_rad * sun_zenith_rad * sun_zenith_rad;
    // No diffuse light: as clear as can be under a sun, as overcast as can be at night.
    double ratio = direct_normal_W_m2 > 0.0 ? 1e9 : 1.0;
    if (diffuse_horizontal_W_m2 > 0.0)
        ratio = (diffuse_horizontal_W_m2 + direct_normal_W_m2) / diffuse_horizontal_W_m2;
    return {(ratio + k) / (1.0 + k),
            diffuse_horizontal_W_m2 * air_mass_kasten(sun_zenith_rad) / (solar_irradiance_W_m2 * eccentricity)};
}

int perez_bin(double clearness) {
    int bin = 0;
    while (bin + 1 < 8 && clearness >= perez::clearness_from[static_cast<std::size_t>(bin + 1)])
        ++bin;
    return bin;
}

/// docs/method.md eq. (Perez 2)
PerezCoefficients perez_coefficients(const PerezCondition& condition, double sun_zenith_rad) {
    const int bin = perez_bin(condition.clearness);
    const std::array<double, 20>& x = perez::shape[static_cast<std::size_t>(bin)];
    const double zenith = sun_zenith_rad;
    double delta = condition.brightness;
    if (condition.clearness > 1.065 && condition.clearness < 2.8) delta = std::max(delta, 0.2);
    const auto linear = [&](std::size_t first) {
        return x[first] + x[first + 1] * zenith + delta * (x[first + 2] + x[first + 3] * zenith);
    };
    PerezCoefficients k{linear(0), linear(4), linear(8), linear(12), linear(16)};
    if (bin == 0) {
        k.c = std::exp(std::pow(delta * (x[8] + x[9] * zenith), x[10])) - x[11];
        k.d = -std::exp(delta * (x[12] + x[13] * zenith)) + x[14] + delta * x[15];
    }
    return k;
}

/// docs/method.md eqs. (Perez 4) to (Perez 6)
PerezLight perez_light(const PerezWeather& weather, double sun_zenith_rad) {
    const double water_cm = std::exp(0.07 * weather.dew_point_c - 0.075);
    PerezLight light;
    const auto evaluate = [&](double direct_W_m2, double diffuse_W_m2) {
        light.direct_normal_W_m2 = direct_W_m2;
        light.diffuse_horizontal_W_m2 = diffuse_W_m2;
        light.condition = clipped(perez_condition(direct_W_m2, diffuse_W_m2, sun_zenith_rad, weather.eccentricity));
        const auto bin = static_cast<std::size_t>(perez_bin(light.condition.clearness));
        const double delta = light.condition.brightness;
        light.diffuse_efficacy_lm_W =
            efficacy(perez::diffuse_efficacy[bin], water_cm, std::cos(sun_zenith_rad), std::log(delta));
        light.direct_efficacy_lm_W = std::max(
            0.0, efficacy(perez::direct_efficacy[bin], water_cm, std::exp(5.73 * sun_zenith_rad - 5.0), delta));
    };
    if (!weather.diffuse_horizontal_lx || !weather.direct_normal_lx) {
        evaluate(weather.direct_normal_W_m2, weather.diffuse_horizontal_W_m2);
        light.direct_normal_lx = light.direct_normal_W_m2 * light.direct_efficacy_lm_W;
        light.diffuse_horizontal_lx = light.diffuse_horizontal_W_m2 * light.diffuse_efficacy_lm_W;
        return light;
    }
    const double mean_efficacy = solar_illuminance_lx / solar_irradiance_W_m2;
    double direct_W_m2 = *weather.direct_normal_lx / mean_efficacy;
    double diffuse_W_m2 = *weather.diffuse_horizontal_lx / mean_efficacy;
    // Bins have steps: where two of them point at each other the last pass counts, as in Radiance.
    constexpr int most_passes = 10;
    for (int pass = 0; pass < most_passes; ++pass) {
        evaluate(direct_W_m2, diffuse_W_m2);
        // Efficacies that the fit makes absurd (a very low sun) keep the mean one.
        const auto usable = [&](double value) { return value > 1.0 ? value : mean_efficacy; };
        const double new_direct = *weather.direct_normal_lx / usable(light.direct_efficacy_lm_W);
        const double new_diffuse = *weather.diffuse_horizontal_lx / usable(light.diffuse_efficacy_lm_W);
        const bool settled = std::abs(new_direct - direct_W_m2) < 0.1 && std::abs(new_diffuse - diffuse_W_m2) < 0.1;
        direct_W_m2 = new_direct;
        diffuse_W_m2 = new_diffuse;
        if (settled) break;
    }
    evaluate(direct_W_m2, diffuse_W_m2);
    light.direct_normal_lx = *weather.direct_normal_lx;
    light.diffuse_horizontal_lx = *weather.diffuse_horizontal_lx;
    return light;
}

std::unique_ptr<SkyShape> make_perez_sky(const SkyDescription& description, const glm::dvec3& sun) {
    const double sun_zenith_rad = std::acos(std::clamp(sun.z, -1.0, 1.0));
    const PerezLight light = perez_light(description.perez, sun_zenith_rad);
    return std::make_unique<ScaledPerezSky>(PerezSky{perez_coefficients(light.condition, sun_zenith_rad)}, sun,
                                            std::max(0.0, light.diffuse_horizontal_lx),
                                            description.perez.normalise_by_patches);
}

}  // namespace naturel
