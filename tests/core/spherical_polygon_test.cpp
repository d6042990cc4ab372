#include "core/spherical_polygon.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/units.h"
#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Counter-clockwise for a point at the origin that looks up at it; one corner straight above.
std::array<glm::dvec3, 4> rectangle_above(double a, double b, double height) {
    return {glm::dvec3{0, 0, height}, {0, b, height}, {a, b, height}, {a, 0, height}};
}

}  // namespace

TEST_CASE("a corner of a rectangle has the solid angle atan(a b / (d sqrt(a2 + b2 + d2)))", "[direct][analytic]") {
    const double a = GENERATE(1e-4, 0.3, 5.0), b = GENERATE(1e-3, 1.0), d = GENERATE(1e-3, 1.0, 7.0);
    CAPTURE(a, b, d);
    const double expected = std::atan(a * b / (d * std::sqrt(a * a + b * b + d * d)));
    // Both sides cancel digits in proportion to 1 / size: the smallest is 1e-8 sr.
    CHECK_THAT(solid_angle(rectangle_above(a, b, d)), WithinRel(expected, 1e-7));
}

TEST_CASE("the vector solid angle of a rectangle is its closed form at every size", "[direct][analytic]") {
    const double a = GENERATE(1e-5, 0.3, 50.0), d = GENERATE(1e-3, 1.0, 7.0), b = 0.7 * a;
    CAPTURE(a, b, d);
    const double p = a / d, q = b / d, root_p = std::sqrt(1 + p * p), root_q = std::sqrt(1 + q * q);
    const double projected = 0.5 * (p / root_p * std::atan(q / root_p) + q / root_q * std::atan(p / root_q));
    const glm::dvec3 found = vector_solid_angle(rectangle_above(a, b, d));
    // A polygon of angular size e is the sum of edges of size e that cancel down to e^2: 1e-16 / 1e-6 are lost.
    CHECK_THAT(found.z, WithinRel(projected, 1e-9));
    CHECK_THAT(found.x, WithinAbs(0.5 * (std::atan(q) - std::atan(q / root_p) / root_p), 1e-9 * projected));
}

TEST_CASE("lengths of the vectors do not change what is seen", "[direct][property]") {
    std::array<glm::dvec3, 4> polygon = rectangle_above(1.0, 2.0, 1.5);
    const double before = solid_angle(polygon);
    const glm::dvec3 vector_before = vector_solid_angle(polygon);
    for (std::size_t k = 0; k < polygon.size(); ++k) polygon[k] *= 0.1 + static_cast<double>(k);
    CHECK_THAT(solid_angle(polygon), WithinRel(before, 1e-14));  // rounding
    CHECK_THAT(glm::length(vector_solid_angle(polygon) - vector_before), WithinAbs(0.0, 1e-15));
}

TEST_CASE("the two halves of a cut polygon add up to the whole", "[direct][property]") {
    const std::array<glm::dvec3, 4> polygon = rectangle_above(1.0, 2.0, 1.5);
    const glm::dvec3 normal = glm::normalize(glm::dvec3{0.6, -0.3, GENERATE(-1.0, 0.0, 0.1, 1.0)});
    std::vector<glm::dvec3> above, below;
    keep_half_space(polygon, normal, above);
    keep_half_space(polygon, -normal, below);
    CHECK_THAT(solid_angle(above) + solid_angle(below), WithinRel(solid_angle(polygon), 1e-13));
    for (const glm::dvec3& vertex : above) CHECK(glm::dot(vertex, normal) >= -1e-15);
}
