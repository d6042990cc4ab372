#pragma once
#include <glm/vec3.hpp>

#include "core/scene.h"

namespace naturel {

/// The pinhole camera of a perspective view.
struct Camera {
    glm::dvec3 eye_m{};
    glm::dvec3 right{}, up{}, forward{};   ///< orthonormal, right x up = -forward
    double half_width = 0, half_height = 0;  ///< of the picture at distance 1
    int width = 0, height = 0;               ///< pixels

    /// Unit direction through a point of the picture, in pixels from the top left corner; centres end in .5.
    glm::dvec3 direction(double column, double row) const;
};

Camera make_camera(const View& view);

}  // namespace naturel
