#include "core/view.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/catch.h"

namespace naturel {
namespace {

constexpr double rounding = 1e-14;

double gap(const glm::dvec3& a, const glm::dvec3& b) {
    return glm::distance(a, b);
}

TEST_CASE("a camera's axes are orthonormal, right x up = -forward", "[view]") {
    const View view{.id = "", .from_m = {1, 2, 3}, .to_m = {-4, 0.5, 2}, .up = {0.1, 0.2, 2}};
    const Camera camera = make_camera(view);
    CHECK(gap(glm::cross(camera.right, camera.up), -camera.forward) < rounding);
    CHECK(std::abs(glm::dot(camera.right, camera.forward)) < rounding);
    CHECK(std::abs(glm::length(camera.right) - 1) < rounding);
    CHECK(glm::dot(camera.up, view.up) > 0);
}

TEST_CASE("the middle of a picture looks at the target, its edges are half the field of view away",
          "[view]") {
    const View view{.id = "",
                    .from_m = {0, 0, 1},
                    .to_m = {0, 5, 1},
                    .field_of_view_rad = 1.0,
                    .width = 300,
                    .height = 200};
    const Camera camera = make_camera(view);
    CHECK(gap(camera.ray(150, 100).direction, {0, 1, 0}) < rounding);
    CHECK(gap(camera.ray(300, 100).direction, {std::sin(0.5), std::cos(0.5), 0}) < rounding);
    CHECK(gap(camera.ray(0, 100).direction, {-std::sin(0.5), std::cos(0.5), 0}) < rounding);
    // Square pixels: the top lies 200 / 300 as far from the middle as the side. Row 0 is the top.
    const double height = std::tan(0.5) * 200 / 300;
    CHECK(gap(camera.ray(150, 0).direction, glm::normalize(glm::dvec3(0, 1, height))) < rounding);
}

TEST_CASE("rays of a parallel view leave a rectangle of the given width, all in one direction", "[view]") {
    const View view{.id = "",
                    .kind = ViewKind::parallel,
                    .from_m = {1, 2, 3},
                    .to_m = {1, 7, 3},
                    .width_m = 6,
                    .width = 300,
                    .height = 200};
    const Camera camera = make_camera(view);
    CHECK(gap(camera.ray(150, 100).origin_m, view.from_m) < rounding);
    CHECK(gap(camera.ray(0, 0).origin_m, {-2, 2, 5}) < rounding);  // square pixels: 4 m high
    CHECK(gap(camera.ray(300, 200).origin_m, {4, 2, 1}) < rounding);
    for (const double column : {0.5, 77.0, 300.0}) CHECK(gap(camera.ray(column, 3).direction, {0, 1, 0}) < rounding);
}

TEST_CASE("rays of a perspective view leave the eye", "[view]") {
    const Camera camera = make_camera({.id = "", .from_m = {1, 2, 3}, .to_m = {1, 7, 3}, .width_m = 6});
    CHECK(camera.ray(3, 400).origin_m == glm::dvec3(1, 2, 3));
}

TEST_CASE("a camera that looks straight down has north at the top", "[view]") {
    const Camera camera = make_camera({.id = "", .from_m = {0, 0, 3}, .to_m = {0, 0, 0}});
    CHECK(gap(camera.up, {0, 1, 0}) < rounding);
    CHECK(gap(camera.right, {1, 0, 0}) < rounding);
}

TEST_CASE("a camera that looks along its own up direction still has axes", "[view]") {
    const Camera camera = make_camera({.id = "", .from_m = {0, 0, 0}, .to_m = {0, 1, 0}, .up = {0, 1, 0}});
    CHECK(gap(glm::cross(camera.right, camera.up), -camera.forward) < rounding);
}

}  // namespace
}  // namespace naturel
