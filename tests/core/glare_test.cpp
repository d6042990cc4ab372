#include "core/glare.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/catch.h"

using namespace naturel;
using glm::dvec3;

namespace {

const dvec3 ahead{0, 1, 0}, up{0, 0, 1};

/// At an angle from the line of sight, towards an angle from the vertical, both in degrees.
dvec3 aside(double sigma_deg, double tau_deg) {
    const double sigma = radians_from_degrees(sigma_deg), tau = radians_from_degrees(tau_deg);
    return {std::sin(sigma) * std::sin(tau), std::cos(sigma), std::sin(sigma) * std::cos(tau)};
}

Camera eye(int size, FisheyeProjection projection) {
    return make_camera({.kind = ViewKind::fisheye, .projection = projection, .from_m = {0, 0, 1.2}, .to_m = {0, 1, 1.2},
                        .field_of_view_rad = pi, .width = size, .height = size});
}

std::vector<double> picture_of(const Camera& camera, const auto& luminance_cd_m2) {
    std::vector<double> picture;
    for (int row = 0; row < camera.height; ++row)
        for (int column = 0; column < camera.width; ++column)
            picture.push_back(camera.shows(column + 0.5, row + 0.5) ? luminance_cd_m2(camera.ray(column + 0.5, row + 0.5).direction) : 0.0);
    return picture;
}

}  // namespace

TEST_CASE("position indices are those computed by hand", "[core][glare][analytic]") {
    CHECK(std::abs(position_index(ahead, ahead, up) - 1.0) < 1e-12);
    // Straight up: exp((35.2 - 1.22) 0.03 + 21e-5 900) and so on.
    CHECK(std::abs(position_index(aside(30, 0), ahead, up) - std::exp(1.0194 + 0.189)) < 1e-9);
    CHECK(std::abs(position_index(aside(10, 0), ahead, up) - std::exp(0.3398 + 0.021)) < 1e-9);
    // 45 degrees aside: (35.2 - 14.35005 - 1.22 exp(-10)) 0.03 + (21 + 12.00015 - 6.000075) 900e-5.
    CHECK(std::abs(position_index(aside(30, 45), ahead, up) - std::exp((20.84995 - 1.22 * std::exp(-10.0)) * 0.03 + 27.000075 * 0.009)) < 1e-9);
    CHECK(std::abs(position_index(aside(50, 0), ahead, up) - std::exp(33.98 * 0.05 + 0.525)) < 1e-8);
    CHECK(position_index(aside(89, 0), ahead, up) == 16.0);  // exp(4.69) is cut
    // Below the line of sight distances on a plane count: tan 30 and tan 45 degrees.
    CHECK(std::abs(position_index(aside(30, 180), ahead, up) - (1.0 + 0.8 * std::tan(pi / 6))) < 1e-12);
    CHECK(std::abs(position_index(aside(45, 180), ahead, up) - 2.2) < 1e-12);
    CHECK(std::abs(position_index(aside(89, 170), ahead, up) - (1.0 + 1.2 * 3.0)) < 1e-12);
    for (const double tau : {20.0, 70.0, 130.0})
        CHECK(std::abs(position_index(aside(40, tau), ahead, up) - position_index(aside(40, -tau), ahead, up)) < 1e-12);
}

TEST_CASE("the simplified probability is its line", "[core][glare][analytic]") {
    CHECK(std::abs(simplified_glare_probability({0.0}) - 0.184) < 1e-15);
    CHECK(std::abs(simplified_glare_probability({2500.0}) - 0.3395) < 1e-12);
    CHECK(simplified_glare_probability({60000.0}) == 1.0);  // a line passes 1, a probability does not
}

TEST_CASE("a uniform hemisphere is one source whose probability has a closed form", "[core][glare][analytic]") {
    const auto projection = GENERATE(FisheyeProjection::equidistant, FisheyeProjection::equal_area);
    const Camera camera = eye(200, projection);
    constexpr double luminance = 2500.0;
    const auto picture = picture_of(camera, [](const dvec3&) { return luminance; });
    const Illuminance at_eye = illuminance_of_picture(picture, camera);
    // The circle's rim is a staircase of pixels; there the cosine is small.
    CHECK(std::abs(at_eye.value / (pi * luminance) - 1.0) < 1e-3);
    const auto sources = find_glare_sources(picture, camera, glare_threshold, glare_peak);
    REQUIRE(sources.size() == 1);
    CHECK(std::abs(sources[0].solid_angle_sr / (2.0 * pi) - 1.0) < 2e-3);  // staircase
    CHECK(std::abs(sources[0].luminance_cd_m2 / luminance - 1.0) < 1e-12);
    CHECK(glm::distance(sources[0].direction, ahead) < 1e-9);
    const double vertical_lx = pi * luminance;
    const double closed = 5.87e-5 * vertical_lx + 0.0918 * std::log10(1.0 + luminance * luminance * 2.0 * pi / std::pow(vertical_lx, 1.87)) + 0.16;
    CHECK(std::abs(glare_probability(at_eye, sources) - closed) < 1e-3);
}

TEST_CASE("bright discs are sources of their own, and the sun within one, too", "[core][glare][analytic]") {
    const Camera camera = eye(512, FisheyeProjection::equal_area);
    const dvec3 lamp = aside(30, 0), sky = aside(35, 90), sun = aside(35, 100);
    const auto within = [](const dvec3& a, const dvec3& b, double degrees) { return glm::dot(a, b) > std::cos(radians_from_degrees(degrees)); };
    const auto picture = picture_of(camera, [&](const dvec3& direction) {
        if (within(direction, sun, 2)) return 1e6;
        if (within(direction, sky, 15)) return 8000.0;
        return within(direction, lamp, 6) ? 5000.0 : 100.0;
    });
    auto sources = find_glare_sources(picture, camera, glare_threshold, glare_peak);
    REQUIRE(sources.size() == 3);
    std::ranges::sort(sources, {}, &GlareSource::luminance_cd_m2);
    const auto cap_sr = [](double degrees) { return 2.0 * pi * (1.0 - std::cos(radians_from_degrees(degrees))); };
    // Pixels of 0.4 degrees: the outline of a disc of 2 degrees takes a tenth of it, half of which is noise.
    CHECK(std::abs(sources[0].solid_angle_sr / cap_sr(6) - 1.0) < 0.02);
    CHECK(std::abs(sources[1].solid_angle_sr / (cap_sr(15) - cap_sr(2)) - 1.0) < 0.02);
    CHECK(std::abs(sources[2].solid_angle_sr / cap_sr(2) - 1.0) < 0.05);
    CHECK(glm::distance(sources[0].direction, lamp) < 0.005);
    CHECK(std::abs(sources[0].position_index / position_index(lamp, ahead, up) - 1.0) < 0.02);
    // By hand: one source of 5000 cd/m2, 0.0344 sr at P = 3.348 and 1000 lx.
    const GlareSource one{lamp, 0.0344, 5000.0, 3.348};
    CHECK(std::abs(glare_probability({1000.0}, {&one, 1}) - (0.0587 + 0.0918 * std::log10(1.0 + 25e6 * 0.0344 / (407380.3 * 11.209104)) + 0.16)) < 1e-6);
    CHECK(find_glare_sources(picture, camera, Luminance{1e7}, glare_peak).empty());
    CHECK(glare_probability({0.0}, {}) == 0.0);
    CHECK(glare_probability({1e6}, {}) == 1.0);
}
