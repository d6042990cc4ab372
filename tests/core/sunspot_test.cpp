#include "core/sunspot.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <random>

#include "core/parallel.h"
#include "core/sun.h"
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

// Corners are rounded to 1 nm in the facet of the aperture and again in the face, and a flat sun stretches the first.
constexpr double rounding_m = 1e-8;

struct Lit {
    Scene scene;
    Building building;
    dvec3 to_sun{};
    std::map<std::string, std::vector<Sunspot>> spots;  // by name of face, lit ones only
};

// E_dn = 1000 lx; to_sun of any length.
Lit light(const Scene& scene, const dvec3& to_sun) {
    Lit lit{scene, assemble(scene), glm::normalize(to_sun), {}};
    const SunspotFinder finder(lit.scene, lit.building, {lit.to_sun, 1000.0});
    for (std::size_t f = 0; f < lit.building.faces.size(); ++f) {
        auto spots = finder.on_face(make_id<FaceId>(f));
        if (!spots.empty()) lit.spots[lit.building.faces[f].name] = std::move(spots);
    }
    return lit;
}

double area_of(const Lit& lit, const std::string& face) {
    double area = 0.0;
    const auto found = lit.spots.find(face);
    if (found == lit.spots.end()) return 0.0;
    for (const Sunspot& spot : found->second) area += area_m2(spot.region);
    return area;
}

// The outline of the only spot on a face has these corners and no others.
void check_outline(const Lit& lit, const std::string& face, const std::vector<dvec3>& corners_m) {
    INFO(face);
    const auto found = lit.spots.find(face);
    REQUIRE(found != lit.spots.end());
    REQUIRE(found->second.size() == 1);
    const Sunspot& spot = found->second.front();
    REQUIRE(spot.region.size() == 1);
    CHECK(spot.region[0].size() == corners_m.size());
    const PlaneFrame& plane = lit.building.faces[index(spot.face)].plane;
    for (const dvec3& corner : corners_m) {
        double nearest = 1e300;
        for (const PlanePoint& p : spot.region[0]) nearest = std::min(nearest, glm::distance(plane.to_world(p), corner));
        INFO(corner.x << ", " << corner.y << ", " << corner.z);
        CHECK(nearest < rounding_m);
    }
}

void open_south(Scene& scene, std::vector<dvec3> vertices_m) {
    scene.apertures.push_back({.id = "window " + std::to_string(scene.apertures.size()), .vertices_m = std::move(vertices_m)});
}

struct Agreement {
    int points = 0, lit = 0, near_edge = 0, wrong = 0;
};

// Random points on indoor faces: does the reference find the sunspot that the zones have there?
Agreement compare_with_rays(const Scene& scene, const dvec3& to_sun, int points, std::uint64_t seed) {
    const Building building = assemble(scene);
    const SunspotFinder finder(scene, building, {to_sun, 1000.0});
    std::vector<std::vector<Sunspot>> spots;
    for (std::size_t f = 0; f < building.faces.size(); ++f) spots.push_back(finder.on_face(make_id<FaceId>(f)));
    double indoor_m2 = 0.0;
    for (const Facet& facet : building.facets)
        if (!facet.is_aperture && facet.environment == Environment::indoor) indoor_m2 += facet.area_m2;
    std::mt19937_64 random(seed);
    Agreement result;
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture || facet.environment != Environment::indoor) continue;
        const Face& face = building.faces[index(facet.face)];
        const int share = static_cast<int>(std::ceil(points * facet.area_m2 / indoor_m2));
        for (int i = 0; i < share; ++i) {
            const dvec3 point_m = point_in(facet, random);
            const PlanePoint p = face.plane.to_plane(point_m);
            SunPath zone;
            int found = 0;
            for (const Sunspot& spot : spots[index(facet.face)]) {
                if (!contains(spot.region, p)) continue;
                zone = {spot.aperture, spot.transmittance};
                ++found;
            }
            const auto agrees = [&](const SunPath& path) {
                return found == (path.exit ? 1 : 0) && path.exit == zone.exit &&
                       largest(path.transmittance - zone.transmittance) < 1e-12 && largest(zone.transmittance - path.transmittance) < 1e-12;
            };
            const SunPath path = path_to_sun(scene, building, face, point_m, to_sun);
            ++result.points;
            result.lit += path.exit ? 1 : 0;
            if (agrees(path)) continue;
            // Within 1e-6 m of an edge the reference itself says otherwise a little further on.
            bool at_edge = false;
            for (int k = 0; k < 8; ++k) {
                const double angle = k * std::numbers::pi / 4.0;
                const dvec3 beside = point_m + 1e-6 * (std::cos(angle) * face.plane.x + std::sin(angle) * face.plane.y);
                at_edge = at_edge || !(path_to_sun(scene, building, face, beside, to_sun) == path);
            }
            ++(at_edge ? result.near_edge : result.wrong);
        }
    }
    return result;
}

