#include "core/view.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/units.h"

namespace naturel {
namespace {

using glm::dvec3;

struct DiscPoint {
    double x = 0, y = 0;  ///< to the right and up; 1 on the rim
    double radius() const { return std::sqrt(x * x + y * y); }
};

DiscPoint disc_point(const Camera& camera, double column, double row) {
    return {(2 * column / camera.width - 1) * camera.half_width, (1 - 2 * row / camera.height) * camera.half_height};
}

/// Angle between the axis and what a fisheye shows at a share of the radius of its circle. Past the rim the angle stays.
double angle_from_axis(const Camera& camera, double radius) {
    if (camera.projection == FisheyeProjection::equidistant) return std::min(radius * camera.half_angle_rad, pi);
    return 2 * std::asin(std::min(1.0, radius * std::sin(camera.half_angle_rad / 2)));
}

double radius_at_angle(const Camera& camera, double angle_rad) {
    if (camera.projection == FisheyeProjection::equidistant) return angle_rad / camera.half_angle_rad;
    return std::sin(angle_rad / 2) / std::sin(camera.half_angle_rad / 2);
}

/// Solid angle of the triangle of three directions (Van Oosterom & Strackee 1983).
double triangle_sr(const dvec3& a, const dvec3& b, const dvec3& c) {
    return 2 * std::atan2(std::abs(glm::dot(a, glm::cross(b, c))), 1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
}

}  // namespace

double height_over(const CutPlane& plane, const dvec3& point_m) {
    return glm::dot(plane.normal, point_m - plane.point_m) - cut_slack_m;
}

Camera::Ray Camera::ray(double column, double row) const {
    if (kind == ViewKind::panorama) {
        const double azimuth_rad = (2 * column / width - 1) * pi, altitude_rad = (0.5 - row / height) * pi;
        const dvec3 level = std::cos(azimuth_rad) * forward + std::sin(azimuth_rad) * right;
        return {eye_m, std::cos(altitude_rad) * level + std::sin(altitude_rad) * up};
    }
    const DiscPoint point = disc_point(*this, column, row);
    const dvec3 aside = point.x * right + point.y * up;
    if (kind == ViewKind::parallel) return {eye_m + aside, forward};
    if (kind == ViewKind::perspective) return {eye_m, glm::normalize(forward + aside)};
    const double radius = point.radius(), angle_rad = angle_from_axis(*this, radius);
    if (radius == 0) return {eye_m, forward};
    return {eye_m, std::cos(angle_rad) * forward + std::sin(angle_rad) / radius * aside};
}

bool Camera::shows(double column, double row) const {
    return kind != ViewKind::fisheye || disc_point(*this, column, row).radius() <= 1;
}

std::optional<Camera::Place> Camera::place_of(const dvec3& direction) const {
    const double x = glm::dot(direction, right), y = glm::dot(direction, up), z = glm::dot(direction, forward);
    DiscPoint point;
    switch (kind) {
        case ViewKind::parallel:
            return {};
        case ViewKind::perspective:
            if (z <= 0) return {};
            point = {x / z, y / z};
            break;
        case ViewKind::fisheye: {
            const double aside = std::hypot(x, y), angle_rad = std::atan2(aside, z);
            if (angle_rad > half_angle_rad) return {};
            if (aside > 0) point = {radius_at_angle(*this, angle_rad) * x / aside, radius_at_angle(*this, angle_rad) * y / aside};
            break;
        }
        case ViewKind::panorama: {
            const double altitude_rad = std::atan2(y, std::hypot(x, z));
            return Place{(std::atan2(x, z) / pi + 1) * width / 2, (0.5 - altitude_rad / pi) * height};
        }
    }
    const Place place{(point.x / half_width + 1) * width / 2, (1 - point.y / half_height) * height / 2};
    if (place.column < 0 || place.column > width || place.row < 0 || place.row > height) return {};
    return place;
}

Camera::Reach Camera::reach(const Ray& ray) const {
    Reach reach{.end_m = std::numeric_limits<double>::infinity()};
    for (const CutPlane& plane : cut_planes) {
        const double above_m = height_over(plane, ray.origin_m), slope = glm::dot(plane.normal, ray.direction);
        if (slope > 0) {
            reach.end_m = std::min(reach.end_m, -above_m / slope);
        } else if (above_m > 0) {
            const double begin_m = slope < 0 ? -above_m / slope : std::numeric_limits<double>::infinity();
            if (begin_m > reach.begin_m) reach.begin_m = begin_m, reach.cut = true;
        }
    }
    return reach;
}

Camera make_camera(const View& view) {
    Camera camera{.kind = view.kind,
                  .projection = view.projection,
                  .eye_m = view.from_m,
                  .width = view.width,
                  .height = view.height,
                  .cut_planes = view.cut_planes,
                  .see_through = view.see_through};
    camera.forward = glm::normalize(view.to_m - view.from_m);
    dvec3 right = glm::cross(camera.forward, glm::normalize(view.up));
    // Looking straight along `up`, a picture has no top of its own: north is up then, or x where that is
    // north.
    if (glm::length(right) < 1e-9) right = glm::cross(camera.forward, dvec3(0, 1, 0));
    if (glm::length(right) < 1e-9) right = glm::cross(camera.forward, dvec3(1, 0, 0));
    camera.right = glm::normalize(right);
    camera.up = glm::cross(camera.right, camera.forward);
    switch (view.kind) {
        case ViewKind::parallel:
            camera.half_width = view.width_m / 2;
            break;
        case ViewKind::perspective:
            camera.half_width = std::tan(view.field_of_view_rad / 2);
            break;
        case ViewKind::fisheye:  // the circle fills the shorter side
            camera.half_angle_rad = view.field_of_view_rad / 2;
            camera.half_width = std::max(1.0, static_cast<double>(view.width) / view.height);
            break;
        case ViewKind::panorama:  // stands upright
            camera.up = glm::normalize(view.up);
            camera.forward = glm::cross(camera.up, camera.right);
            break;
    }
    camera.half_height = camera.half_width * view.height / view.width;
    return camera;
}

Camera with_samples(Camera camera, int samples) {
    camera.width *= samples;
    camera.height *= samples;
    return camera;
}

double pixel_solid_angle_sr(const Camera& camera, int column, int row) {
    switch (camera.kind) {
        case ViewKind::parallel:
            return 0;
        case ViewKind::perspective: {
            const auto corner = [&](int right, int down) { return camera.ray(column + right, row + down).direction; };
            const dvec3 a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
            return triangle_sr(a, b, c) + triangle_sr(a, c, d);
        }
        case ViewKind::fisheye: {
            const double area = 4 * camera.half_width * camera.half_height / camera.width / camera.height;
            const double s = std::sin(camera.half_angle_rad / 2);
            if (camera.projection == FisheyeProjection::equal_area) return 4 * s * s * area;
            const double radius = disc_point(camera, column + 0.5, row + 0.5).radius();
            const double angle_rad = angle_from_axis(camera, radius);
            const double stretch = radius > 0 ? std::sin(angle_rad) / radius : camera.half_angle_rad;
            return camera.half_angle_rad * stretch * area;
        }
        case ViewKind::panorama:
            return 2 * pi / camera.width *
                   (std::sin((0.5 - static_cast<double>(row) / camera.height) * pi) -
                    std::sin((0.5 - static_cast<double>(row + 1) / camera.height) * pi));
    }
    return 0;
}

}  // namespace naturel
