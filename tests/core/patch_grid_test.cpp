#include "core/patch_grid.h"

#include <glm/geometric.hpp>
#include <filesystem>
#include <random>

#include "core/errors.h"
#include "core/light_zones.h"
#include "core/scene_reader.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

bool inside(const PatchGrid& grid, PatchId patch, const dvec3& p, double slack_m) {
    const auto polygon = grid.polygon_of(patch);
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec3 edge = polygon[(i + 1) % polygon.size()] - polygon[i];
        if (glm::dot(glm::cross(grid.patches[index(patch)].normal, edge), p - polygon[i]) < -slack_m * glm::length(edge)) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("a room of 4 x 5 x 3 m at 0.5 m has the cells one expects", "[core][grid]") {
    const Building building = assemble(closed_room({4, 5, 3}));
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.5, .outdoor_spacing_m = 2.0});
    CHECK(grid.indoor_patch_count == 2 * (8 * 10 + 8 * 6 + 10 * 6));
    CHECK(grid.gather_patch_count == grid.indoor_patch_count);
    CHECK(grid.nodes.size() == 2 * (9 * 11 + 9 * 7 + 11 * 7));
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) CHECK_THAT(grid.patches[p].area_m2, WithinRel(0.25, 1e-9));
}

TEST_CASE("nodes on an outline gather from inside the room, others from where they are", "[core][grid]") {
    const Building building = assemble(closed_room({4, 5, 3}, 0.5, 1.0));
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 1.0});
    int moved = 0;
    for (const Node& node : grid.nodes) {
        const dvec3 shift = node.gather_position_m - node.position_m;
        const dvec3 g = node.gather_position_m;
        CHECK(glm::length(shift) <= 1e-3 * (1 + 1e-12));
        const int on_walls = (g.x < 1e-9) + (g.x > 4 - 1e-9) + (g.y < 1e-9) + (g.y > 5 - 1e-9) + (g.z < 1 + 1e-9) + (g.z > 4 - 1e-9);
        CHECK(on_walls == 1);  // its own face, no other
        moved += glm::length(shift) > 0 ? 1 : 0;
    }
    CHECK(moved == 2 * (2 * (4 + 5) + 2 * (4 + 3) + 2 * (5 + 3)));
}

TEST_CASE("patches of random buildings tile what is left of each face", "[core][grid][property]") {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        INFO("seed " << seed);
        const Scene scene = random_scene(seed, 12, seed % 2 == 0 ? Placement::free : Placement::lattice, 0.5);
        const Building building = assemble(scene);
        const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.4, .outdoor_spacing_m = 0.7});
        std::vector<double> area(building.faces.size());
        for (const Patch& patch : grid.patches) area[index(patch.face)] += patch.area_m2;
        for (std::size_t f = 0; f < building.faces.size(); ++f) {
            const double expected = area_m2(building.faces[f].region);
            // Pieces below 1e-6 of a cell are dropped, some hundred cells have such pieces at worst.
            CHECK_THAT(area[f], WithinAbs(expected, 1e-4 * 0.16 + 1e-7 * expected));
        }
        // A random point of a facet is in the patch that the lookup names.
        std::mt19937_64 random(seed);
        for (const Facet& facet : building.facets) {
            for (int i = 0; i < 5; ++i) {
                double a = uniform(random), b = uniform(random);
                if (a + b > 1) a = 1 - a, b = 1 - b;
                const std::size_t k = 1 + random() % (facet.vertices_m.size() - 2);
                const dvec3 p = (1 - a - b) * facet.vertices_m[0] + a * facet.vertices_m[k] + b * facet.vertices_m[k + 1];
                const PatchId patch = grid.patch_at(facet.face, p);
                if (patch == PatchId::none) {
                    CHECK(area[index(facet.face)] == 0.0);
                    continue;
                }
                CHECK((grid.patches[index(patch)].face == facet.face));
                // Or beside it, in a dropped piece: below 1.6e-7 m2, a needle of that area may be some mm long.
                CHECK(inside(grid, patch, p, 5e-3));
            }
        }
    }
}

