#include "tests/reference/exact_form_factors.h"

#include <glm/geometric.hpp>
#include <vector>

#include "tests/catch.h"

using namespace naturel;
using namespace naturel::reference;
using Catch::Matchers::WithinAbs;

namespace {
constexpr double printed = 1e-9;  // digits of the tabulated values, and of the quadrature

std::vector<glm::dvec3> horizontal(Interval x, Interval y, double z, bool facing_up) {
    std::vector<glm::dvec3> v{{x.low, y.low, z}, {x.high, y.low, z}, {x.high, y.high, z}, {x.low, y.high, z}};
    if (!facing_up) std::swap(v[1], v[3]);
    return v;
}

/// In the plane x = 0, facing +x.
std::vector<glm::dvec3> upright(Interval y, Interval z) {
    return {{0, y.low, z.low}, {0, y.high, z.low}, {0, y.high, z.high}, {0, y.low, z.high}};
}
}  // namespace

TEST_CASE("the faces of a cube have their known form factors", "[form_factors][reference]") {
    const Interval unit{0, 1};
    CHECK_THAT(parallel_rectangles(unit, unit, unit, unit, 1.0), WithinAbs(cube_opposed, printed));
    CHECK_THAT(perpendicular_rectangles(unit, unit, unit, unit), WithinAbs(cube_adjacent, printed));
    CHECK_THAT(cube_opposed + 4 * cube_adjacent, WithinAbs(1.0, 5 * printed));
    CHECK_THAT(polygon_to_polygon(horizontal(unit, unit, 0, true), horizontal(unit, unit, 1, false)),
               WithinAbs(cube_opposed, printed));
    CHECK_THAT(polygon_to_polygon(horizontal(unit, unit, 0, true), upright(unit, unit)),
               WithinAbs(cube_adjacent, printed));
}

TEST_CASE("closed forms and the contour integral agree in general position", "[form_factors][reference]") {
    const Interval x1{0.3, 1.7}, y1{-0.4, 0.9}, x2{1.1, 2.5}, y2{0.2, 2.0}, z2{0.25, 1.5};
    CHECK_THAT(
        parallel_rectangles(x1, y1, x2, y2, 0.8),
        WithinAbs(polygon_to_polygon(horizontal(x1, y1, 0, true), horizontal(x2, y2, 0.8, false)), printed));
    CHECK_THAT(perpendicular_rectangles(x1, y1, y2, z2),
               WithinAbs(polygon_to_polygon(horizontal(x1, y1, 0, true), upright(y2, z2)), printed));
}

TEST_CASE("a row of a tetrahedron sums to one and obeys reciprocity", "[form_factors][reference]") {
    const glm::dvec3 o{0, 0, 0}, a{2, 0, 0.3}, b{0.4, 1.5, 0}, c{0.2, 0.3, 1.1};
    const std::vector<std::vector<glm::dvec3>> faces{
        {o, a, b}, {o, c, a}, {o, b, c}, {a, c, b}};  // seen from inside
    std::vector<double> area;
    for (const auto& f : faces)
        area.push_back(0.5 * glm::length(glm::cross(f[1] - f[0], f[2] - f[0])));
    for (std::size_t i = 0; i < 4; ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j < 4; ++j) {
            if (i == j) continue;
            const double f = polygon_to_polygon(faces[i], faces[j]);
            sum += f;
            CHECK_THAT(area[i] * f, WithinAbs(area[j] * polygon_to_polygon(faces[j], faces[i]), printed));
        }
        CHECK_THAT(sum, WithinAbs(1.0, printed));
    }
}

TEST_CASE("a point below the corner of a square sees its known share", "[form_factors][reference]") {
    // F of a corner rectangle a x b at distance c, A = a / c, B = b / c, at A = B = 1: atan(1 / sqrt 2) / (pi
    // sqrt 2).
    const std::vector<glm::dvec3> square{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    CHECK_THAT(point_to_polygon({0, 0, 0}, {0, 0, 1}, square), WithinAbs(0.1385316, 1e-7));
}
