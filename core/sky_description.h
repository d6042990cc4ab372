#pragma once
#include <memory>
#include <optional>
#include <string>

#include "core/light_colour.h"
#include "core/units.h"

namespace naturel {

class SkyTable;

/// Names, summaries and formulas: core/sky_models.h.
enum class SkyModel {
    uniform,
    moon_spencer,
    cie_clear,
    cie_clear_polluted,
    intermediate,
    cie_general,
    perez,
    table,
    expression,
};

/// What Perez's all-weather sky is made from: two irradiances, or two illuminances when both of these are given.
struct PerezWeather {
    double direct_normal_W_m2 = 0.0;
    double diffuse_horizontal_W_m2 = 0.0;
    std::optional<double> direct_normal_lx{};
    std::optional<double> diffuse_horizontal_lx{};
    double dew_point_c = 11.0;  ///< Radiance's default
    double eccentricity = 1.0;  ///< E0: square of mean over actual distance of the sun
    bool normalise_by_patches = false;  ///< Radiance's sum over 145 patches instead of the integral
};

/// The sky as the scene asks for it: a model, and at most one of the two levels. With neither, the level follows from a formula
/// (docs/method.md, "Levels"), from the weather, or from the values of a table or an expression, which are cd/m2 then.
struct SkyDescription {
    SkyModel model = SkyModel::moon_spencer;
    std::optional<double> zenith_luminance_cd_m2{};
    std::optional<double> horizontal_illuminance_lx{};  ///< diffuse, unobstructed, without the sun
    LightColour colour{};
    int cie_type = 1;                                   ///< of cie_general: 1 to 16
    std::optional<double> turbidity{};                  ///< of the level's formula; default: the model's
    double highest_sun_rad = 0.5 * pi;  ///< where the sky's own sun stops on its way to the zenith (Radiance: 87 degrees)
    double north_rad = 0.0;             ///< azimuth of the model's +y axis: tables and expressions speak of true north
    PerezWeather perez{};
    std::shared_ptr<const SkyTable> table{};
    std::string expression{};
};

}  // namespace naturel