TEST_CASE("interpolation weights reproduce linear functions and are linear along edges", "[core][grid]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back({.id = "wedge",
                               .kind = PolyhedronKind::prism,
                               .effect = Effect::fill,
                               .vertices_m = {dvec3(1, 1, 0), dvec3(2.3, 1.2, 0), dvec3(1.4, 2.9, 0), dvec3(1, 1, 1)},
                               .material = MaterialId{}});
    const PatchGrid grid = make_patch_grid(assemble(scene), {.spacing_m = 0.6});
    std::mt19937_64 random(7);
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) {
        const auto polygon = grid.polygon_of(make_id<PatchId>(p));
        std::vector<double> weights(polygon.size());
        const auto check_point = [&](const dvec3& point) {
            grid.interpolation_weights(make_id<PatchId>(p), point, weights);
            dvec3 sum{};
            double total = 0;
            for (std::size_t i = 0; i < weights.size(); ++i) {
                CHECK(weights[i] >= 0.0);
                sum += weights[i] * polygon[i];
                total += weights[i];
            }
            CHECK_THAT(total, WithinAbs(1.0, 1e-12));
            CHECK(glm::distance(sum, point) < 1e-7);
        };
        check_point(grid.patches[p].centroid_m);
        check_point(polygon[0]);
        check_point(0.3 * polygon[0] + 0.7 * polygon[1]);
        check_point(0.2 * polygon[0] + 0.3 * polygon[1] + 0.5 * polygon[2]);
    }
}

TEST_CASE("the two sides of an inner aperture have patches in pairs", "[core][grid]") {
    Scene scene = closed_room({4, 5, 3});
    scene.glazings.push_back({.name = "pane"});
    Polyhedron second = box("second", Effect::carve, {4, 1, 1}, {4.25, 2, 2});
    second.faces[4].glazing = make_id<GlazingId>(1);
    scene.polyhedra.push_back(second);
    const PatchGrid grid = make_patch_grid(assemble(scene), {.spacing_m = 0.3});
    std::size_t pairs = 0;
    for (std::size_t p = 0; p < grid.patches.size(); ++p) {
        const PatchId behind = grid.behind(make_id<PatchId>(p));
        if (behind == PatchId::none) continue;
        ++pairs;
        CHECK((grid.behind(behind) == make_id<PatchId>(p)));
        CHECK(glm::distance(grid.patches[index(behind)].centroid_m, grid.patches[p].centroid_m) < 1e-9);
        CHECK(glm::distance(grid.patches[index(behind)].normal, -grid.patches[p].normal) < 1e-12);
    }
    CHECK(pairs == grid.gather_patch_count - grid.indoor_patch_count);
    CHECK(pairs == 2 * 16);
}

namespace {

// A room with a window, a desk and a sun that lights floor, desk and a wall.
Scene sunlit_room() {
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    scene.polyhedra.push_back(box("desk", Effect::fill, {1, 1.1, 0.95}, {2.53, 1.87, 1.05}));
    scene.sun = SunDescription{.altitude_rad = 0.6, .azimuth_rad = 2.7, .direct_normal_illuminance_lx = 60000.0};
    return scene;
}

}  // namespace

TEST_CASE("patches follow sunspots and umbra zones exactly", "[core][grid][zones]") {
    const Scene scene = sunlit_room();
    const Building building = assemble(scene);
    const LightZones zones = find_light_zones(scene, building);
    const int levels = GENERATE(0, 2);
    GridOptions options{.spacing_m = GENERATE(0.15, 0.4, 1.3), .outdoor_spacing_m = 2.0};
    options.refine.levels = levels;
    INFO(options.spacing_m << " m, " << levels << " levels of refinement");
    const PatchGrid grid = make_patch_grid(building, options, zones);
    REQUIRE(grid.follows_zones);
    double spots_m2 = 0, umbra_m2 = 0, flux_lm = 0;
    for (std::size_t f = 0; f < building.faces.size(); ++f) {
        for (const Sunspot& spot : zones.sunspots[f]) {
            spots_m2 += area_m2(spot.region);
            flux_lm += area_m2(spot.region) * spot.illuminance_lx.g;
        }
        umbra_m2 += area_m2(zones.umbra[f]);
    }
    REQUIRE(spots_m2 > 1.0);
    REQUIRE(umbra_m2 > 1.0);
    double in_spots = 0, in_umbra = 0, sun_lm = 0;
    for (const Patch& patch : grid.patches) {
        if (patch.sunspot != no_sunspot) {
            in_spots += patch.area_m2;
            sun_lm += patch.area_m2 * grid.sunspot_illuminance_lx[patch.sunspot].g;
        }
        if (patch.umbra) in_umbra += patch.area_m2;
    }
    // What is dropped: pieces below 1e-6 of a cell; corners are rounded to 1 nm.
    CHECK_THAT(in_spots, WithinRel(spots_m2, 1e-6));
    CHECK_THAT(in_umbra, WithinRel(umbra_m2, 1e-6));
    CHECK_THAT(sun_lm, WithinRel(flux_lm, 1e-6));
}

