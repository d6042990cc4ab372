#include "hemicube_backend/hemicube_visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>
#include <thread>

#include "core/errors.h"
#include "core/units.h"
#include "core/view.h"
#include "tests/catch.h"
#include "tests/hemicube_backend/ray_caster.h"

namespace naturel {
namespace {

using glm::dvec3;

constexpr double opposed_squares = 0.199824896, adjoining_squares = 0.200043776;

Polyhedron box(const dvec3& low, const dvec3& high, Effect effect) {
    Polyhedron polyhedron;
    polyhedron.effect = effect;
    polyhedron.vertices_m = {low, {high.x, low.y, low.z}, {low.x, high.y, low.z}, {low.x, low.y, high.z}};
    return polyhedron;
}

/// A scene, turned about z and moved as a whole.
struct Placement {
    double angle_rad = 0.0;
    dvec3 offset_m{};

    dvec3 operator()(const dvec3& p) const {
        const double c = std::cos(angle_rad), s = std::sin(angle_rad);
        return offset_m + dvec3(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
    }
};

struct Room {
    Building building;
    PatchGrid grid;

    Room(Scene scene, double spacing_m, const Placement& placement = {}) {
        scene.materials.resize(1);
        scene.glazings.resize(1);
        scene.ground.z_m += placement.offset_m.z;
        for (Polyhedron& polyhedron : scene.polyhedra) {
            polyhedron.id = std::to_string(&polyhedron - scene.polyhedra.data());
            for (dvec3& vertex_m : polyhedron.vertices_m)
                vertex_m = placement(vertex_m);
        }
        for (SurfacePolygon& polygon : scene.polygons) {
            for (dvec3& vertex_m : polygon.vertices_m)
                vertex_m = placement(vertex_m);
        }
        building = assemble(scene);
        grid = make_patch_grid(building, {.spacing_m = spacing_m});
    }

    std::unique_ptr<Visibility> visibility(const HemicubeOptions& options = {}) const {
        return make_hemicube_visibility(building, grid, options);
    }

    /// Index of the face of `normal` whose plane is at `offset_m`.
    FaceId face(const dvec3& normal, double offset_m) const {
        for (std::size_t i = 0; i < building.faces.size(); ++i) {
            const Face& f = building.faces[i];
            if (glm::distance(f.normal, normal) < 1e-9 &&
                std::abs(glm::dot(normal, f.plane.origin_m) - offset_m) < 1e-9) {
                return make_id<FaceId>(i);
            }
        }
        FAIL("no such face");
        return {};
    }

    PatchId patch_of(FaceId face) const {
        return grid.patch_at(face, building.faces[index(face)].plane.origin_m);
    }