// Area of an aperture that the sun reaches, by the shadows of all facets on the sunny side of its plane.
double sunlit_area_m2(const Building& building, const Aperture& aperture, const dvec3& to_sun) {
    const Face& face = building.faces[index(aperture.face)];
    Region lit = face.region;
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture) continue;
        Ring shadow;
        for (std::size_t k = 0; k < facet.vertices_m.size(); ++k) {
            const dvec3 &a = facet.vertices_m[k], &b = facet.vertices_m[(k + 1) % facet.vertices_m.size()];
            // How far towards the sun from the plane.
            const auto way = [&](const dvec3& p) { return glm::dot(p - face.plane.origin_m, face.normal) / glm::dot(to_sun, face.normal); };
            const double t_a = way(a), t_b = way(b);
            if (t_a >= 1e-7) shadow.push_back(face.plane.to_plane(a - t_a * to_sun));
            if ((t_a < 1e-7) != (t_b < 1e-7)) shadow.push_back(face.plane.to_plane(a + t_a / (t_a - t_b) * (b - a)));
        }
        if (shadow.size() < 3) continue;
        if (!ClipperLib::Orientation(shadow)) ClipperLib::ReversePath(shadow);
        lit = subtract(lit, {shadow});
    }
    return area_m2(lit);
}

// The sun's flux that reaches apertures is found again in the room, aperture by aperture: share that is missing.
// Only for suns whose rays cannot leave through another aperture.
double worst_imbalance(const Lit& lit) {
    double worst = 0.0;
    for (std::size_t a = 0; a < lit.building.apertures.size(); ++a) {
        const Aperture& aperture = lit.building.apertures[a];
        const double cosine = -glm::dot(aperture.normal, lit.to_sun);
        if (aperture.inner || cosine <= 0.0) continue;
        double arrived_m2 = 0.0;  // seen from the sun
        for (const auto& [name, spots] : lit.spots) {
            for (const Sunspot& spot : spots) {
                if (index(spot.aperture) != a) continue;
                arrived_m2 += area_m2(spot.region) * glm::dot(lit.building.faces[index(spot.face)].normal, lit.to_sun);
            }
        }
        const double entered_m2 = sunlit_area_m2(lit.building, aperture, lit.to_sun) * cosine;
        worst = std::max(worst, std::abs(arrived_m2 - entered_m2) / (aperture.area_m2 * cosine));
    }
    return worst;
}

}  // namespace

TEST_CASE("a window in a thin wall throws its sheared image on the floor", "[core][sunspot]") {
    Scene scene = polygon_room({4, 5, 3});
    open_south(scene, {{1, 0, 1}, {1, 0, 2}, {3, 0, 2}, {3, 0, 1}});
    const Lit lit = light(scene, {0.3, -1, 0.8});
    // From (x, 0, z) the ray meets the floor at (x - 0.3 z / 0.8, z / 0.8).
    check_outline(lit, "floor", {{0.625, 1.25, 0}, {2.625, 1.25, 0}, {2.25, 2.5, 0}, {0.25, 2.5, 0}});
    CHECK_THAT(area_of(lit, "floor"), WithinRel(2.5, 1e-9));
    CHECK(lit.spots.size() == 1);
    const Sunspot& spot = lit.spots.at("floor").front();
    CHECK_THAT(spot.illuminance_lx.g, WithinRel(1000.0 * lit.to_sun.z, 1e-12));
    CHECK(spot.transmittance == grey(1.0));
}

