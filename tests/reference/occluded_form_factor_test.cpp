#include "tests/reference/occluded_form_factor.h"

#include <glm/geometric.hpp>

#include "tests/catch.h"
#include "tests/random_scenes.h"
#include "tests/reference/exact_form_factors.h"
#include "tests/reference/occluded_pairs.h"

using namespace naturel;
using namespace naturel::tests;
using glm::dvec3;

namespace {

using Outline = std::vector<dvec3>;

double area(const Outline& p) {
    dvec3 sum{};
    for (std::size_t k = 1; k + 1 < p.size(); ++k) sum += 0.5 * glm::cross(p[k] - p[0], p[k + 1] - p[0]);
    return glm::length(sum);
}

}  // namespace

TEST_CASE("the occluded reference without occluders is the contour integral", "[reference][analytic]") {
    const Outline floor{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, triangle{{0.2, 0.1, 0.9}, {0.3, 0.8, 1.4}, {1.1, 0.4, 1.1}};
    const auto f = reference::occluded_form_factor(floor, triangle, {});
    CHECK_THAT(f.value, Catch::Matchers::WithinAbs(reference::polygon_to_polygon(floor, triangle), 1e-8));
}

TEST_CASE("the occluded reference sums to 1 over a room with boxes and is reciprocal", "[reference][property][slow]") {
    const Building building = assemble(random_furnished_room(1));
    const auto occluders = facet_polygons(building);
    constexpr double tolerance = 1e-5;
    const std::size_t f = building.facets.size() - 2;  // of the last box
    REQUIRE(building.facets[f].environment == Environment::indoor);
    double sum = 0.0, largest = 0.0;
    std::size_t most = f;
    for (std::size_t g = 0; g < building.facets.size(); ++g) {
        if (g == f || building.facets[g].environment != Environment::indoor) continue;
        const double there = reference::occluded_form_factor(occluders[f], occluders[g], occluders, tolerance).value;
        sum += there;
        if (there > largest) largest = there, most = g;
    }
    // Some ten values, each within its tolerance.
    CHECK_THAT(sum, Catch::Matchers::WithinAbs(1.0, 10 * tolerance));
    const double back = reference::occluded_form_factor(occluders[most], occluders[f], occluders, tolerance).value;
    CHECK(std::abs(largest * area(occluders[f]) - back * area(occluders[most])) < 2 * tolerance * std::max(area(occluders[f]), area(occluders[most])));
}

TEST_CASE("a plate hides what its shadow covers and no more", "[reference][analytic]") {
    // From a point, a square plate at half the height casts a shadow twice as large.
    const Outline ceiling{{-1, -1, 2}, {-1, 1, 2}, {1, 1, 2}, {1, -1, 2}};
    const std::vector<Outline> plate{{{-0.2, -0.1, 1}, {-0.2, 0.4, 1}, {0.3, 0.4, 1}, {0.3, -0.1, 1}}};
    const Outline shadow{{-0.4, -0.2, 2}, {-0.4, 0.8, 2}, {0.6, 0.8, 2}, {0.6, -0.2, 2}};
    const dvec3 eye(0, 0, 0), up(0, 0, 1);
    CHECK_THAT(reference::occluded_form_factor(eye, up, ceiling, plate),
               Catch::Matchers::WithinAbs(reference::point_to_polygon(eye, up, ceiling) - reference::point_to_polygon(eye, up, shadow), 1e-12));
}
