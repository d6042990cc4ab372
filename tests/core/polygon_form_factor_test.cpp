#include "core/polygon_form_factor.h"

#include <glm/geometric.hpp>
#include <random>
#include <vector>

#include "tests/catch.h"
#include "tests/reference/exact_form_factors.h"

using namespace naturel;
using glm::dvec3;

namespace {

using Polygon = std::vector<dvec3>;

dvec3 area_vector(const Polygon& p) {
    dvec3 sum{};
    for (std::size_t k = 1; k + 1 < p.size(); ++k) sum += 0.5 * glm::cross(p[k] - p[0], p[k + 1] - p[0]);
    return sum;
}

double form_factor(const Polygon& a, const Polygon& b) {
    const dvec3 area_a = area_vector(a);
    return unoccluded_exchange_m2(a, glm::normalize(area_a), b, glm::normalize(area_vector(b))) / glm::length(area_a);
}

Polygon horizontal(reference::Interval x, reference::Interval y, double z, bool facing_up) {
    Polygon v{{x.low, y.low, z}, {x.high, y.low, z}, {x.high, y.high, z}, {x.low, y.high, z}};
    if (!facing_up) std::swap(v[1], v[3]);
    return v;
}

/// In the plane x = 0, facing +x.
Polygon upright(reference::Interval y, reference::Interval z) {
    return {{0, y.low, z.low}, {0, y.high, z.low}, {0, y.high, z.high}, {0, y.low, z.high}};
}

/// The closed forms are exact; what is left is rounding. A thousandth of what a user may ask for.
constexpr double exact = 1e-9;

}  // namespace

TEST_CASE("parallel and perpendicular rectangles have their closed forms", "[form_factors][polygon][analytic]") {
    std::mt19937_64 random(3);
    const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53; };
    const auto interval = [&](double low) {
        const double start = uniform(low, low + 2);
        return reference::Interval{start, start + uniform(0.05, 2)};
    };
    double worst = 0.0;
    for (int k = 0; k < 300; ++k) {
        const auto x1 = interval(-1), y1 = interval(-1), x2 = interval(-1), y2 = interval(-1);
        const double z = uniform(0.02, 3);
        worst = std::max(worst, std::abs(form_factor(horizontal(x1, y1, 0, true), horizontal(x2, y2, z, false)) -
                                         reference::parallel_rectangles(x1, y1, x2, y2, z)));
        auto x = interval(0), z2 = interval(0);
        if (k % 3 == 0) x.low = z2.low = 0.0;  // sharing an edge, or part of one
        worst = std::max(worst, std::abs(form_factor(horizontal(x, y1, 0, true), upright(y2, z2)) -
                                         reference::perpendicular_rectangles(x, y1, y2, z2)));
    }
    CHECK(worst < exact);
}

TEST_CASE("tiny, far, near and unequal rectangles have their closed forms", "[form_factors][polygon][analytic]") {
    using reference::Interval;
    const Interval unit{0, 1}, tiny{0.4, 0.4 + 1e-3};
    const auto both = [&](Interval x1, Interval y1, Interval x2, Interval y2, double z) {
        return std::abs(form_factor(horizontal(x1, y1, 0, true), horizontal(x2, y2, z, false)) -
                        reference::parallel_rectangles(x1, y1, x2, y2, z));
    };
    CHECK(both(unit, unit, unit, unit, 1e-3) < exact);  // almost touching: F = 0.998
    CHECK(both(tiny, unit, unit, unit, 0.5) < exact);   // areas 1 to 1000
    CHECK(both(unit, unit, tiny, unit, 0.5) < exact);
    // Two dots: F = A / (pi r^2) within (size / r)^2; the closed form itself has no digits left.
    const double dots = form_factor(horizontal(tiny, tiny, 0, true), horizontal(tiny, tiny, 10, false));
    CHECK(std::abs(dots * std::acos(-1.0) * 100.0 / 1e-6 - 1.0) < 1e-3);
    CHECK(std::abs(form_factor(horizontal(tiny, {0, 1e-3}, 0, true), upright({0, 1e-3}, {0, 1e-3})) -
                   reference::perpendicular_rectangles(tiny, {0, 1e-3}, {0, 1e-3}, {0, 1e-3})) < exact);
}