TEST_CASE("the reveals of a thick wall cut the sun patch and are lit themselves", "[core][sunspot]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1}, {3, 0, 2}));
    const Lit lit = light(scene, {0.3, -1, 0.8});
    // The opening, in the facade 0.3 m in front of the inner face of the wall, arrives there moved by (-0.09, -0.24).
    check_outline(lit, "room/bottom", {{0.625, 1.25, 0}, {2.535, 1.25, 0}, {2.25, 2.2, 0}, {0.34, 2.2, 0}});
    CHECK_THAT(area_of(lit, "room/bottom"), WithinRel(1.91 * 0.95, 1e-9));
    check_outline(lit, "window/bottom", {{1, -0.3, 1}, {3, -0.3, 1}, {2.91, 0, 1}, {1, 0, 1}});
    check_outline(lit, "window/left", {{1, -0.3, 1}, {1, 0, 1}, {1, 0, 1.76}, {1, -0.3, 2}});
    CHECK(lit.spots.size() == 3);
}

TEST_CASE("a sun patch climbs from the floor up the wall and over a table", "[core][sunspot]") {
    Scene scene = closed_room({4, 3, 3});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1}, {3, 0, 2.15}));
    scene.polyhedra.push_back(box("table", Effect::fill, {1.5, 2.2, 0}, {2, 2.6, 0.6}));
    const Lit lit = light(scene, {0, -1, 0.5});
    // The beam is from 1 m to 2 m high where it enters the room (y = 0) and falls by 0.5 m per metre.
    check_outline(lit, "room/bottom", {{1, 2, 0}, {3, 2, 0}, {3, 3, 0}, {2, 3, 0}, {2, 2.2, 0}, {1.5, 2.2, 0}, {1.5, 3, 0}, {1, 3, 0}});
    check_outline(lit, "room/back",
                  {{1, 3, 0}, {1.5, 3, 0}, {1.5, 3, 0.4}, {2, 3, 0.4}, {2, 3, 0}, {3, 3, 0}, {3, 3, 0.5}, {1, 3, 0.5}});
    check_outline(lit, "table/front", {{1.5, 2.2, 0}, {2, 2.2, 0}, {2, 2.2, 0.6}, {1.5, 2.2, 0.6}});
    check_outline(lit, "table/top", {{1.5, 2.2, 0.6}, {2, 2.2, 0.6}, {2, 2.6, 0.6}, {1.5, 2.6, 0.6}});
    CHECK_THAT(area_of(lit, "room/bottom"), WithinRel(2.0 - 0.5 * 0.8, 1e-9));
    CHECK_THAT(area_of(lit, "room/back"), WithinRel(1.0 - 0.5 * 0.4, 1e-9));
    CHECK_THAT(area_of(lit, "table/front"), WithinRel(0.3, 1e-9));
    CHECK_THAT(area_of(lit, "table/top"), WithinRel(0.2, 1e-9));
    CHECK_THAT(lit.spots.at("room/back").front().illuminance_lx.r, WithinRel(1000.0 / std::sqrt(1.25), 1e-12));
}

