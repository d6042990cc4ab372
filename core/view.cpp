#include "core/view.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {

glm::dvec3 Camera::direction(double column, double row) const {
    const double x = (2 * column / width - 1) * half_width;
    const double y = (1 - 2 * row / height) * half_height;
    return glm::normalize(forward + x * right + y * up);
}

Camera make_camera(const View& view) {
    Camera camera{.eye_m = view.from_m, .width = view.width, .height = view.height};
    camera.forward = glm::normalize(view.to_m - view.from_m);
    glm::dvec3 right = glm::cross(camera.forward, glm::normalize(view.up));
    // Looking straight along `up`, a picture has no top of its own: north is up then, or x where that is
    // north.
    if (glm::length(right) < 1e-9) right = glm::cross(camera.forward, glm::dvec3(0, 1, 0));
    if (glm::length(right) < 1e-9) right = glm::cross(camera.forward, glm::dvec3(1, 0, 0));
    camera.right = glm::normalize(right);
    camera.up = glm::cross(camera.right, camera.forward);
    camera.half_width = std::tan(view.field_of_view_rad / 2);
    camera.half_height = camera.half_width * view.height / view.width;
    return camera;
}

}  // namespace naturel