    double share_of(const FormFactorRow& row, FaceId face) const {
        double sum = 0.0;
        for (std::size_t k = 0; k < row.patches.size(); ++k) {
            if (grid.patches[index(row.patches[k])].face == face) sum += row.values[k];
        }
        return sum;
    }
};

/// Solid with a cubic room of side 1 m at the origin, and nothing else.
Scene unit_cube() {
    Scene scene;
    scene.polyhedra = {box({-1, -1, -1}, {2, 2, 2}, Effect::fill), box({0, 0, 0}, {1, 1, 1}, Effect::carve)};
    return scene;
}

/// A room with a window, a door that stands apart from the walls, and boxes on the floor and in the air.
Scene furnished_room(unsigned seed) {
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    Scene scene;
    scene.polyhedra = {
        box({-0.4, -0.4, -0.4}, {5.4, 4.4, 3.4}, Effect::fill), box({0, 0, 0}, {5, 4, 3}, Effect::carve),
        box({1, -0.5, 0.8}, {3, 0.1, 2.4}, Effect::carve), box({4.9, 1, 2.2}, {5.6, 2, 2.8}, Effect::carve)};
    for (int i = 0; i < 6; ++i) {
        const dvec3 low{uniform(0.1, 4), uniform(0.3, 3), i % 2 == 0 ? -0.1 : uniform(0.2, 1.5)};
        scene.polyhedra.push_back(
            box(low, low + dvec3(uniform(0.1, 0.9), uniform(0.1, 0.9), uniform(0.3, 1.2)), Effect::fill));
    }
    return scene;
}

double sum_of(const FormFactorRow& row) {
    return std::accumulate(row.values.begin(), row.values.end(), row.lost + row.truncated);
}

TEST_CASE("rows of a unit cube average to its known form factors", "[hemicube][visibility][analytic]") {
    const Room room(unit_cube(), 0.125);
    const auto visibility = room.visibility({.resolution = 128});
    const FaceId floor = room.face({0, 0, 1}, 0), ceiling = room.face({0, 0, -1}, -1),
                 wall = room.face({1, 0, 0}, 0);
    double to_ceiling = 0.0, to_wall = 0.0, area_m2 = 0.0;
    FormFactorRow row;
    for (std::size_t i = 0; i < room.grid.patches.size(); ++i) {
        const Patch& patch = room.grid.patches[i];
        if (patch.face != floor) continue;
        visibility->form_factor_row(make_id<PatchId>(i), row);
        to_ceiling += patch.area_m2 * room.share_of(row, ceiling);
        to_wall += patch.area_m2 * room.share_of(row, wall);
        area_m2 += patch.area_m2;
    }
    CHECK(std::abs(area_m2 - 1) < 1e-9);
    // The mean over 8 x 8 centroids instead of the face: 4e-4 opposed and, by the four neighbours, 1e-4
    // adjoining.
    CHECK(std::abs(to_ceiling - opposed_squares) < 5e-4);
    CHECK(std::abs(to_wall - adjoining_squares) < 2e-4);
}

TEST_CASE("with one patch per face a row holds the form factors from the centre of the face",
          "[hemicube][visibility][analytic]") {
    const Room room(unit_cube(), 2);
    REQUIRE(room.grid.gather_patch_count == 6);
    FormFactorRow row;
    for (const ProjectionSurface surface : {ProjectionSurface::hemicube, ProjectionSurface::single_plane}) {
        const auto visibility = room.visibility({.surface = surface, .resolution = 512});
        visibility->form_factor_row(room.patch_of(room.face({0, 0, 1}, 0)), row);
        // Four rectangles of 0.5 x 0.5 at distance 1.
        const double p = std::sqrt(1.25), ceiling = 4 * (0.5 / p * std::atan(0.5 / p)) / pi;
        INFO(visibility->name());
        REQUIRE(row.patches.size() == 5);
        CHECK(std::abs(room.share_of(row, room.face({0, 0, -1}, -1)) - ceiling) <
              1e-4);  // 1/8 cell along four edges
        for (const dvec3& normal : {dvec3(1, 0, 0), dvec3(0, 1, 0)}) {
            CHECK(std::abs(room.share_of(row, room.face(normal, 0)) - (1 - row.truncated - ceiling) / 4) <
                  2e-4);
        }
    }
}

/// A rectangle over the point (0,0,0) and one beside it, lit from below and from the left; the point looks
/// up.
struct Rectangles {
    Room room;
    FaceId parallel, perpendicular;

    static Scene scene() {
        Scene scene;
        scene.polygons.resize(2);
        scene.polygons[0].id = "parallel";
        scene.polygons[0].vertices_m = {{0, 0, 1}, {0, 0.7, 1}, {0.9, 0.7, 1}, {0.9, 0, 1}};
        scene.polygons[1].id = "perpendicular";
        scene.polygons[1].vertices_m = {{-1, 0, 0}, {-1, -1.2, 0}, {-1, -1.2, 0.8}, {-1, 0, 0.8}};
        std::reverse(scene.polygons[1].vertices_m.begin(), scene.polygons[1].vertices_m.end());
        return scene;
    }
    Rectangles()
        : room(scene(), 0.2), parallel(room.face({0, 0, -1}, -1)), perpendicular(room.face({1, 0, 0}, -1)) {}

