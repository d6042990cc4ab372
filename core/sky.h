#pragma once
#include <glm/vec3.hpp>

#include "core/scene.h"
#include "core/units.h"

namespace naturel {

/// A sky: luminance as a function of direction, of D65 colour (its Band3 is grey).
/// Frame: x east, y north, z up - the frame of the model; rotation is the reader's business.
class Sky {
public:
    /// sun_direction: unit, from the ground towards the sun; only the clear skies look at it.
    /// Throws nothing: the description has been checked by the reader.
    Sky(const SkyDescription& description, const glm::dvec3& sun_direction);

    /// direction: unit; below the horizon (z < 0) the answer is 0.
    Luminance luminance(const glm::dvec3& direction) const;
    Luminance zenith_luminance() const { return zenith_luminance_; }

    /// Diffuse illuminance of an unobstructed horizontal plane, the sun excluded.
    Illuminance horizontal_illuminance() const { return horizontal_illuminance_; }

private:
    double relative_luminance(const glm::dvec3& direction) const;  // luminance / zenith luminance

    /// Scattering of the clear skies, A + B exp(-3 chi) + C cos^2 chi at the angle chi from the sun, divided
    /// by what makes the relative luminance 1 at the zenith.
    struct Indicatrix {
        double a = 0.0, b = 0.0, c = 0.0;
    };
    double clear_relative_luminance(double sin_altitude, double cos_from_sun) const;
    double clear_horizontal_per_zenith() const;

    SkyModel model_;
    glm::dvec3 sun_direction_;
    Indicatrix indicatrix_;
    Luminance zenith_luminance_;
    Illuminance horizontal_illuminance_;
};

}  // namespace naturel
