#include <array>
#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "core/units.h"
#include "embree_backend/pairwise.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"
#include "tests/reference/occluded_form_factor.h"
#include "tests/reference/occluded_pairs.h"

using namespace naturel;
using namespace naturel::tests;
using glm::dvec3;

namespace {

/// Two squares of 1 m that face each other at a distance of 2 m, patches 0 and 1; what is added to the polygons and polyhedra stands between.
Scene facing_squares() {
    Scene scene = empty_scene();
    scene.polygons = {{.id = "below", .vertices_m = {{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}}},
                      {.id = "above", .vertices_m = {{0, 0, 7}, {0, 1, 7}, {1, 1, 7}, {1, 0, 7}}}};
    return scene;
}

/// A horizontal rectangle without thickness.
SurfacePolygon sheet(std::string id, dvec3 low, dvec3 high) {
    return {.id = std::move(id),
            .vertices_m = {low, {high.x, low.y, low.z}, {high.x, high.y, low.z}, {low.x, high.y, low.z}},
            .side = Environment::outdoor};
}

struct Compared {
    double value, estimate, truth, unoccluded;
};

/// Form factors between patches 0 and 1, of the smaller one.
Compared compare(const Scene& scene, double tolerance) {
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 100.0});
    REQUIRE(grid.gather_patch_count == 2);
    NoProgress quiet;
    const FormFactorRows rows = PairwiseExchange(building, grid, {.tolerance = tolerance}).rows(true, quiet);
    const std::size_t small = grid.patches[0].area_m2 <= grid.patches[1].area_m2 ? 0 : 1;
    const auto truth = reference::occluded_form_factor(grid.polygon_of(make_id<PatchId>(small)), grid.polygon_of(make_id<PatchId>(1 - small)),
                                                       facet_polygons(building), 1e-6);
    const bool seen = rows.row_begin[small + 1] > rows.row_begin[small];
    return {seen ? rows.value[rows.row_begin[small]] : 0.0, seen ? static_cast<double>(rows.error[rows.row_begin[small]]) : 0.0, truth.value,
            truth.unoccluded};
}

}  // namespace

TEST_CASE("form factors past occluders are those of integration after exact clipping", "[embree][pairwise][reference]") {
    Scene scene = facing_squares();
    SECTION("a box that covers half") {
        scene.polyhedra = {box("box", Effect::fill, {0.5, -1, 5.8}, {2, 2, 6.2})};
    }
    SECTION("a louvre") {
        for (int k = 0; k < 9; ++k)
            scene.polyhedra.push_back(box("slat " + std::to_string(k), Effect::fill, {-0.5 + 0.22 * k, -0.5, 5.95}, {-0.47 + 0.22 * k, 1.5, 6.1}));
    }
    SECTION("a hole in a plate") {
        scene.polygons.push_back({.id = "plate",
                                  .vertices_m = {{-1, -1, 6}, {2, -1, 6}, {2, 2, 6}, {-1, 2, 6}},
                                  .holes_m = {{{0.3, 0.4, 6}, {0.6, 0.4, 6}, {0.6, 0.7, 6}, {0.3, 0.7, 6}}},
                                  .side = Environment::outdoor});
    }
    SECTION("two occluders in series") {
        scene.polygons.push_back(sheet("low", {0.2, 0.1, 5.6}, {0.7, 0.8, 5.6}));
        scene.polygons.push_back(sheet("high", {0.4, 0.3, 6.5}, {1.2, 0.9, 6.5}));
    }
    const Compared c = compare(scene, 5e-6);
    INFO("F " << c.truth << " of " << c.unoccluded << ", error " << c.value - c.truth << ", estimate " << c.estimate);
    CHECK(c.truth < 0.9 * c.unoccluded);
    CHECK(c.truth > 0.01 * c.unoccluded);
    // Estimates are met in 99 % of cases; 1e-5 is what is asked of ground truth.
    CHECK(std::abs(c.value - c.truth) < 1e-5);
}

TEST_CASE("the estimated error covers the true one in 99 % of partly visible pairs", "[embree][pairwise][reference][slow]") {
    // Seeds other than those that the estimate was fitted to.
    std::size_t pairs = 0, covered = 0;
    double worst = 0.0;
    constexpr double tolerance = 1e-5, of_reference = 2e-6;
    for (std::uint64_t seed = 5001; seed < 5081; ++seed) {
        const Compared c = compare(random_occluded_pair(seed), tolerance);
        if (c.unoccluded - c.truth < 1e-9 || c.truth < 1e-9) {
            CHECK(std::abs(c.value - c.truth) < 1e-8);  // seen whole, or hidden
            continue;
        }
        ++pairs;
        covered += std::abs(c.value - c.truth) <= c.estimate + of_reference;
        worst = std::max(worst, std::abs(c.value - c.truth));
    }
    INFO(covered << " of " << pairs << " covered, worst error " << worst);
    CHECK(pairs > 50);
    CHECK(static_cast<double>(covered) >= 0.99 * static_cast<double>(pairs) - 1.0);  // one more by chance
    CHECK(worst < 5 * tolerance);  // the estimate is no bound, but no error is far beyond it
}

