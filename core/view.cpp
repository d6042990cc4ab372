#include "core/view.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {

Camera::Ray Camera::ray(double column, double row) const {
    const double x = (2 * column / width - 1) * half_width;
    const double y = (1 - 2 * row / height) * half_height;
    const glm::dvec3 aside = x * right + y * up;
    if (kind == ViewKind::parallel) return {eye_m + aside, forward};
    return {eye_m, glm::normalize(forward + aside)};
}

Camera make_camera(const View& view) {
    Camera camera{.kind = view.kind, .eye_m = view.from_m, .width = view.width, .height = view.height};
    camera.forward = glm::normalize(view.to_m - view.from_m);
    glm::dvec3 right = glm::cross(camera.forward, glm::normalize(view.up));
    // Looking straight along `up`, a picture has no top of its own: north is up then, or x where that is
    // north.
    if (glm::length(right) < 1e-9) right = glm::cross(camera.forward, glm::dvec3(0, 1, 0));
    if (glm::length(right) < 1e-9) right = glm::cross(camera.forward, glm::dvec3(1, 0, 0));
    camera.right = glm::normalize(right);
    camera.up = glm::cross(camera.right, camera.forward);
    camera.half_width = view.kind == ViewKind::parallel ? view.width_m / 2 : std::tan(view.field_of_view_rad / 2);
    camera.half_height = camera.half_width * view.height / view.width;
    return camera;
}

}  // namespace naturel