TEST_CASE("patches are convex and share all corners on their common edges", "[core][grid][zones][property]") {
    Scene scene = sunlit_room();
    GridOptions options{.spacing_m = GENERATE(0.23, 0.5), .outdoor_spacing_m = 2.0};
    options.refine.levels = GENERATE(0, 1, 2);
    INFO(options.spacing_m << " m, " << options.refine.levels << " levels");
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, options, find_light_zones(scene, building));
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) {
        const Patch& patch = grid.patches[p];
        const auto polygon = grid.polygon_of(make_id<PatchId>(p));
        for (std::size_t k = 0; k < polygon.size(); ++k) {
            const dvec3 a = polygon[k], b = polygon[(k + 1) % polygon.size()], c = polygon[(k + 2) % polygon.size()];
            // No dent beyond the 100 nm within which corners are one.
            CHECK(glm::dot(patch.normal, glm::cross(b - a, c - b)) > -1e-7 * glm::length(c - a));
            // No corner of another patch strictly inside the edge.
            const double length = glm::length(b - a);
            for (const Node& node : grid.nodes) {
                if (node.face != patch.face) continue;
                const double along = glm::dot(node.position_m - a, b - a) / length;
                if (along < 1e-6 || along > length - 1e-6) continue;
                const double off = glm::length(node.position_m - a - along / length * (b - a));
                if (off < 5e-9) FAIL("a node lies on an edge of patch " << p << " which has no corner there");
            }
        }
    }
}

TEST_CASE("slivers are joined with a neighbour of the same zone", "[core][grid][zones]") {
    // Cells of 0.5 m; the second block leaves strips of 1 mm to 2 cm in the cells around it.
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("block", Effect::fill, {1.02, 1.001, 0}, {2.48, 2.499, 1}));
    const Building building = assemble(scene);
    GridOptions options{.spacing_m = 0.5};
    const PatchGrid joined = make_patch_grid(building, options);
    options.sliver_area = 0.0;
    options.sliver_aspect = 1e6;
    const PatchGrid cut = make_patch_grid(building, options);
    const auto smallest = [](const PatchGrid& grid) {
        double area = 1e9;
        for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) area = std::min(area, grid.patches[p].area_m2);
        return area;
    };
    CHECK(smallest(cut) < 1e-3);
    CHECK(smallest(joined) > 0.02);
    CHECK(joined.indoor_patch_count < cut.indoor_patch_count);
    const auto floor_area = [&](const PatchGrid& grid) {
        double area = 0;
        for (const Patch& patch : grid.patches)
            if (building.faces[index(patch.face)].name == "room/bottom") area += patch.area_m2;
        return area;
    };
    CHECK_THAT(floor_area(joined), WithinRel(20.0 - 1.46 * 1.498, 1e-9));
    CHECK_THAT(floor_area(cut), WithinRel(20.0 - 1.46 * 1.498, 1e-9));
}

TEST_CASE("refinement divides cells at zone edges and near the window, nothing else", "[core][grid][zones]") {
    const Scene scene = sunlit_room();
    const Building building = assemble(scene);
    const LightZones zones = find_light_zones(scene, building);
    GridOptions options{.spacing_m = 0.5, .outdoor_spacing_m = 2.0};
    const std::size_t coarse = make_patch_grid(building, options, zones).indoor_patch_count;
    options.refine = {.levels = 1, .contrast = 1.0};
    const std::size_t edges = make_patch_grid(building, options, zones).indoor_patch_count;
    options.refine.contrast = 0.3;
    const std::size_t both = make_patch_grid(building, options, zones).indoor_patch_count;
    options.refine.levels = 0;
    options.spacing_m = 0.25;
    const std::size_t fine = make_patch_grid(building, options, zones).indoor_patch_count;
    CHECK(coarse < edges);
    CHECK(edges < both);
    CHECK(both < fine);
}

