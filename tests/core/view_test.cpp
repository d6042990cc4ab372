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
    CHECK(gap(camera.direction(150, 100), {0, 1, 0}) < rounding);
    CHECK(gap(camera.direction(300, 100), {std::sin(0.5), std::cos(0.5), 0}) < rounding);
    CHECK(gap(camera.direction(0, 100), {-std::sin(0.5), std::cos(0.5), 0}) < rounding);
    // Square pixels: the top lies 200 / 300 as far from the middle as the side. Row 0 is the top.
    const double height = std::tan(0.5) * 200 / 300;
    CHECK(gap(camera.direction(150, 0), glm::normalize(glm::dvec3(0, 1, height))) < rounding);
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
