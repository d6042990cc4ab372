#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <vector>

#include "core/building.h"
#include "core/polyhedra.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

struct Totals {
    dvec3 indoor_normals{}, solid_normals{};
    double indoor_area = 0, solid_area = 0, solid_volume = 0;
};

// Sums over the boundary of indoor air (with its apertures) and of solid (normals point away from it, into the air).
Totals boundary_totals(const Building& building) {
    Totals t;
    for (const Facet& facet : building.facets) {
        const dvec3 vector_area = facet.area_m2 * facet.normal;
        if (facet.environment == Environment::indoor) t.indoor_normals += vector_area, t.indoor_area += facet.area_m2;
        if (!facet.is_aperture) {
            t.solid_normals += vector_area, t.solid_area += facet.area_m2;
            t.solid_volume += glm::dot(vector_area, facet.vertices_m[0]) / 3.0;
        }
    }
    // The outdoor side of an aperture closes indoor air only; nothing to add.
    return t;
}

Medium medium_of(Environment environment) {
    return environment == Environment::indoor ? Medium::indoor_air : Medium::outdoor_air;
}

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

dvec3 point_in(const Facet& facet, std::mt19937_64& random) {
    // A triangle of the fan, chosen by area, and a point away from its edges.
    const auto twice_area = [&](std::size_t k) {
        return glm::length(glm::cross(facet.vertices_m[k] - facet.vertices_m[0], facet.vertices_m[k + 1] - facet.vertices_m[0]));
    };
    double left = uniform(random) * 2.0 * facet.area_m2;
    std::size_t k = 1;
    while (k + 2 < facet.vertices_m.size() && left > twice_area(k)) left -= twice_area(k++);
    double a = uniform(random), b = uniform(random);
    if (a + b > 1) a = 1 - a, b = 1 - b;
    const dvec3 inner = (1 - a - b) * facet.vertices_m[0] + a * facet.vertices_m[k] + b * facet.vertices_m[k + 1];
    const dvec3 middle = (facet.vertices_m[0] + facet.vertices_m[k] + facet.vertices_m[k + 1]) / 3.0;
    return 0.95 * inner + 0.05 * middle;
}

}  // namespace

TEST_CASE("a room carved into a block has six facets facing inwards", "[core][assembly]") {
    const Building building = assemble(closed_room({4, 5, 3}, 0.5, 1.0));
    std::size_t indoor = 0;
    for (const Facet& facet : building.facets) indoor += facet.environment == Environment::indoor ? 1 : 0;
    CHECK(indoor == 6);
    CHECK(building.facets.size() == 12);
    CHECK(building.apertures.empty());
    CHECK_THAT(building.indoor_air_volume_m3, WithinRel(60.0, 1e-12));
    CHECK(building.faces[index(building.facets[0].face)].name.substr(0, 8) == "building");
}

TEST_CASE("a block on the ground has no facet underneath", "[core][assembly]") {
    Scene scene = empty_scene();
    scene.polyhedra = {box("block", Effect::fill, {0, 0, 0}, {2, 2, 2})};
    const Building building = assemble(scene);
    CHECK(building.facets.size() == 5);
    for (const Facet& facet : building.facets) CHECK(facet.normal.z > -0.5);
}

TEST_CASE("a window box that pokes through the wall leaves reveals and an aperture in the facade", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    Polyhedron window = box("window", Effect::carve, {1, -0.9, 1}, {3, 0, 2});
    scene.glazings.push_back({.name = "glass", .normal_transmittance = grey(0.8)});
    window.glazing = make_id<GlazingId>(1);
    scene.polyhedra.push_back(window);
    const Building building = assemble(scene);
    REQUIRE(building.apertures.size() == 1);
    const Aperture& aperture = building.apertures[0];
    CHECK(aperture.name == "window");
    CHECK(index(aperture.glazing) == 1);
    CHECK_FALSE(aperture.inner);
    CHECK_THAT(aperture.area_m2, WithinRel(2.0, 1e-12));
    CHECK(glm::distance(aperture.normal, dvec3(0, 1, 0)) < 1e-12);
    CHECK(glm::distance(aperture.centroid_m, dvec3(2, -0.3, 1.5)) < 1e-12);
    std::size_t reveals = 0;
    for (const Facet& facet : building.facets) {
        const std::string& name = building.faces[index(facet.face)].name;
        if (name.starts_with("window/") && !facet.is_aperture) {
            ++reveals;
            CHECK((facet.environment == Environment::indoor));
            CHECK_THAT(facet.area_m2, WithinRel(facet.normal.x != 0.0 ? 0.3 : 0.6, 1e-12));
        }
    }
    CHECK(reveals == 4);
    CHECK_THAT(building.indoor_air_volume_m3, WithinRel(60.0 + 0.6, 1e-12));
}

