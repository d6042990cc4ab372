#include "core/convex_solid.h"

#include <glm/geometric.hpp>
#include <random>

#include "core/polyhedra.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"
#include "tests/reference/light_paths.h"
#include "tests/reference/test_buildings.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

std::vector<ConvexSolid> occluders_of(const Scene& scene) { return convex_occluders(scene, assemble(scene)); }

bool holds(const ConvexSolid& solid, const dvec3& p, double margin_m) {
    for (const ConvexSolid::Side& side : solid.sides)
        if (glm::dot(side.plane.normal, p) - side.plane.offset_m > margin_m) return false;
    return true;
}

bool has_box(const std::vector<ConvexSolid>& solids, const dvec3& low_m, const dvec3& high_m) {
    for (const ConvexSolid& solid : solids) {
        const dvec3 size = high_m - low_m;
        if (glm::distance(solid.low_m, low_m) < 1e-9 && glm::distance(solid.high_m, high_m) < 1e-9 &&
            std::abs(volume_m3(solid) - size.x * size.y * size.z) < 1e-9)
            return true;
    }
    return false;
}

}  // namespace

TEST_CASE("a solid keeps its volume and closed surface through a long chain of cuts", "[core][umbra][convex_solid]") {
    // A ball with 500 planes, far from the origin. Each cut must leave what a fresh ball of its planes would be.
    Scene scene = empty_scene();
    const dvec3 centre(80, -60, 20);
    scene.polyhedra = {box("block", Effect::fill, centre - 2.0, centre + 2.0)};
    ConvexSolid ball = occluders_of(scene).at(0);
    std::mt19937_64 random(1);
    for (int cut = 0; cut < 500; ++cut) {
        dvec3 normal(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
        normal = glm::normalize(normal);
        // Every tenth plane passes through a vertex, so that four planes meet in a point.
        double offset_m = glm::dot(normal, centre) + 1.0;
        if (cut % 10 == 9) {
            for (const ConvexSolid::Side& side : ball.sides)
                for (const dvec3& v : side.vertices_m) normal = glm::distance(v, centre) > 1.02 ? glm::normalize(v - centre) : normal;
            const dvec3 tilted = glm::normalize(normal + dvec3(0.1, 0.2, -0.1));
            double highest = -1e300, second = -1e300;
            for (const dvec3& v : ball.sides[static_cast<std::size_t>(cut) % ball.sides.size()].vertices_m) {
                const double h = glm::dot(tilted, v);
                if (h > highest) second = highest, highest = h;
                else second = std::max(second, h);
            }
            normal = tilted, offset_m = second;
            if (offset_m - glm::dot(normal, centre) < 0.9) continue;
        }
        REQUIRE(clip(ball, {normal, offset_m}));
    }
    dvec3 vector_area{};
    double worst_m = 0.0;
    for (const ConvexSolid::Side& side : ball.sides) {
        for (std::size_t k = 1; k + 1 < side.vertices_m.size(); ++k)
            vector_area += 0.5 * glm::cross(side.vertices_m[k] - side.vertices_m[0], side.vertices_m[k + 1] - side.vertices_m[0]);
        for (const dvec3& v : side.vertices_m)
            for (const ConvexSolid::Side& other : ball.sides)
                worst_m = std::max(worst_m, glm::dot(other.plane.normal, v) - other.plane.offset_m);
    }
    CHECK(glm::length(vector_area) < 1e-9);
    CHECK(worst_m < 1e-9);  // no vertex is outside any of the planes
    // About the unit ball; 500 tangent planes leave some percent more.
    CHECK(volume_m3(ball) > 4.18879 * 0.95);
    CHECK(volume_m3(ball) < 4.18879 * 1.1);
}

TEST_CASE("a box cut in two has the volume of its parts", "[core][umbra][convex_solid]") {
    Scene scene = empty_scene();
    scene.polyhedra = {box("block", Effect::fill, {0, 0, 0}, {2, 3, 4})};
    const ConvexSolid block = occluders_of(scene).at(0);
    CHECK_THAT(volume_m3(block), WithinRel(24.0, 1e-12));
    const dvec3 normal = glm::normalize(dvec3(1, 2, 3));
    const double offset_m = glm::dot(normal, dvec3(1.2, 1.1, 1.9));
    ConvexSolid below = block, above = block;
    REQUIRE(clip(below, {normal, offset_m}));
    REQUIRE(clip(above, {-normal, -offset_m}));
    CHECK_THAT(volume_m3(below) + volume_m3(above), WithinRel(24.0, 1e-12));
    CHECK(contains(block, below));
    CHECK_FALSE(contains(below, block));
    // A micrometre is nothing.
    CHECK_FALSE(clip(below, {{0, 0, 1}, 0.9e-6}));
}

TEST_CASE("a hollow building is six slabs that overlap", "[core][umbra][convex_solid]") {
    const auto solids = occluders_of(closed_room({4, 5, 3}));
    CHECK(solids.size() == 6);
    CHECK(has_box(solids, {-0.3, -0.3, -0.3}, {0, 5.3, 3.3}));
    CHECK(has_box(solids, {-0.3, -0.3, 3}, {4.3, 5.3, 3.3}));
}

TEST_CASE("a room below the ground is walled by the ground", "[core][umbra][convex_solid]") {
    Scene scene = empty_scene();
    scene.polyhedra = {box("pit", Effect::carve, {0, 0, -2}, {3, 4, 1})};
    const auto solids = occluders_of(scene);
    REQUIRE(solids.size() == 5);
    for (const ConvexSolid& solid : solids) CHECK(solid.high_m.z <= 0.0);
}

TEST_CASE("bodies whose union is convex become one", "[core][umbra][convex_solid]") {
    Scene scene = empty_scene();
    SECTION("a box in two boxes") {
        scene.polyhedra = {box("a", Effect::fill, {0, 0, 1}, {1, 1, 2}), box("b", Effect::fill, {1, 0, 1}, {3, 1, 2})};
    }
    SECTION("a box in eight boxes, in any order") {
        for (const int k : {5, 2, 7, 0, 3, 6, 1, 4}) {
            const dvec3 low(k & 1 ? 1 : 0, k & 2 ? 0.4 : 0, k & 4 ? 1.7 : 1);
            const dvec3 high(k & 1 ? 3 : 1, k & 2 ? 1 : 0.4, k & 4 ? 2 : 1.7);
            scene.polyhedra.push_back(box("part " + std::to_string(k), Effect::fill, low, high));
        }
    }
    SECTION("a box in boxes that overlap") {
        scene.polyhedra = {box("a", Effect::fill, {0, 0, 1}, {2, 1, 2}), box("b", Effect::fill, {1, 0, 1}, {3, 1, 2})};
    }
    SECTION("a box in two prisms") {
        Polyhedron a{.id = "a", .kind = PolyhedronKind::prism, .vertices_m = {dvec3(0, 0, 1), dvec3(3, 0, 1), dvec3(0, 1, 1), dvec3(0, 0, 2)}};
        Polyhedron b{.id = "b", .kind = PolyhedronKind::prism, .vertices_m = {dvec3(3, 1, 1), dvec3(3, 0, 1), dvec3(0, 1, 1), dvec3(3, 1, 2)}};
        scene.polyhedra = {a, b};
    }
    SECTION("a box in a prism and three tetrahedra") {
        const dvec3 low(0, 0, 1), size(3, 1, 1);
        const std::array<std::array<int, 3>, 3> ways{{{0, 1, 2}, {0, 2, 1}, {2, 0, 1}}};  // those with x before y
        for (const auto& way : ways) {
            Polyhedron t{.id = "t" + std::to_string(scene.polyhedra.size()), .kind = PolyhedronKind::tetrahedron};
            dvec3 p = low;
            t.vertices_m[0] = p;
            for (std::size_t k = 0; k < 3; ++k) p[way[k]] += size[way[k]], t.vertices_m[k + 1] = p;
            scene.polyhedra.push_back(t);
        }
        scene.polyhedra.push_back({.id = "p", .kind = PolyhedronKind::prism, .vertices_m = {dvec3(0, 1, 1), dvec3(3, 1, 1), dvec3(0, 0, 1), dvec3(0, 1, 2)}});
    }
    const auto solids = occluders_of(scene);
    CHECK(solids.size() == 1);
    CHECK(has_box(solids, {0, 0, 1}, {3, 1, 2}));
}

TEST_CASE("an L and a T of boxes become their longest boxes", "[core][umbra][convex_solid]") {
    Scene scene = empty_scene();
    SECTION("L") {
        scene.polyhedra = {box("a", Effect::fill, {0, 0, 1}, {3, 1, 2}), box("b", Effect::fill, {0, 1, 1}, {1, 2, 2})};
        const auto solids = occluders_of(scene);
        CHECK(solids.size() == 2);
        CHECK(has_box(solids, {0, 0, 1}, {3, 1, 2}));
        CHECK(has_box(solids, {0, 0, 1}, {1, 2, 2}));
    }
    SECTION("T, in three parts") {
        scene.polyhedra = {box("a", Effect::fill, {0, 0, 1}, {1.5, 1, 2}), box("b", Effect::fill, {1, 1, 1}, {2, 3, 2}),
                           box("c", Effect::fill, {1.5, 0, 1}, {3, 1, 2})};
        const auto solids = occluders_of(scene);
        CHECK(solids.size() == 2);
        CHECK(has_box(solids, {0, 0, 1}, {3, 1, 2}));
        CHECK(has_box(solids, {1, 0, 1}, {2, 3, 2}));
    }
    SECTION("boxes a millimetre apart stay apart") {
        scene.polyhedra = {box("a", Effect::fill, {0, 0, 1}, {1, 1, 2}), box("b", Effect::fill, {1.001, 0, 1}, {3, 1, 2})};
        CHECK(occluders_of(scene).size() == 2);
    }
}

TEST_CASE("occluders of random scenes hold all solid matter and nothing else", "[core][umbra][convex_solid][property]") {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        INFO("seed " << seed);
        Scene scene = seed < 20 ? random_building(seed)
                                : random_scene(seed, 5 + static_cast<int>(seed % 16), seed % 2 ? Placement::free : Placement::lattice, seed % 4 ? 0.5 : -3.0);
        scene.polygons.clear();
        const auto solids = occluders_of(scene);
        std::mt19937_64 random(seed);
        const auto held = [&](const dvec3& p, double margin_m) {
            return std::any_of(solids.begin(), solids.end(), [&](const ConvexSolid& s) { return holds(s, p, margin_m); });
        };
        int wrong = 0;
        for (int i = 0; i < 2000; ++i) {
            const dvec3 p(uniform(random, -1, 9), uniform(random, -3, 9), uniform(random, -3, 9));
            const bool solid = medium_at(scene, p) == Medium::solid;
            // Far below the ground there are no occluders.
            if (p.z < 0.0 && solid && !held(p, 0.0)) continue;
            wrong += solid == held(p, 0.0) ? 0 : 1;
        }
        CHECK(wrong == 0);
        // Inside each of them, from its middle almost to its surface.
        int outside = 0;
        for (const ConvexSolid& s : solids) {
            for (int i = 0; i < 200; ++i) {
                const dvec3 p(uniform(random, s.low_m.x, s.high_m.x), uniform(random, s.low_m.y, s.high_m.y), uniform(random, s.low_m.z, s.high_m.z));
                // Two tolerances deep: bodies that miss each other by one of them count as touching.
                if (holds(s, p, -2.0 * thinnest_m) && medium_at(scene, p) != Medium::solid) ++outside;
            }
        }
        CHECK(outside == 0);
    }
}

TEST_CASE("polygons of one plane are one sheet where their union is convex", "[core][umbra][convex_solid]") {
    Scene scene = empty_scene();
    scene.polygons = {{.id = "a", .vertices_m = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, .two_sided = true},
                      {.id = "b", .vertices_m = {{1, 1, 1}, {1, 0, 1}, {0, 1, 1}}},
                      {.id = "c", .vertices_m = {{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}}};
    const auto solids = occluders_of(scene);
    REQUIRE(solids.size() == 2);
    CHECK(solids[0].sides.size() == 1);
    CHECK(solids[0].sides[0].vertices_m.size() == 4);
    CHECK(solids[1].sides[0].vertices_m.size() == 3);
}