TEST_CASE("pairwise rows of a furnished room sum to 1 within their estimated errors", "[embree][pairwise][property]") {
    const auto seed = GENERATE(11u, 12u);
    const Building building = assemble(random_furnished_room(seed));
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.9});
    NoProgress quiet;
    const FormFactorRows rows = PairwiseExchange(building, grid, {.tolerance = 1e-4}).rows(true, quiet);
    std::size_t beyond = 0;
    double worst = 0.0;
    for (std::size_t i = 0; i < grid.gather_patch_count; ++i) {
        double sum = 0.0, square = 0.0;
        for (auto e = rows.row_begin[i]; e < rows.row_begin[i + 1]; ++e) {
            sum += rows.value[e];
            square += static_cast<double>(rows.error[e]) * static_cast<double>(rows.error[e]);
        }
        beyond += std::abs(sum - 1.0) > std::sqrt(square);
        worst = std::max(worst, std::abs(sum - 1.0) / std::sqrt(square));
    }
    INFO("seed " << seed << ": " << beyond << " of " << grid.gather_patch_count << " rows, worst " << worst);
    // Errors are independent, each below its estimate in 99 %: so is their sum. A patch that something stands upon has many errors of one
    // sign, hence 2 % and twice.
    CHECK(static_cast<double>(beyond) <= 0.02 * static_cast<double>(grid.gather_patch_count));
    CHECK(worst < 2.0);
}

TEST_CASE("a row with a leak reports it and rows without report none", "[embree][pairwise][property]") {
    // A room of polygons without its ceiling: what is missing is what its ceiling would catch.
    Scene scene = empty_scene();
    scene.polygons = {{.id = "floor", .vertices_m = {{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}}},
                      {.id = "south", .vertices_m = {{0, 0, 5}, {0, 0, 6}, {1, 0, 6}, {1, 0, 5}}},
                      {.id = "north", .vertices_m = {{0, 1, 5}, {1, 1, 5}, {1, 1, 6}, {0, 1, 6}}},
                      {.id = "west", .vertices_m = {{0, 0, 5}, {0, 1, 5}, {0, 1, 6}, {0, 0, 6}}},
                      {.id = "east", .vertices_m = {{1, 0, 5}, {1, 0, 6}, {1, 1, 6}, {1, 1, 5}}}};
    const bool closed = GENERATE(false, true);
    if (closed) scene.polygons.push_back({.id = "ceiling", .vertices_m = {{0, 0, 6}, {0, 1, 6}, {1, 1, 6}, {1, 0, 6}}});
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 100.0});
    FormFactorRow row;
    PairwiseExchange(building, grid, {}).row(make_id<PatchId>(0), row);
    // Opposed squares of a cube (docs/method.md). Closed, rounding alone is left: no leak at all.
    CHECK_THAT(row.lost, Catch::Matchers::WithinAbs(closed ? 0.0 : 0.199824896, 1e-8));
}

TEST_CASE("a polygon of many corners is seen from points as its triangles are", "[embree][pairwise]") {
    const int corners = GENERATE(17, 49, 64, 200);
    const auto disc = [&](double z, double radius, bool up) {
        std::vector<dvec3> v;
        for (int k = 0; k < corners; ++k) {
            const double angle = (up ? 2.0 : -2.0) * pi * k / corners;
            v.emplace_back(0.5 + radius * std::cos(angle), 0.5 + radius * std::sin(angle), z);
        }
        return v;
    };
    Scene scene = facing_squares();
    scene.polygons[1].vertices_m = disc(7, 0.5, false);
    const bool occluded = GENERATE(false, true);
    if (occluded) scene.polygons.push_back(sheet("between", {0.4, 0.3, 5.6}, {0.5, 0.45, 5.6}));
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 100.0});
    REQUIRE(grid.gather_patch_count == 2);
    const dvec3 point(0.45, 0.4, 5);
    FormFactorRow row;
    PairwiseExchange(building, grid, {}).row(GatherPoint{point, {0, 0, 1}}, row);
    const auto receiver = grid.polygon_of(make_id<PatchId>(1));
    double exact = 0.0;
    for (std::size_t k = 1; k + 1 < receiver.size(); ++k)
        exact += reference::occluded_form_factor(point, {0, 0, 1}, std::array{receiver[0], receiver[k], receiver[k + 1]}, facet_polygons(building));
    REQUIRE(row.values.size() == 1);
    INFO(corners << " corners: " << row.values[0] << " instead of " << exact);
    CHECK(std::abs(row.values[0] - exact) < 1e-8);
}

TEST_CASE("pairwise rows have the same bits for 1, 2 and 3 threads", "[embree][pairwise][threads]") {
    const Building building = assemble(random_furnished_room(3));
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.9});
    NoProgress quiet;
    const auto at = [&](int threads) {
        const ThreadLimit limit(threads);
        return PairwiseExchange(building, grid, {.tolerance = 1e-3}).rows(true, quiet);
    };
    const FormFactorRows one = at(1);
    const auto same = [](const auto& a, const auto& b) {
        return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
    };
    for (const int threads : {2, 3}) {
        const FormFactorRows many = at(threads);
        INFO(threads << " threads");
        CHECK(same(one.row_begin, many.row_begin));
        CHECK(same(one.column, many.column));
        CHECK(same(one.value, many.value));
        CHECK(same(one.error, many.error));
        CHECK(same(one.lost, many.lost));
    }
}