TEST_CASE("inclined rectangles that share an edge have the tabulated form factor", "[form_factors][polygon][analytic]") {
    // Unit squares that enclose an angle: the sum over the five faces of the wedge is 1, its two triangles being seen by symmetry
    // equally. Against the tanh-sinh contour integral for the value itself.
    for (const double angle : {0.2, 0.5, 1.0, 2.0, 3.0}) {
        const dvec3 up(std::cos(angle), 0, std::sin(angle));
        const Polygon floor = horizontal({0, 1}, {0, 1}, 0, true), ramp{{0, 0, 0}, {0, 1, 0}, dvec3(0, 1, 0) + up, up};
        CHECK_THAT(form_factor(floor, ramp), Catch::Matchers::WithinAbs(reference::polygon_to_polygon(floor, ramp), exact));
        const Polygon side{{0, 0, 0}, up, {1, 0, 0}}, other{{0, 1, 0}, {1, 1, 0}, dvec3(0, 1, 0) + up};
        const Polygon lid{{1, 0, 0}, up, dvec3(0, 1, 0) + up, {1, 1, 0}};
        CHECK_THAT(form_factor(floor, ramp) + form_factor(floor, side) + form_factor(floor, other) + form_factor(floor, lid),
                   Catch::Matchers::WithinAbs(1.0, 5 * exact));
    }
}

TEST_CASE("general convex polygons and triangles agree with the contour integral by tanh-sinh", "[form_factors][polygon]") {
    std::mt19937_64 random(5);
    const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53; };
    double worst = 0.0, worst_reciprocity = 0.0;
    for (int k = 0; k < 60; ++k) {
        // On circles in planes that face each other, so that nothing is below a horizon.
        const auto polygon = [&](const dvec3& centre, const dvec3& n, double radius) {
            const dvec3 u = glm::normalize(glm::cross(n, dvec3(0.3, 1, 0.2))), v = glm::cross(n, u);
            Polygon p;
            const int corners = 3 + k % 5;
            for (int c = 0; c < corners; ++c) {
                const double angle = (c + uniform(0, 0.9)) * 2 * std::acos(-1.0) / corners;
                p.push_back(centre + radius * (std::cos(angle) * u + std::sin(angle) * v));
            }
            return p;
        };
        const Polygon a = polygon({0, 0, 0}, glm::normalize(dvec3(uniform(-0.3, 0.3), uniform(-0.3, 0.3), 1)), 0.5);
        const Polygon b = polygon({uniform(-1, 1), uniform(-1, 1), 2}, glm::normalize(dvec3(uniform(-0.3, 0.3), 0.1, -1)), uniform(0.02, 0.9));
        worst = std::max(worst, std::abs(form_factor(a, b) - reference::polygon_to_polygon(a, b)));
        const double ratio = glm::length(area_vector(a)) / glm::length(area_vector(b));
        worst_reciprocity = std::max(worst_reciprocity, std::abs(form_factor(b, a) - ratio * form_factor(a, b)));
    }
    CHECK(worst < 2 * exact);
    CHECK(worst_reciprocity < 2 * exact);
}

TEST_CASE("what lies behind the plane of the other polygon does not count", "[form_factors][polygon]") {
    const Polygon floor = horizontal({0, 1}, {0, 1}, 0, true), wall = upright({0, 1}, {-1, 1});
    CHECK_THAT(form_factor(floor, wall), Catch::Matchers::WithinAbs(reference::cube_adjacent, exact));
    const Polygon wide = horizontal({-1, 1}, {0, 1}, 0, true);
    CHECK_THAT(2.0 * form_factor(wide, upright({0, 1}, {0, 1})), Catch::Matchers::WithinAbs(reference::cube_adjacent, exact));
    CHECK(form_factor(floor, horizontal({2, 3}, {0, 1}, 0, true)) == 0.0);  // coplanar
    CHECK(form_factor(floor, horizontal({0, 1}, {0, 1}, 1, true)) == 0.0);  // its back
}
