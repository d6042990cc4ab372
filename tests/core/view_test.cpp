#include "core/view.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "core/units.h"
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

/// Looks north, tilted and turned a little.
View view_of(ViewKind kind, FisheyeProjection projection = FisheyeProjection::equidistant) {
    return {.id = "", .kind = kind, .projection = projection, .from_m = {1, 2, 3}, .to_m = {1.4, 7, 3.7}, .field_of_view_rad = pi,
            .width_m = 6, .width = 90, .height = kind == ViewKind::panorama ? 45 : 80};
}

TEST_CASE("a fisheye shows what is at an angle from its axis at the radius of its projection", "[view]") {
    View view{.id = "", .kind = ViewKind::fisheye, .from_m = {0, 0, 1}, .to_m = {0, 5, 1}, .field_of_view_rad = pi, .width = 200, .height = 200};
    const Camera equidistant = make_camera(view);
    CHECK(gap(equidistant.ray(100, 100).direction, {0, 1, 0}) < rounding);
    CHECK(gap(equidistant.ray(200, 100).direction, {1, 0, 0}) < rounding);  // right is right, seen from the eye
    CHECK(gap(equidistant.ray(100, 0).direction, {0, 0, 1}) < rounding);
    CHECK(gap(equidistant.ray(150, 100).direction, {std::sqrt(0.5), std::sqrt(0.5), 0}) < rounding);
    view.projection = FisheyeProjection::equal_area;
    const Camera equal_area = make_camera(view);
    CHECK(gap(equal_area.ray(200, 100).direction, {1, 0, 0}) < rounding);
    // 60 degrees from the axis is half of the hemisphere, so half of the area of the circle.
    CHECK(gap(equal_area.ray(100 + 100 * std::sqrt(0.5), 100).direction, {std::sqrt(0.75), 0.5, 0}) < rounding);
    for (const Camera& camera : {equidistant, equal_area}) {
        CHECK(camera.shows(199.9, 100));
        CHECK_FALSE(camera.shows(180, 180));
    }
}

TEST_CASE("a fisheye towards the zenith has north at the top and east at the left", "[view]") {
    const Camera camera = make_camera({.id = "", .kind = ViewKind::fisheye, .from_m = {0, 0, 0}, .to_m = {0, 0, 1}, .up = {0, 1, 0},
                                       .field_of_view_rad = pi, .width = 100, .height = 100});
    CHECK(gap(camera.ray(50, 0).direction, {0, 1, 0}) < rounding);
    CHECK(gap(camera.ray(0, 50).direction, {1, 0, 0}) < rounding);
}

TEST_CASE("a panorama stands upright with its target's azimuth in the middle", "[view]") {
    const Camera camera = make_camera({.id = "", .kind = ViewKind::panorama, .from_m = {0, 0, 1}, .to_m = {0, 5, 3}, .width = 360, .height = 180});
    CHECK(gap(camera.ray(180, 90).direction, {0, 1, 0}) < rounding);
    CHECK(gap(camera.ray(270, 90).direction, {1, 0, 0}) < rounding);
    CHECK(gap(camera.ray(0, 90).direction, {0, -1, 0}) < rounding);
    CHECK(gap(camera.ray(180, 0).direction, {0, 0, 1}) < rounding);
    CHECK(gap(camera.ray(180, 60).direction, {0, std::sqrt(0.75), 0.5}) < rounding);
}

TEST_CASE("a direction is shown where the ray in that direction goes", "[view]") {
    for (const View& view : {view_of(ViewKind::perspective), view_of(ViewKind::fisheye), view_of(ViewKind::panorama),
                             view_of(ViewKind::fisheye, FisheyeProjection::equal_area)}) {
        View narrow = view;
        if (view.kind == ViewKind::perspective) narrow.field_of_view_rad = 1.3;
        const Camera camera = make_camera(narrow);
        for (int row = 0; row < camera.height; row += 7) {
            for (int column = 0; column < camera.width; column += 7) {
                if (!camera.shows(column + 0.5, row + 0.5)) continue;
                const auto place = camera.place_of(camera.ray(column + 0.5, row + 0.5).direction);
                REQUIRE(place);
                CHECK(std::abs(place->column - column - 0.5) < 1e-9);
                CHECK(std::abs(place->row - row - 0.5) < 1e-9);
            }
        }
    }
    CHECK_FALSE(make_camera(view_of(ViewKind::fisheye)).place_of({0, -1, 0}));
    CHECK_FALSE(make_camera(view_of(ViewKind::parallel)).place_of({0, 1, 0}));
}

TEST_CASE("the solid angles of the pixels of a picture add up to what it shows", "[view][analytic]") {
    const auto sum_sr = [](const View& view) {
        const Camera camera = make_camera(view);
        double sum = 0;
        for (int row = 0; row < camera.height; ++row)
            for (int column = 0; column < camera.width; ++column)
                if (camera.shows(column + 0.5, row + 0.5)) sum += pixel_solid_angle_sr(camera, column, row);
        return sum;
    };
    CHECK(std::abs(sum_sr(view_of(ViewKind::panorama)) - 4 * pi) < 1e-12);
    // Pixels at the rim of a circle of 80 are in or out as their centres: its area is right to the -3/2 power of that.
    CHECK(std::abs(sum_sr(view_of(ViewKind::fisheye)) / (2 * pi) - 1) < 2e-3);
    CHECK(std::abs(sum_sr(view_of(ViewKind::fisheye, FisheyeProjection::equal_area)) / (2 * pi) - 1) < 2e-3);
    View square = view_of(ViewKind::perspective);
    square.field_of_view_rad = pi / 2, square.width = square.height;
    CHECK(std::abs(sum_sr(square) - 4 * pi / 6) < 1e-12);  // a face of a cube
    CHECK(sum_sr(view_of(ViewKind::parallel)) == 0);
}

TEST_CASE("cut planes leave the part of a ray that is behind all of them", "[view]") {
    Camera camera = make_camera(view_of(ViewKind::perspective));
    const Camera::Ray down{{0, 0, 5}, {0, 0, -1}}, up{{0, 0, 1}, {0, 0, 1}}, level{{0, 0, 3}, {1, 0, 0}};
    CHECK(camera.reach(down).begin_m == 0);
    CHECK_FALSE(camera.reach(down).cut);
    camera.cut_planes = {{{0, 0, 2}, {0, 0, 1}}};
    CHECK(std::abs(camera.reach(down).begin_m - 3 + cut_slack_m) < rounding);
    CHECK(camera.reach(down).cut);
    CHECK(std::abs(camera.reach(up).end_m - 1 - cut_slack_m) < rounding);
    CHECK_FALSE(camera.reach(up).cut);
    CHECK(camera.reach(level).empty());
    camera.cut_planes.push_back({{0, 0, 2.5}, {0, 0, -1}});
    CHECK(camera.reach(down).empty());
}

}  // namespace
}  // namespace naturel