TEST_CASE("triangular and L-shaped apertures keep their shape on the floor", "[core][sunspot]") {
    const dvec3 to_sun(0.3, -1, 0.8);
    const auto on_floor = [&](double x, double z) { return dvec3(x - 0.3 * z / 0.8, z / 0.8, 0); };
    SECTION("a triangle, by polygon") {
        Scene scene = polygon_room({4, 5, 3});
        open_south(scene, {{1, 0, 1}, {2, 0, 2}, {3, 0, 1}});
        const Lit lit = light(scene, to_sun);
        check_outline(lit, "floor", {on_floor(1, 1), on_floor(2, 2), on_floor(3, 1)});
        CHECK_THAT(area_of(lit, "floor"), WithinRel(1.0 / 0.8, 1e-9));
    }
    SECTION("an L, by polygon") {
        Scene scene = polygon_room({4, 5, 3});
        open_south(scene, {{1, 0, 1}, {1, 0, 2}, {1.5, 0, 2}, {1.5, 0, 1.4}, {3, 0, 1.4}, {3, 0, 1}});
        const Lit lit = light(scene, to_sun);
        check_outline(lit, "floor", {on_floor(1, 1), on_floor(1, 2), on_floor(1.5, 2), on_floor(1.5, 1.4), on_floor(3, 1.4), on_floor(3, 1)});
        CHECK_THAT(area_of(lit, "floor"), WithinRel((0.5 + 0.6) / 0.8, 1e-9));
    }
    // Carved, the opening is in the facade, 0.3 m in front of the room: it arrives there moved by (-0.09, -0.24).
    SECTION("a triangle, by prism") {
        Scene scene = closed_room({4, 5, 3});
        Polyhedron window = box("window", Effect::carve, {}, {1, 1, 1});
        window.kind = PolyhedronKind::prism;
        window.vertices_m = {dvec3(1, 0, 1), dvec3(3, 0, 1), dvec3(1, 0, 2), dvec3(1, -0.5, 1)};
        scene.polyhedra.push_back(window);
        const Lit lit = light(scene, to_sun);
        // What is left of the triangle (0.91, 0.76), (2.91, 0.76), (0.91, 1.76) inside x > 1, z > 1.
        check_outline(lit, "room/bottom", {on_floor(1, 1), on_floor(1, 1.715), on_floor(2.43, 1)});
        CHECK_THAT(area_of(lit, "room/bottom"), WithinRel(0.5 * 1.43 * 0.715 / 0.8, 1e-9));
        CHECK(worst_imbalance(lit) < 1e-8);
    }
    SECTION("an L, by two boxes") {
        Scene scene = closed_room({4, 5, 3});
        scene.polyhedra.push_back(box("low", Effect::carve, {1, -0.5, 1}, {3, 0, 1.4}));
        scene.polyhedra.push_back(box("tall", Effect::carve, {1, -0.5, 1}, {1.5, 0, 2}));
        const Lit lit = light(scene, to_sun);
        REQUIRE(lit.building.apertures.size() == 1);
        check_outline(lit, "room/bottom", {on_floor(1, 1), on_floor(1, 1.76), on_floor(1.41, 1.76), on_floor(1.41, 1.16),
                                           on_floor(2.91, 1.16), on_floor(2.91, 1)});
        CHECK(worst_imbalance(lit) < 1e-8);
    }
}

TEST_CASE("a sun one degree higher moves the edges of its patch as geometry says", "[core][sunspot]") {
    Scene scene = polygon_room({4, 5, 3});
    open_south(scene, {{1, 0, 1}, {1, 0, 2}, {3, 0, 2}, {3, 0, 1}});
    for (const double altitude_deg : {40.0, 41.0}) {
        const double altitude_rad = altitude_deg * std::numbers::pi / 180.0;
        const Lit lit = light(scene, direction_from_angles(altitude_rad, std::numbers::pi));
        const double y = 1.0 / std::tan(altitude_rad);
        check_outline(lit, "floor", {{1, y, 0}, {3, y, 0}, {3, 2 * y, 0}, {1, 2 * y, 0}});
    }
}

TEST_CASE("overhangs and buildings outdoors cut the patch", "[core][sunspot]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 0.5}, {3, 0, 2}));
    scene.polyhedra.push_back(box("overhang", Effect::fill, {0, -1.3, 2.3}, {4, -0.3, 2.5}));
    scene.polyhedra.push_back(box("house", Effect::fill, {-5, -20, 0}, {2, -10.3, 11}));
    const Lit lit = light(scene, {0, -1, 1});
    // The overhang's edge (y = -1.3, z = 2.3) comes down to 1 m in the inner plane of the wall, the reveal's upper edge to 1.7 m.
    // The top of the house (y = -10.3, z = 11) comes to 0.7 m at y = 0; it covers x < 2.
    check_outline(lit, "room/bottom", {{1, 0.7, 0}, {2, 0.7, 0}, {2, 0.5, 0}, {3, 0.5, 0}, {3, 1, 0}, {1, 1, 0}});
}

