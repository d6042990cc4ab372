#pragma once
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "core/scene.h"
#include "core/sky_shape.h"
#include "core/units.h"

namespace naturel {

/// A sky: luminance as a function of direction, of D65 colour (its Band3 is grey).
/// Frame: x east, y north, z up - the frame of the model; rotation is the reader's business.
/// Each model is a file: core/sky_shape.h lists them, core/sky_models.h names them. Cheap to copy.
class Sky {
public:
    /// sun_direction: unit, from the ground towards the sun.
    /// Throws nothing: the description has been checked by the reader.
    Sky(const SkyDescription& description, const glm::dvec3& sun_direction);

    /// direction: unit; below the horizon (z < 0) the answer is 0.
    Luminance luminance(const glm::dvec3& direction) const {
        return {direction.z < 0.0 ? 0.0 : scale_ * shape_->luminance(direction)};
    }
    /// False if the luminance jumps, as in a table of patches.
    bool is_smooth() const { return shape_->is_smooth(); }
    Luminance zenith_luminance() const { return zenith_luminance_; }

    /// Diffuse illuminance of an unobstructed horizontal plane, the sun excluded.
    Illuminance horizontal_illuminance() const { return horizontal_illuminance_; }

    /// Diffuse illuminance of an unobstructed plane from the sky alone. normal: unit.
    /// Gauss-Legendre in the plane's own polar coordinates, 96 x 2 x 192 nodes: within 1e-5 for
    /// a sky without a sharp peak, 5e-5 for the clearest of Perez' (the cusp at the sun).
    Illuminance plane_illuminance(const glm::dvec3& normal) const;

private:
    std::shared_ptr<const SkyShape> shape_;
    double scale_ = 0.0;
    Luminance zenith_luminance_;
    Illuminance horizontal_illuminance_;
};

}  // namespace naturel
