#include "core/view_pieces.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <random>
#include <set>

#include "core/spherical_polygon.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"
#include "tests/reference/brute_force_visibility.h"

using namespace naturel;
using namespace naturel::tests;
using glm::dvec3;

namespace {

/// Boxes in a room and a polygon that hangs in the air.
Building furnished_room(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>{low, high}(random); };
    Scene scene = empty_scene();
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, 0}, {6.3, 5.3, 3.6}),
                       box("room", Effect::carve, {0, 0, 0.3}, {6, 5, 3.3})};
    for (int k = 0; k < 16; ++k) {
        const dvec3 low{between(0, 5), between(0, 4), between(0.3, 2)};
        scene.polyhedra.push_back(box("box " + std::to_string(k), Effect::fill, low, low + dvec3{between(0.1, 1), between(0.1, 1), between(0.1, 1)}));
    }
    return assemble(scene);
}

std::vector<dvec3> inward_planes(std::span<const dvec3> polygon) {
    std::vector<dvec3> planes;
    for (std::size_t k = 0; k < polygon.size(); ++k)
        planes.push_back(glm::normalize(glm::cross(polygon[(k + 1) % polygon.size()], polygon[k])));
    return planes;
}

}  // namespace

TEST_CASE("in each piece of a view one facet is seen, and the pieces make up the view", "[direct][property]") {
    const auto seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    const Building building = furnished_room(seed);
    const FacetTree tree(building);
    const BruteForceVisibility exact(building);
    std::mt19937_64 random(seed + 100);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    const auto anywhere = [&] { return dvec3{0.01 + share(random), 0.01 + share(random), 0.31 + 2.98 * share(random)}; };
    dvec3 from = anywhere();
    const auto inside_a_box = [&](const dvec3& p) {  // then some facet is met from behind
        std::vector<FacetTree::Found> found;
        FacetId seen{};
        const dvec3 up{0, 0, 1};
        exact.first_seen({p, up}, {&up, 1}, {&seen, 1});
        return seen != FacetId::none && building.facets[index(seen)].normal.z > 0.0;
    };
    while (inside_a_box(from)) from = anywhere();

    const std::vector<dvec3> view{{1, 0.6, -0.5}, {0.4, 1, -0.5}, {0.4, 1, 0.7}, {1, 0.6, 0.7}};  // counter-clockwise from the origin
    std::vector<dvec3> polygon = view;
    if (vector_solid_angle(polygon).x < 0.0) std::reverse(polygon.begin(), polygon.end());
    std::vector<FacetTree::Found> facets;
    tree.find(from, inward_planes(polygon), facets);
    CHECK(std::is_sorted(facets.begin(), facets.end(), [](const auto& a, const auto& b) { return a.distance_m < b.distance_m; }));
    ViewPieces pieces;
    pieces.start(polygon, 1e-12);
    for (const FacetTree::Found& facet : facets) pieces.cut_along(from, tree, facet);
    CHECK(pieces.complete());

    dvec3 sum{};
    std::size_t odd = 0;
    for (const ViewPieces::Piece& piece : pieces.pieces()) {
        const auto corners = pieces.directions_of(piece);
        sum += vector_solid_angle(corners);
        std::vector<dvec3> directions;
        dvec3 middle{};
        for (const dvec3& corner : corners) middle += corner;
        for (const dvec3& corner : corners) {
            const dvec3 direction = glm::normalize(middle / static_cast<double>(corners.size()) + 3.0 * corner);
            // Closer to an edge, rounding of coordinates to 1 nm decides.
            const auto planes = inward_planes(corners);
            if (std::all_of(planes.begin(), planes.end(), [&](const dvec3& p) { return glm::dot(p, direction) > 1e-6; }))
                directions.push_back(direction);
        }
        std::vector<FacetId> seen(directions.size());
        exact.first_seen({from, glm::normalize(polygon[0])}, directions, seen);
        std::set<FaceId> faces;
        for (const FacetId id : seen) faces.insert(id == FacetId::none ? FaceId{0xffffffffu} : building.facets[index(id)].face);
        odd += faces.size() > 1 ? 1 : 0;
    }
    CHECK(odd == 0);
    // Rounding of directions in some hundred cuts.
    CHECK(glm::length(sum - vector_solid_angle(polygon)) <= 1e-9);
    CHECK(pieces.pieces().size() > 1);
}

TEST_CASE("a tree of facets finds all that a pyramid meets", "[direct][property]") {
    const auto seed = GENERATE(range(1u, 6u));
    const Building building = furnished_room(seed);
    const FacetTree tree(building);
    const BruteForceVisibility exact(building);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const dvec3 from{0.05 + 0.01 * seed, 0.06, 3.25};
    for (int k = 0; k < 200; ++k) {
        const dvec3 axis = glm::normalize(dvec3{normal(random), normal(random), normal(random)});
        const dvec3 aside = glm::normalize(glm::cross(axis, dvec3{0.3, 0.5, 0.8})), up = glm::cross(aside, axis);
        std::vector<dvec3> thin{axis, axis + 1e-3 * aside, axis + 1e-3 * up};
        if (glm::dot(vector_solid_angle(thin), axis) < 0.0) std::reverse(thin.begin(), thin.end());
        const dvec3 inside = glm::normalize(thin[0] + thin[1] + thin[2]);
        FacetId seen{};
        exact.first_seen({from, inside}, {&inside, 1}, {&seen, 1});
        std::vector<FacetTree::Found> found;
        tree.find(from, inward_planes(thin), found);
        const auto same = [&](const FacetTree::Found& facet) {
            const auto vertices = tree.vertices_of(facet.facet);
            const auto& expected = building.facets[index(seen)].vertices_m;
            return std::equal(vertices.begin(), vertices.end(), expected.begin(), expected.end());
        };
        REQUIRE(seen != FacetId::none);
        CHECK(std::any_of(found.begin(), found.end(), same));
        CHECK(found.size() < building.facets.size() / 2);
    }
}
