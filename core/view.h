#pragma once
#include <glm/vec3.hpp>

#include "core/scene.h"

namespace naturel {

/// The camera of a view: where the ray of each pixel starts and where it goes.
struct Camera {
    ViewKind kind = ViewKind::perspective;
    glm::dvec3 eye_m{};
    glm::dvec3 right{}, up{}, forward{};     ///< orthonormal, right x up = -forward
    double half_width = 0, half_height = 0;  ///< of the picture: perspective: at distance 1; parallel: in metres
    int width = 0, height = 0;               ///< pixels

    struct Ray {
        glm::dvec3 origin_m{};
        glm::dvec3 direction{};  ///< unit length
    };
    /// Through a point of the picture, in pixels from the top left corner; centres end in .5.
    Ray ray(double column, double row) const;
};

Camera make_camera(const View& view);

}  // namespace naturel