TEST_CASE("the face of the carving polyhedron names the glazing when the aperture lies in it", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    Polyhedron window = box("window", Effect::carve, {1, -0.3, 1}, {3, 0, 2});
    scene.glazings.push_back({.name = "whole"});
    scene.glazings.push_back({.name = "face"});
    window.glazing = make_id<GlazingId>(1);
    window.faces[2].glazing = make_id<GlazingId>(2);  // front: y = -0.3
    scene.polyhedra.push_back(window);
    const Building building = assemble(scene);
    REQUIRE(building.apertures.size() == 1);
    CHECK(index(building.apertures[0].glazing) == 2);
}

TEST_CASE("two crossing window boxes of one glazing make one L-shaped aperture", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("low", Effect::carve, {1, -0.5, 1}, {3, 0, 1.5}));
    scene.polyhedra.push_back(box("tall", Effect::carve, {1, -0.5, 1}, {1.5, 0, 2.5}));
    const Building building = assemble(scene);
    REQUIRE(building.apertures.size() == 1);
    CHECK_THAT(building.apertures[0].area_m2, WithinRel(1.0 + 0.5, 1e-12));
    CHECK(building.apertures[0].facets.size() == 2);
}

TEST_CASE("a pit carved below the ground opens upwards in the ground plane", "[core][assembly]") {
    Scene scene = empty_scene();
    scene.polyhedra = {box("pit", Effect::carve, {0, 0, -2}, {3, 4, 1})};
    const Building building = assemble(scene);
    REQUIRE(building.apertures.size() == 1);
    CHECK_THAT(building.apertures[0].area_m2, WithinRel(12.0, 1e-12));
    CHECK(glm::distance(building.apertures[0].normal, dvec3(0, 0, -1)) < 1e-12);
    CHECK_THAT(building.indoor_air_volume_m3, WithinRel(24.0, 1e-12));
}

TEST_CASE("a face between two rooms that names a glazing is an inner aperture with two sides", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    scene.glazings.push_back({.name = "pane"});
    Polyhedron second = box("second", Effect::carve, {4, 1, 1}, {4.25, 2, 2});
    second.faces[4].glazing = make_id<GlazingId>(1);  // left: x = 4, towards the room
    scene.polyhedra.push_back(second);
    const Building building = assemble(scene);
    REQUIRE(building.apertures.size() == 1);
    CHECK(building.apertures[0].inner);
    const Face& face = building.faces[index(building.apertures[0].face)];
    REQUIRE(face.other_side);
    const Face& other = building.faces[index(*face.other_side)];
    CHECK(glm::distance(face.normal, -other.normal) < 1e-12);
    CHECK_THAT(area_m2(other.region), WithinRel(1.0, 1e-12));
    CHECK_THAT(building.indoor_air_volume_m3, WithinRel(60.25, 1e-12));
}

TEST_CASE("where faces coincide the later polyhedron gives the material", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    scene.materials.push_back({.name = "panel", .reflectance = grey(0.1)});
    Polyhedron panel = box("panel", Effect::fill, {1, -0.2, 1}, {2, 0, 2});  // inside the wall, flush with the room
    panel.material = make_id<MaterialId>(1);
    scene.polyhedra.push_back(panel);
    const Building building = assemble(scene);
    double panel_area = 0.0;
    for (const Facet& facet : building.facets) {
        const Face& face = building.faces[index(facet.face)];
        if (face.name == "panel/back") {
            panel_area += facet.area_m2;
            CHECK(index(face.material) == 1);
        }
        if (face.name == "room/front") CHECK(index(face.material) == 0);
    }
    CHECK_THAT(panel_area, WithinRel(1.0, 1e-12));
    CHECK_THAT(building.indoor_air_volume_m3, WithinRel(60.0, 1e-12));
}

TEST_CASE("many faces in one plane each get what no later one covers", "[core][assembly]") {
    Scene scene = closed_room({50, 3, 3});
    // Steps that overlap by half a metre, all of one height.
    constexpr int count = 40;
    for (int k = 0; k < count; ++k)
        scene.polyhedra.push_back(box("step " + std::to_string(k), Effect::fill, {1.0 + k, 1, 0}, {2.5 + k, 2, 0.5}));
    std::vector<double> top_m2(count);
    double floor_m2 = 0.0;
    const Building building = assemble(scene);
    for (const Facet& facet : building.facets) {
        const std::string& name = building.faces[index(facet.face)].name;
        if (name.starts_with("step ") && name.ends_with("/top")) top_m2[std::stoul(name.substr(5))] += facet.area_m2;
        if (name == "room/bottom") floor_m2 += facet.area_m2;
    }
    for (int k = 0; k < count; ++k) CHECK_THAT(top_m2[static_cast<std::size_t>(k)], WithinRel(k + 1 < count ? 1.0 : 1.5, 1e-12));
    CHECK_THAT(floor_m2, WithinRel(150.0 - 40.5, 1e-12));
}