TEST_CASE("a grid of more than ten million cells is refused before it takes memory", "[core][grid]") {
    const auto complaint = [](const Scene& scene, const GridOptions& options) {
        try {
            make_patch_grid(assemble(scene), options);
        } catch (const InputError& fault) {
            return std::string(fault.what());
        }
        return std::string();
    };
    const auto says = [](const std::string& text, std::string_view part) {
        UNSCOPED_INFO(text);
        return text.find(part) != std::string::npos;
    };
    const Scene room = closed_room({4, 4, 3});
    CHECK(complaint(room, {.spacing_m = 0.05}).empty());
    CHECK(says(complaint(room, {.spacing_m = 0.001}), "\"spacing_m\" of \"grid\" larger"));
    CHECK(says(complaint(room, {.spacing_m = 1.0, .outdoor_spacing_m = 0.001}), "\"outdoor_spacing_m\""));
    // 80 m2 at 0.1 m are 8000 cells; divided four times, 256 times as many.
    CHECK(complaint(room, {.spacing_m = 0.1, .refine = {.levels = 4}}).empty());
    CHECK(says(complaint(room, {.spacing_m = 0.03, .refine = {.levels = 4}}), "\"levels\" of \"refine\" smaller"));

    // 360 m2, that is 400 000 squares of 3 cm, but 12 million cells, because a cell is no wider than its face.
    Scene ribbon = empty_scene();
    ribbon.polyhedra = {box("ribbon", Effect::fill, {0, 0, 1}, {90000, 0.001, 1.001})};
    CHECK(says(complaint(ribbon, {.spacing_m = 1.0, .outdoor_spacing_m = 0.03}), "on face \"ribbon/"));

    // Two arms of 3 m2 along the sides of a square of 9 km2.
    Scene corner = empty_scene();
    corner.polygons = {{.id = "corner",
                        .vertices_m = {{0, 0, 1}, {3000, 0, 1}, {3000, 0.001, 1},
                                       {0.001, 0.001, 1}, {0.001, 3000, 1}, {0, 3000, 1}}}};
    CHECK(says(complaint(corner, {.spacing_m = 0.25}), "on face \"corner\""));
}

namespace {

/// Nodes whose light would be gathered inside matter.
std::size_t nodes_in_solids(const Scene& scene, const Building& building, const PatchGrid& grid) {
    std::size_t count = 0;
    for (const Node& node : grid.nodes) {
        const glm::dvec3 place = node.gather_position_m + 1e-5 * building.faces[index(node.face)].normal;
        if (medium_at(scene, place) != Medium::indoor_air) ++count;
    }
    return count;
}

}  // namespace

TEST_CASE("light of a node is gathered in the air, at inner corners of a face, too", "[grid][property]") {
    const auto seed = GENERATE(range(1u, 13u));
    CAPTURE(seed);
    Scene scene = empty_scene();
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, 0}, {5.3, 6.3, 3.4}),
                       box("room", Effect::carve, {0, 0, 0.3}, {5, 6, 3.1})};
    std::mt19937_64 random(seed);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>{low, high}(random); };
    for (int k = 0; k < 4; ++k) {
        // On the floor, some against a wall, with sides that do not fit the cells.
        const double x = k == 0 ? 4.4 : between(0.2, 4), y = between(0.2, 5);
        scene.polyhedra.push_back(box("box " + std::to_string(k), Effect::fill, {x, y, 0.3},
                                      {k == 0 ? 5.0 : x + between(0.1, 0.8), y + between(0.1, 0.8), between(0.6, 3.1)}));
    }
    scene.grid.spacing_m = between(0.2, 0.6);
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    CHECK(nodes_in_solids(scene, building, grid) == 0);
}

TEST_CASE("light of a node is gathered in the air of every shipped scene", "[grid][property]") {
    // Among them needles of patches, a fifth of a millimetre wide at some of their corners.
    for (const auto& file : std::filesystem::directory_iterator(NATUREL_SOURCE_DIR "/scenes")) {
        if (file.path().extension() != ".json") continue;
        CAPTURE(file.path().filename().string());
        const Scene scene = read_scene(file.path());
        const Building building = assemble(scene);
        const PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building));
        CHECK(nodes_in_solids(scene, building, grid) == 0);
    }
}