    static double exact_parallel() {
        const double a = 0.9, b = 0.7, p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
        return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * pi);
    }
    static double exact_perpendicular() {
        const double q = std::sqrt(1 + 0.8 * 0.8);
        return (std::atan(1.2) - std::atan(1.2 / q) / q) / (2 * pi);
    }
};

/// Errors of both rectangles at three resolutions, each 4 times the one before; root mean square over turns.
struct Errors {
    std::array<double, 3> parallel{}, perpendicular{};

    explicit Errors(ProjectionSurface surface) {
        const Rectangles scene;
        for (std::size_t level = 0; level < 3; ++level) {
            const auto visibility =
                scene.room.visibility({.surface = surface, .resolution = 32 << (2 * level)});
            constexpr int turns = 200;
            FormFactorRow row;
            for (int turn = 0; turn < turns; ++turn) {
                // Every point has a turn of its own.
                visibility->gather_row({{1e-9 * turn, 0, 0}, {0, 0, 1}}, row);
                const double a = scene.room.share_of(row, scene.parallel) - Rectangles::exact_parallel();
                const double b =
                    scene.room.share_of(row, scene.perpendicular) - Rectangles::exact_perpendicular();
                parallel[level] += a * a / turns;
                perpendicular[level] += b * b / turns;
            }
            parallel[level] = std::sqrt(parallel[level]);
            perpendicular[level] = std::sqrt(perpendicular[level]);
        }
    }
};

TEST_CASE("the error of a row falls with the resolution", "[hemicube][visibility][convergence]") {
    // Only cells on an outline are wrong, each by a part of its own weight. Where outlines cross the cells at
    // an angle these parts are random: sqrt(n) cells of weight 1 / n^2, so 16 times finer cells err 64 times
    // less.
    const Errors cube(ProjectionSurface::hemicube), plane(ProjectionSurface::single_plane);
    for (const auto& [worst, middle, best] : {cube.parallel, plane.parallel}) {
        INFO("rms errors " << worst << ' ' << middle << ' ' << best);
        CHECK(best < worst / 35);
        CHECK(best > worst / 200);
        CHECK(best < 5e-5);
    }
    // Upright edges follow the columns of a side however it is turned; a column is in or out as a whole: 1 /
    // n, 16 times.
    const auto& [worst, middle, best] = cube.perpendicular;
    INFO("rms errors " << worst << ' ' << middle << ' ' << best);
    CHECK(best < worst / 10);
    CHECK(best > worst / 30);
    CHECK(best < 1e-4);
}

TEST_CASE("what is seen through a hole, from behind or outdoors is lost",
          "[hemicube][visibility][analytic]") {
    const Rectangles scene;
    const auto visibility = scene.room.visibility({.resolution = 512});
    FormFactorRow row;
    visibility->gather_row({{0, 0, 0}, {0, 0, 1}}, row);
    CHECK(std::abs(row.lost - (1 - Rectangles::exact_parallel() - Rectangles::exact_perpendicular())) < 3e-4);
    // From above, the back of the horizontal rectangle hides all that lies below.
    visibility->gather_row({{0.4, 0.4, 1.001}, {0, 0, -1}}, row);
    CHECK(row.patches.empty());
    CHECK(std::abs(row.lost - 1) < 1e-12);

    const Room room(unit_cube(), 1);
    room.visibility()->gather_row({{0.5, 0.5, 3}, {0, 0, -1}}, row);
    CHECK(row.patches.empty());
    CHECK(std::abs(row.lost - 1) < 1e-12);
}

TEST_CASE("rows of a closed room sum to 1, sorted, without the patch itself",
          "[hemicube][visibility][property]") {
    const unsigned seed = GENERATE(range(1u, 5u));
    const Room room(furnished_room(seed), 0.5, {0.3 * seed, {10, -20, 3}});
    INFO("seed " << seed);
    for (const HemicubeOptions& options :
         {HemicubeOptions{.resolution = 64}, HemicubeOptions{.resolution = 64, .random_rotation = false},
          HemicubeOptions{.surface = ProjectionSurface::single_plane, .resolution = 64},
          HemicubeOptions{.surface = ProjectionSurface::single_plane,
          .resolution = 64,
          .half_side_over_height = 2,
          .spacing = CellSpacing::uniform,
          .random_rotation = false}}) {
        const auto visibility = room.visibility(options);
        const double s =
            options.half_side_over_height / std::sqrt(1 + std::pow(options.half_side_over_height, 2));
        const double outside =
            options.surface == ProjectionSurface::hemicube ? 0 : 1 - 4 / pi * s * std::atan(s);
        double worst_sum = 0.0, worst_lost = 0.0, worst_truncated = 0.0;
        bool sorted = true, positive = true, without_itself = true, inside = true;
        FormFactorRow row;
        for (std::size_t i = 0; i < room.grid.gather_patch_count; ++i) {
            const auto from = make_id<PatchId>(i);
            visibility->form_factor_row(from, row);
            worst_sum = std::max(worst_sum, std::abs(sum_of(row) - 1));
            worst_lost = std::max(worst_lost, row.lost);
            worst_truncated = std::max(worst_truncated, std::abs(row.truncated - outside));
            for (std::size_t k = 0; k < row.patches.size(); ++k) {
                sorted = sorted && (k == 0 || row.patches[k - 1] < row.patches[k]);
                positive = positive && row.values[k] > 0;
                without_itself = without_itself && row.patches[k] != from;
                inside = inside && index(row.patches[k]) < room.grid.gather_patch_count;
            }
        }
        CHECK(worst_sum < 1e-12);
        CHECK(worst_lost == 0.0);
        CHECK(worst_truncated < 1e-15);
        CHECK((sorted && positive && without_itself && inside));
    }
}

TEST_CASE("rows of a closed room sum to 1 to 1e-9 whatever becomes of the rim, from many viewpoints, with odd counts",
          "[hemicube][visibility][property]") {
    const Room room(furnished_room(3), 0.7, {0.3, {10, -20, 3}});
    constexpr auto plane = ProjectionSurface::single_plane;
    for (const HemicubeOptions& options :
         {HemicubeOptions{.resolution = 33}, HemicubeOptions{.resolution = 32, .viewpoints = 5},
          HemicubeOptions{.surface = plane, .resolution = 33, .rim = RimShare::strip},
          HemicubeOptions{.surface = plane, .resolution = 32, .half_side_over_height = 1.5, .rim = RimShare::strip},
          HemicubeOptions{.surface = plane, .resolution = 32, .half_side_over_height = 3, .rim = RimShare::renormalised},
          HemicubeOptions{.surface = plane, .resolution = 32, .spacing = CellSpacing::equal_plane_angle}}) {
        const auto visibility = room.visibility(options);
        double worst_sum = 0.0, worst_lost = 0.0;
        FormFactorRow row;
        for (std::size_t i = 0; i < room.grid.gather_patch_count; i += 3) {
            visibility->form_factor_row(make_id<PatchId>(i), row);
            worst_sum = std::max(worst_sum, std::abs(sum_of(row) - 1));
            worst_lost = std::max(worst_lost, row.lost);
        }
        INFO(options.resolution << " cells, " << options.viewpoints << " viewpoints, rim " << static_cast<int>(options.rim));
        CHECK(worst_sum < 1e-9);
        CHECK(worst_lost == 0.0);
    }
}

TEST_CASE("the strip below the rim makes a single plane see what the hemi-cube sees", "[hemicube][visibility]") {
    const Room room(unit_cube(), 2);
    const auto share_of_walls = [&](const HemicubeOptions& options) {
        FormFactorRow row;
        room.visibility(options)->form_factor_row(room.patch_of(room.face({0, 0, 1}, 0)), row);
        return room.share_of(row, room.face({1, 0, 0}, 0));
    };
    HemicubeOptions plane{.surface = ProjectionSurface::single_plane, .resolution = 512, .half_side_over_height = 3};
    const double cube = share_of_walls({.resolution = 512}), left_out = share_of_walls(plane);
    plane.rim = RimShare::strip;
    CHECK(std::abs(share_of_walls(plane) - cube) < 2e-4);  // aliasing, as in the test of the cube's form factors
    CHECK(left_out < cube - 0.01);                        // a quarter of the 8.2 % that pass below d/h = 3
}

TEST_CASE("viewpoints spread over a patch average its form factor", "[hemicube][visibility][convergence]") {
    const Room room(unit_cube(), 2);
    const auto to_ceiling = [&](int viewpoints) {
        FormFactorRow row;
        room.visibility({.resolution = 128, .viewpoints = viewpoints})
            ->form_factor_row(room.patch_of(room.face({0, 0, 1}, 0)), row);
        return std::abs(room.share_of(row, room.face({0, 0, -1}, -1)) - opposed_squares);
    };
    const double one = to_ceiling(1), four = to_ceiling(4), many = to_ceiling(64);
    INFO("errors " << one << ' ' << four << ' ' << many);
    CHECK(one > 0.03);  // 0.2395 from the centre
    CHECK(four < 0.5 * one);
    CHECK(many < 1e-3);  // boundary strata of 64 points, 1 / 64 of 0.04
}

TEST_CASE("a row gathered where first seen facets were asked for has the same bits as any other", "[hemicube][visibility]") {
    const Room room(furnished_room(2), 0.6);
    for (const ProjectionSurface surface : {ProjectionSurface::hemicube, ProjectionSurface::single_plane}) {
        const HemicubeOptions options{.surface = surface, .resolution = 48};
        const auto asked = room.visibility(options), fresh = room.visibility(options);
        const GatherPoint point{{2.1, 1.7, 0.85}, {0, 0, 1}};
        const dvec3 directions[] = {{0, 0, 1}, glm::normalize(dvec3(0.1, -1, 0.2)), glm::normalize(dvec3(1, 0, 0.1))};
        FacetId seen[3];
        asked->first_seen(point, directions, seen);
        FormFactorRow after, expected;
        asked->gather_row(point, after);
        fresh->gather_row(point, expected);
        CHECK(after.patches == expected.patches);
        CHECK(after.values == expected.values);
        CHECK(after.lost == expected.lost);
    }
}

TEST_CASE("a row's cells fall on the patches that rays through their centres meet",
          "[hemicube][visibility][property]") {
    const Room room(furnished_room(7), 0.4);
    constexpr int n = 32;
    const auto visibility = room.visibility({.resolution = n, .random_rotation = false});
    // Axes of a hemi-cube on the floor that is not turned follow the face.
    const FaceId floor = room.face({0, 0, 1}, 0);
    const dvec3 normal{0, 0, 1}, tangent = glm::normalize(room.building.faces[index(floor)].frame.u_m),
                                 bitangent = glm::cross(normal, tangent);
    FormFactorRow row;
    double compared = 0.0;
    for (std::size_t i = 0; i < room.grid.indoor_patch_count; i += 3) {
        const Patch& patch = room.grid.patches[i];
        if (patch.face != floor) continue;
        visibility->form_factor_row(make_id<PatchId>(i), row);
        std::vector<double> expected(room.grid.patches.size(), 0.0), doubtful(room.grid.patches.size(), 0.0);
        const auto add = [&](const dvec3& direction, double weight) {
            const tests::RayHit hit =
                tests::cast_ray(room.building, patch.centroid_m, glm::normalize(direction), true);
            REQUIRE(hit.facet != FacetId::none);
            const dvec3 point_m = patch.centroid_m + hit.distance * glm::normalize(direction);
            const FaceId face = room.building.facets[index(hit.facet)].face;
            const PatchId seen = room.grid.patch_at(face, point_m);
            expected[index(seen)] += weight;
            compared += weight;
            // A centre on the line between two patches or facets may count to either.
            if (hit.edge_margin_rad < 1e-6) {
                for (double& share : doubtful)
                    share += weight;
            }
            const PlaneFrame& plane = room.building.faces[index(face)].plane;
            for (const dvec3& step : {plane.x, plane.y, -plane.x, -plane.y}) {
                const PatchId beside = room.grid.patch_at(face, point_m + 1e-6 * step);
                if (beside == seen) continue;
                doubtful[index(seen)] += weight;
                doubtful[index(beside)] += weight;
            }
        };
        // Weights of cells by the midpoint rule with 8 x 8 points: 1e-5 relative at this resolution.
        const auto weight = [&](double x, double y, bool top) {
            double sum = 0.0;
            for (int a = 0; a < 8; ++a) {
                for (int b = 0; b < 8; ++b) {
                    const double u = x + ((a + 0.5) / 8 - 0.5) * 2 / n, v = y + ((b + 0.5) / 8 - 0.5) * 2 / n;
                    sum += (top ? 1 : v) / (pi * std::pow(1 + u * u + v * v, 2)) * 4 / (64.0 * n * n);
                }
            }
            return sum;
        };
        for (int a = 0; a < n; ++a) {
            for (int b = 0; b < n; ++b) {
                const double x = -1 + (a + 0.5) * 2 / n, y = -1 + (b + 0.5) * 2 / n;
                add(normal + x * tangent + y * bitangent, weight(x, y, true));
                if (b >= n / 2) continue;
                const double z = (b + 0.5) * 2 / n;
                for (const dvec3& side : {tangent, bitangent, -tangent, -bitangent}) {
                    add(side + x * glm::cross(normal, side) + z * normal, weight(x, z, false));
                }
            }
        }
        std::vector<double> got(room.grid.patches.size(), 0.0);
        for (std::size_t k = 0; k < row.patches.size(); ++k)
            got[index(row.patches[k])] = row.values[k];
        int moved = 0;
        for (std::size_t k = 0; k < got.size(); ++k)
            moved += std::abs(got[k] - expected[k]) > 1e-4 * expected[k] + doubtful[k];
        CHECK(moved == 0);
    }
    CHECK(compared > 3);
}

TEST_CASE("a room that is turned and moved keeps its form factors", "[hemicube][visibility][property]") {
    const Placement placement{1.1, {100, -300, 20}};
    const Room room(furnished_room(2), 0.5), moved(furnished_room(2), 0.5, placement);
    REQUIRE(room.building.faces.size() == moved.building.faces.size());
    // The projection follows the face, so that the same cells show the same faces but for rounding at their
    // edges.
    const HemicubeOptions options{.resolution = 128, .random_rotation = false};
    const auto here = room.visibility(options), there = moved.visibility(options);
    double worst = 0.0;
    int compared = 0;
    FormFactorRow a, b;
    for (std::size_t i = 0; i < room.grid.indoor_patch_count; i += 7) {
        const Patch& patch = room.grid.patches[i];
        const PatchId same = moved.grid.patch_at(patch.face, placement(patch.centroid_m));
        // A cell that is not convex may have been cut along another line.
        if (glm::distance(moved.grid.patches[index(same)].centroid_m, placement(patch.centroid_m)) > 1e-6)
            continue;
        ++compared;
        here->form_factor_row(make_id<PatchId>(i), a);
        there->form_factor_row(same, b);
        for (std::size_t f = 0; f < room.building.faces.size(); ++f) {
            const auto face = make_id<FaceId>(f);
            worst = std::max(worst, std::abs(room.share_of(a, face) - moved.share_of(b, face)));
        }
    }
    CHECK(compared > 60);
    // An edge that runs exactly through cell centres may tip over: at most one line of 128 cells of 8e-5
    // each.
    CHECK(worst < 128 * 8e-5);
}

TEST_CASE("rows drawn by 1, 2, 3 and 8 threads have the same bits", "[hemicube][visibility][threads]") {
    const Room room(furnished_room(3), 0.7);
    for (const ProjectionSurface surface : {ProjectionSurface::hemicube, ProjectionSurface::single_plane}) {
        const auto visibility = room.visibility({.surface = surface, .resolution = 32});
        const std::size_t count = room.grid.gather_patch_count;
        const auto rows_by = [&](std::size_t threads) {
            std::vector<FormFactorRow> rows(count);
            std::vector<std::jthread> workers;
            for (std::size_t t = 0; t < threads; ++t) {
                workers.emplace_back([&, t] {
                    for (std::size_t i = t; i < count; i += threads)
                        visibility->form_factor_row(make_id<PatchId>(i), rows[i]);
                });
            }
            return workers.clear(), rows;
        };
        const std::vector<FormFactorRow> expected = rows_by(1);
        for (const std::size_t threads : {2u, 3u, 8u}) {
            const std::vector<FormFactorRow> rows = rows_by(threads);
            bool same = true;
            for (std::size_t i = 0; i < count; ++i) {
                same = same && rows[i].patches == expected[i].patches && rows[i].lost == expected[i].lost &&
                       std::memcmp(rows[i].values.data(), expected[i].values.data(),
                                   rows[i].values.size() * sizeof(double)) == 0;
            }
            CHECK(same);
        }
    }
}

TEST_CASE("another seed turns the projection, the same seed does not", "[hemicube][visibility]") {
    const Room room(unit_cube(), 0.25);
    const auto row_with = [&](const HemicubeOptions& options) {
        FormFactorRow row;
        room.visibility(options)->form_factor_row(make_id<PatchId>(5), row);
        return row.values;
    };
    CHECK(row_with({.resolution = 32, .seed = 1}) == row_with({.resolution = 32, .seed = 1}));
    CHECK(row_with({.resolution = 32, .seed = 1}) != row_with({.resolution = 32, .seed = 2}));
    CHECK(row_with({.resolution = 32, .random_rotation = false, .seed = 1}) ==
          row_with({.resolution = 32, .random_rotation = false, .seed = 2}));
}

TEST_CASE("first seen facets are those that rays meet, to within a cell",
          "[hemicube][visibility][property]") {
    const Room room(furnished_room(4), 1);
    constexpr int n = 128;
    for (const HemicubeOptions& options :
         {HemicubeOptions{.resolution = n},
          HemicubeOptions{.surface = ProjectionSurface::single_plane, .resolution = n},
          HemicubeOptions{.surface = ProjectionSurface::single_plane,
          .resolution = n,
          .half_side_over_height = 1.5,
          .spacing = CellSpacing::uniform}}) {
        const auto visibility = room.visibility(options);
        std::mt19937_64 random(5);
        const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
        std::vector<dvec3> directions;
        const dvec3 normal = glm::normalize(dvec3(0.2, -0.9, 0.1));
        while (directions.size() < 3000) {
            const dvec3 d{uniform(), uniform(), uniform()};
            if (glm::length(d) < 1 && glm::dot(d, normal) > 0) directions.push_back(glm::normalize(d));
        }
        const GatherPoint point{{2.1, 1.7, 1.9}, normal};
        std::vector<FacetId> seen(directions.size());
        visibility->first_seen(point, directions, seen);
        int wrong = 0, open = 0;
        for (std::size_t k = 0; k < directions.size(); ++k) {
            const tests::RayHit hit = tests::cast_ray(room.building, point.position_m, directions[k]);
            open += hit.facet == FacetId::none;
            // Half the diagonal of the largest cell: 0.03 rad for the article's cells, which are widest in
            // the middle of the plane and near its corners.
            const double cell_rad =
                options.spacing == CellSpacing::uniform || options.surface == ProjectionSurface::hemicube
                    ? 0.018
                    : 0.06;
            if (hit.edge_margin_rad > cell_rad) wrong += seen[k] != hit.facet;
        }
        INFO(visibility->name() << ", d/h " << options.half_side_over_height);
        CHECK(wrong == 0);
        CHECK(open > 20);  // through the windows
        // What was asked before does not matter: another point, then the first again, one by one in another
        // order.
        const GatherPoint elsewhere{{1, 1, 1.3}, normal};
        std::vector<FacetId> seen_elsewhere(directions.size()), expected(directions.size());
        visibility->first_seen(elsewhere, directions, seen_elsewhere);
        room.visibility(options)->first_seen(elsewhere, directions, expected);
        CHECK(seen_elsewhere == expected);
        CHECK(seen_elsewhere != seen);
        for (std::size_t k = directions.size(); k-- > 0;) {
            FacetId again{};
            visibility->first_seen(point, {&directions[k], 1}, {&again, 1});
            REQUIRE(again == seen[k]);
        }
    }
}

TEST_CASE("every pixel shows the facet that a ray through its centre meets", "[hemicube][view][visibility]") {
    const Room room(furnished_room(6), 1);
    const View view{.id = "",
                    .from_m = {4.7, 3.6, 1.7},
                    .to_m = {1, 0.3, 1.2},
                    .field_of_view_rad = 1.4,
                    .width = 150,
                    .height = 101};
    const Camera camera = make_camera(view);
    std::vector<FacetId> seen(150 * 101);
    room.visibility()->view_facets(camera, 0, view.height, seen);
    int wrong = 0, undecided = 0, open = 0;
    for (int row = 0; row < view.height; ++row) {
        for (int column = 0; column < view.width; ++column) {
            const tests::RayHit hit =
                tests::cast_ray(room.building, view.from_m, camera.ray(column + 0.5, row + 0.5).direction);
            const FacetId shown = seen[static_cast<std::size_t>(row * view.width + column)];
            open += shown == FacetId::none;
            if (hit.edge_margin_rad < 1e-6) {
                ++undecided;
            } else {
                wrong += shown != hit.facet;
            }
        }
    }
    CHECK(wrong == 0);
    CHECK(undecided < 10);
    CHECK(open > 0);
}

TEST_CASE("apertures take part in rows and let first seen directions pass", "[hemicube][visibility]") {
    const Room room(furnished_room(1), 0.5);
    const auto visibility = room.visibility({.resolution = 64});
    const Aperture& window = room.building.apertures.front();
    const GatherPoint point{window.centroid_m + 0.3 * window.normal, -window.normal};
    FormFactorRow row;
    visibility->gather_row(point, row);
    CHECK(room.share_of(row, window.face) > 0.5);
    const dvec3 outwards = -window.normal;
    FacetId seen{};
    visibility->first_seen(point, {&outwards, 1}, {&seen, 1});
    CHECK(seen == FacetId::none);
}

TEST_CASE("options out of range are refused", "[hemicube][visibility]") {
    const Room room(unit_cube(), 1);
    for (const int resolution : {0, 4097, -2})
        CHECK_THROWS_AS(room.visibility({.resolution = resolution}), InputError);
    for (const double d_h : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        CHECK_THROWS_AS(
            room.visibility({.surface = ProjectionSurface::single_plane, .half_side_over_height = d_h}),
            InputError);
    }
}

TEST_CASE("settings name every option", "[hemicube][visibility]") {
    const Room room(unit_cube(), 1);
    const auto visibility = room.visibility({.surface = ProjectionSurface::single_plane,
                                             .resolution = 64,
                                             .half_side_over_height = 10,
                                             .spacing = CellSpacing::uniform,
                                             .random_rotation = false,
                                             .seed = 9});
    const std::vector<std::pair<std::string, std::string>> expected{
        {"surface", "single_plane"}, {"resolution", "64"},         {"half_side_over_height", "10"},
        {"spacing", "uniform"},      {"rim", "left_out"},          {"viewpoints", "1"},
        {"random_rotation", "false"}, {"seed", "9"},
        // In the middle of the plane: atan(0.3125 / sqrt(1 + 0.15625^2)).
        {"widest_cell_deg", "17.16"}};
    CHECK(visibility->settings() == expected);
    CHECK(visibility->name() == "single_plane");
}

}  // namespace
}  // namespace naturel