TEST_CASE("carving outdoor air above a roof takes nothing of the roof", "[core][assembly]") {
    Scene scene = empty_scene();
    scene.polyhedra.push_back(box("block", Effect::fill, {0, 0, 0}, {40, 2, 1}));
    for (int k = 0; k < 40; ++k)
        scene.polyhedra.push_back(box("carve " + std::to_string(k), Effect::carve, {0.1 + k, 0.5, 1}, {0.9 + k, 1.5, 2}));
    const Building building = assemble(scene);
    double roof_m2 = 0.0;
    for (const Facet& facet : building.facets) {
        CHECK(building.faces[index(facet.face)].name.starts_with("block/"));
        if (facet.normal.z > 0.5) roof_m2 += facet.area_m2;
    }
    CHECK_THAT(roof_m2, WithinRel(80.0, 1e-12));
}

TEST_CASE("polygons join the flow, less the apertures in their plane", "[core][assembly]") {
    Scene scene = empty_scene();
    scene.polygons = {{.id = "wall", .vertices_m = {{0, 0, 0}, {4, 0, 0}, {4, 0, 3}, {2, 0, 3}, {2, 0, 2}, {0, 0, 2}}},
                      {.id = "shelf", .vertices_m = {{0, 1, 1}, {1, 1, 1}, {1, 2, 1}, {0, 2, 1}}, .two_sided = true}};
    scene.apertures = {{.id = "window", .vertices_m = {{1, 0, 1}, {1.5, 0, 1}, {1.5, 0, 1.5}, {1, 0, 1.5}}}};
    const Building building = assemble(scene);
    double wall = 0, shelf = 0;
    for (const Facet& facet : building.facets) {
        const std::string& name = building.faces[index(facet.face)].name;
        if (name == "wall") {
            wall += facet.area_m2;
            CHECK(glm::distance(facet.normal, dvec3(0, -1, 0)) < 1e-12);
        }
        if (name.starts_with("shelf")) shelf += facet.area_m2;
    }
    CHECK_THAT(wall, WithinRel(10.0 - 0.25, 1e-12));
    CHECK_THAT(shelf, WithinRel(2.0, 1e-12));
    REQUIRE(building.apertures.size() == 1);
}

TEST_CASE("random polyhedra assemble into closed surfaces around what membership says", "[core][assembly][property]") {
    int checked_sides = 0, doubtful_sides = 0;
    for (std::uint64_t seed = 0; seed < 500; ++seed) {
        const Placement placement = seed % 2 == 0 ? Placement::free : Placement::lattice;
        // Every fourth scene reaches below the ground; the solid's surface is then open at the ground plane.
        const double low_z = seed % 4 < 3 ? 0.5 : -3.0;
        const int count = 3 + static_cast<int>(seed % 17);
        const Scene scene = random_scene(seed, count, placement, low_z);
        INFO("seed " << seed << ", " << count << " polyhedra");
        const Building building = assemble(scene);
        const Totals t = boundary_totals(building);
        // 1e-9 of the area of all surfaces: corners are rounded to 1 nm, which moves the vector area of a facet by at most
        // 1 nm x half its perimeter, in a random direction.
        CHECK(glm::length(t.indoor_normals) <= 1e-9 * std::max(t.indoor_area, t.solid_area));
        if (low_z > 0) CHECK(glm::length(t.solid_normals) <= 1e-9 * t.solid_area);

        std::mt19937_64 random(seed + 1000);
        const int samples = 2000;
        const dvec3 low(-3, -3, low_z - 3), size(16, 16, 14);
        int indoor = 0, solid = 0;
        for (int i = 0; i < samples; ++i) {
            const dvec3 p = low + size * dvec3(uniform(random), uniform(random), uniform(random));
            const Medium medium = medium_at(scene, p);
            indoor += medium == Medium::indoor_air ? 1 : 0;
            solid += medium == Medium::solid && p.z > 0 ? 1 : 0;
        }
        const double volume = size.x * size.y * size.z;
        const auto within_sampling = [&](int hits, double expected) {
            const double share = expected / volume;
            const double sigma = std::sqrt(share * (1.0 - share) / samples) + 1.0 / samples;
            return std::abs(hits / static_cast<double>(samples) - share) < 4.5 * sigma;  // 1000 checks: 4.5 sigma
        };
        CHECK(within_sampling(indoor, building.indoor_air_volume_m3));
        if (low_z > 0) CHECK(within_sampling(solid, t.solid_volume));

        for (const Facet& facet : building.facets) {
            if (facet.area_m2 < 1e-4) continue;
            const dvec3 p = point_in(facet, random);
            const double step = 2e-6;  // beyond the tolerance of coincidence
            const Medium front = medium_at(scene, p + step * facet.normal), back = medium_at(scene, p - step * facet.normal);
            ++checked_sides;
            const Face& face = building.faces[index(facet.face)];
            const bool as_expected =
                facet.is_aperture ? front == Medium::indoor_air && back == (face.other_side ? Medium::indoor_air : Medium::outdoor_air)
                                  : front == medium_of(facet.environment) && back == Medium::solid;
            if (!as_expected) ++doubtful_sides;
        }
    }
    CHECK(checked_sides > 10000);
    // A point may lie within 2 um of another face by chance: about 1e-5 of them.
    CHECK(doubtful_sides <= checked_sides / 10000);
}

