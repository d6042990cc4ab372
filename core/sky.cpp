#include "core/sky.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/gauss_legendre.h"
#include "core/sky_levels.h"
#include "core/sky_models.h"
#include "core/sun.h"

namespace naturel {
namespace {

constexpr glm::dvec3 zenith{0.0, 0.0, 1.0};

/// Keeps the sun a little off the zenith where the description asks for it.
glm::dvec3 limited(const glm::dvec3& sun, double highest_rad) {
    if (std::asin(std::clamp(sun.z, -1.0, 1.0)) <= highest_rad) return sun;
    return direction_from_angles(highest_rad, std::atan2(sun.x, sun.y));
}

}  // namespace

Sky::Sky(const SkyDescription& description, const glm::dvec3& sun_direction) {
    const glm::dvec3 sun = limited(sun_direction, description.highest_sun_rad);
    shape_ = sky_model(description).make(description, sun);
    const double at_zenith = shape_->luminance(zenith), on_ground = shape_->horizontal();
    const auto ratio = [](double asked, double has) { return asked > 0.0 && has > 0.0 ? asked / has : 0.0; };

    std::optional<double> zenith_cd_m2 = description.zenith_luminance_cd_m2;
    if (!zenith_cd_m2 && !description.horizontal_illuminance_lx)
        zenith_cd_m2 = formula_zenith_luminance_cd_m2(description, std::asin(std::clamp(sun_direction.z, 0.0, 1.0)));
    if (zenith_cd_m2) {
        scale_ = ratio(*zenith_cd_m2, at_zenith);
        zenith_luminance_ = {*zenith_cd_m2};
        horizontal_illuminance_ = {scale_ * on_ground};
    } else if (description.horizontal_illuminance_lx) {
        scale_ = ratio(*description.horizontal_illuminance_lx, on_ground);
        zenith_luminance_ = {scale_ * at_zenith};
        horizontal_illuminance_ = {*description.horizontal_illuminance_lx};
    } else {
        scale_ = 1.0;  // cd/m2 already
        zenith_luminance_ = {at_zenith};
        horizontal_illuminance_ = {on_ground};
    }
}

Illuminance Sky::plane_illuminance(const glm::dvec3& normal) const {
    static const QuadratureRule rule = gauss_legendre(96);
    // World polar coordinates: bands of altitude, in each the arc that faces the plane.
    const double level_part = std::hypot(normal.x, normal.y);
    const double normal_azimuth = std::atan2(normal.x, normal.y);
    double sum = 0.0;
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
        const double t = rule.nodes[i];
        const double h = 0.5 * pi * t * t * (3.0 - 2.0 * t);
        const double dh = 0.5 * pi * 6.0 * t * (1.0 - t) * rule.weights[i];
        // cos(incidence) = level + swing cos(azimuth - normal's azimuth)
        const double level = std::sin(h) * normal.z, swing = std::cos(h) * level_part;
        if (level <= -swing) continue;
        const double half_arc = level >= swing ? pi : std::acos(-level / swing);
        double arc_sum = 0.0;
        for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
            for (const double side : {-1.0, 1.0}) {
                const double turn = side * half_arc * rule.nodes[k];
                const double cosine = level + swing * std::cos(turn);
                arc_sum += rule.weights[k] * cosine *
                           luminance(direction_from_angles(h, normal_azimuth + turn)).value;
            }
        }
        sum += dh * std::cos(h) * half_arc * arc_sum;
    }
    return {sum};
}

}  // namespace naturel