TEST_CASE("light keeps the transmittance of every glazing it crosses, each at its own angle", "[core][sunspot]") {
    Scene scene = closed_room({4, 6, 3});
    scene.polyhedra[1] = box("front", Effect::carve, {0, 0, 0}, {4, 2, 3});
    scene.glazings.push_back({.name = "clear", .normal_transmittance = grey(0.88)});
    scene.glazings.push_back({.name = "red", .normal_transmittance = {0.7, 0.2, 0.1}, .panes = 2});
    scene.polyhedra.push_back(box("back", Effect::carve, {0, 2, 0}, {4, 6, 3}));
    scene.polyhedra.back().faces[2].glazing = make_id<GlazingId>(2);  // front: y = 2
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1}, {3, 0, 2.5}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    const Lit lit = light(scene, {0.3, -1, 0.4});
    const double cosine = 1.0 / std::sqrt(1.25);
    const Band3 outer = GlazingTransmission(scene.glazings[1]).transmittance(cosine);
    const Band3 both = outer * GlazingTransmission(scene.glazings[2]).transmittance(cosine);
    REQUIRE(lit.spots.contains("back/bottom"));
    REQUIRE(lit.spots.contains("window/bottom"));
    for (const auto& [name, spots] : lit.spots) {
        INFO(name);
        REQUIRE(spots.size() == 1);
        const Band3 expected = name.starts_with("back") ? both : outer;
        CHECK_THAT(spots[0].transmittance.r, WithinRel(expected.r, 1e-12));
        CHECK_THAT(spots[0].transmittance.b, WithinRel(expected.b, 1e-12));
        CHECK(lit.building.apertures[index(spots[0].aperture)].name == "window");
    }
    CHECK(worst_imbalance(lit) < 1e-8);
}

TEST_CASE("degenerate suns and apertures make no false light", "[core][sunspot]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1}, {3, 0, 2}));
    SECTION("a sun in the plane of the side walls lights neither them nor the jambs") {
        const Lit lit = light(scene, {0, -1, 0.8});
        check_outline(lit, "room/bottom", {{1, 1.25, 0}, {3, 1.25, 0}, {3, 2.2, 0}, {1, 2.2, 0}});
        CHECK(lit.spots.size() == 2);  // the sill too
        CHECK(worst_imbalance(lit) < 1e-8);
    }
    SECTION("a sun that grazes the side walls lights a jamb but little") {
        const Lit lit = light(scene, {1e-4, -1, 0.8});
        CHECK(worst_imbalance(lit) < 1e-8);
        CHECK_THAT(area_of(lit, "window/left"), WithinRel(0.264, 1e-4));
    }
    SECTION("a sun on the horizon shines through to the far wall") {
        const Lit lit = light(scene, {0, -1, 1e-5});
        check_outline(lit, "room/back", {{1, 5, 1 - 5e-5}, {3, 5, 1 - 5e-5}, {3, 5, 2 - 5.3e-5}, {1, 5, 2 - 5.3e-5}});
        // 1 nm in the facade's corners is 0.1 mm on the sill.
        CHECK(worst_imbalance(lit) < 1e-6);
    }
    SECTION("a sun that sees the aperture edge-on, or from indoors, lights nothing") {
        CHECK(light(scene, {1, 0, 0.8}).spots.empty());
        CHECK(light(scene, {1, 0.001, 0.8}).spots.empty());
        CHECK(light(scene, {1, 1e-13, 0.8}).spots.empty());
    }
    SECTION("a sun that sees it almost edge-on lights the jamb") {
        const Lit lit = light(scene, {1, -1e-3, 0.8});
        CHECK(worst_imbalance(lit) < 1e-6);
    }
    SECTION("a box that touches the window from inside takes the light, and none is lost") {
        scene.polyhedra.push_back(box("box", Effect::fill, {1, 0, 1}, {2, 0.5, 2.5}));
        const Lit lit = light(scene, {0.3, -1, 0.8});
        CHECK(worst_imbalance(lit) < 1e-8);
        CHECK_THAT(area_of(lit, "box/front"), WithinRel(0.76, 1e-9));
    }
    SECTION("a box that fills the window leaves no light") {
        scene.polyhedra.push_back(box("box", Effect::fill, {1, -0.3, 1}, {3, 0, 2}));
        CHECK(light(scene, {0.3, -1, 0.8}).spots.empty());
    }
    SECTION("a box whose shadow only touches the patch takes nothing from it") {
        scene.polyhedra.push_back(box("box", Effect::fill, {3, 0.2, 0}, {3.5, 2.5, 3}));
        const Lit lit = light(scene, {0, -1, 0.8});
        CHECK_THAT(area_of(lit, "room/bottom"), WithinRel(2.0 * 0.95, 1e-9));
    }
    SECTION("a sheet edge-on to the sun throws no shadow") {
        scene.polygons = {{.id = "sheet", .vertices_m = {{2, 0.5, 0}, {2, 2.5, 0}, {2, 2.5, 2}, {2, 0.5, 2}}, .two_sided = true}};
        const Lit lit = light(scene, {0, -1, 0.8});
        CHECK_THAT(area_of(lit, "room/bottom"), WithinRel(2.0 * 0.95, 1e-9));
        CHECK(worst_imbalance(lit) < 1e-8);
    }
}