TEST_CASE("polyhedra in either order of equal effect enclose the same air", "[core][assembly][property]") {
    Scene scene = closed_room({6, 6, 3});
    scene.polyhedra.push_back(box("a", Effect::fill, {1, 1, 0}, {2, 2, 1}));
    scene.polyhedra.push_back(box("b", Effect::fill, {1.5, 1.5, 0}, {3, 3, 0.7}));
    const double volume = assemble(scene).indoor_air_volume_m3;
    std::swap(scene.polyhedra[2], scene.polyhedra[3]);
    CHECK_THAT(assemble(scene).indoor_air_volume_m3, WithinRel(volume, 1e-12));
}

TEST_CASE("indoor air at a height is the plan of the rooms less what stands in them", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("desk", Effect::fill, {1, 1, 0}, {2, 2, 0.7}));
    CHECK_THAT(area_m2(indoor_air_at_height(scene, 0.5)), WithinRel(19.0, 1e-9));
    CHECK_THAT(area_m2(indoor_air_at_height(scene, 0.85)), WithinRel(20.0, 1e-9));
    CHECK(indoor_air_at_height(scene, 4.0).empty());
}

TEST_CASE("a polygon that lies on a surface takes its place", "[core][assembly]") {
    Scene scene = closed_room({4, 5, 3});
    scene.materials.push_back({.name = "rug", .reflectance = grey(0.05)});
    scene.polygons = {{.id = "rug", .vertices_m = {{1, 1, 0}, {3, 1, 0}, {3, 4, 0}, {1, 4, 0}}, .material = make_id<MaterialId>(1)},
                      {.id = "mat", .vertices_m = {{2, 2, 0}, {3.5, 2, 0}, {3.5, 3, 0}, {2, 3, 0}}, .material = make_id<MaterialId>(1)}};
    const Building building = assemble(scene);
    double floor = 0, rug = 0, mat = 0;
    for (const Facet& facet : building.facets) {
        const std::string& name = building.faces[index(facet.face)].name;
        if (name == "room/bottom") floor += facet.area_m2;
        if (name == "rug") rug += facet.area_m2;
        if (name == "mat") mat += facet.area_m2;
    }
    CHECK_THAT(rug, WithinRel(6.0 - 1.0, 1e-12));  // the later polygon lies on it
    CHECK_THAT(mat, WithinRel(1.5, 1e-12));
    CHECK_THAT(floor, WithinRel(20.0 - 6.5, 1e-12));
    CHECK_THAT(building.indoor_air_volume_m3, WithinRel(60.0, 1e-12));
}

TEST_CASE("an outdoor polygon below the ground is buried, one indoors is not", "[core][assembly]") {
    Scene scene = empty_scene();
    scene.polygons = {{.id = "lawn", .vertices_m = {{0, 0, -0.05}, {1, 0, -0.05}, {1, 1, -0.05}, {0, 1, -0.05}}, .side = Environment::outdoor},
                      {.id = "cellar floor", .vertices_m = {{0, 0, -2}, {1, 0, -2}, {1, 1, -2}, {0, 1, -2}}}};
    const Building building = assemble(scene);
    REQUIRE(building.facets.size() == 1);
    CHECK(building.faces[index(building.facets[0].face)].name == "cellar floor");
}