TEST_CASE("either side of a polygon throws a shadow", "[core][sunspot]") {
    const bool facing_sun = GENERATE(true, false);
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1}, {3, 0, 2}));
    std::vector<dvec3> shelf{{1, 0.5, 0.5}, {2, 0.5, 0.5}, {2, 2.5, 0.5}, {1, 2.5, 0.5}};
    if (!facing_sun) std::reverse(shelf.begin(), shelf.end());
    scene.polygons = {{.id = "shelf", .vertices_m = shelf}};
    const Lit lit = light(scene, {0, -1, 0.8});
    CHECK_THAT(area_of(lit, "room/bottom"), WithinRel(0.95, 1e-9));
    CHECK_THAT(area_of(lit, "shelf"), facing_sun ? WithinAbs(0.95, 1e-9) : WithinAbs(0.0, 0.0));
}

TEST_CASE("sunspots agree with rays in random buildings", "[core][sunspot][property]") {
    Agreement total;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        INFO("seed " << seed);
        const Agreement one = compare_with_rays(random_building(seed), random_sun(seed), 2000, seed);
        CHECK(one.wrong == 0);
        total.points += one.points, total.lit += one.lit, total.near_edge += one.near_edge;
    }
    CHECK(total.lit > total.points / 200);
    CHECK(total.near_edge <= 2);
}

TEST_CASE("sunspots agree with rays in random buildings, many points", "[core][sunspot][property][slow]") {
    for (std::uint64_t seed = 100; seed < 200; ++seed) {
        INFO("seed " << seed);
        const Agreement one = compare_with_rays(random_building(seed), random_sun(seed), 100000, seed);
        CHECK(one.wrong == 0);
        // Edges within 1e-6 m cover about 1e-5 of the faces.
        CHECK(one.near_edge <= 20);
    }
}

TEST_CASE("all sun that enters is found again in the room", "[core][sunspot][property]") {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        INFO("seed " << seed);
        // From the south-east: no windows where it might leave.
        dvec3 to_sun = random_sun(seed);
        to_sun.x = std::abs(to_sun.x);
        to_sun.y = -std::abs(to_sun.y);
        // 1 nm times the length of outlines, stretched up to ten times by a flat sun, of an area of 0.25 m2 or more.
        CHECK(worst_imbalance(light(random_building(seed), to_sun)) < 1e-6);
    }
}
