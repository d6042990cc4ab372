#include "core/light_zones.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "core/convex_solid.h"
#include "core/umbra.h"
#include "core/sun.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

SunBeam beam(double altitude_deg, double azimuth_deg) {
    return {direction_from_angles(radians_from_degrees(altitude_deg), radians_from_degrees(azimuth_deg)), 10000.0};
}

const Face* face_named(const Building& building, const std::string& name) {
    for (const Face& face : building.faces)
        if (face.name == name) return &face;
    return nullptr;
}

std::size_t number_of(const Building& building, const std::string& name) {
    const Face* face = face_named(building, name);
    REQUIRE(face != nullptr);
    return static_cast<std::size_t>(face - building.faces.data());
}

/// Does a polygon region have a corner at this place?
bool has_corner(const Face& face, const Region& region, const dvec3& place_m) {
    for (const Ring& ring : region)
        for (const PlanePoint& p : ring)
            if (glm::distance(face.plane.to_world(p), place_m) < 1e-6) return true;
    return false;
}

/// Distance along a ray to a convex polygon; infinite when it misses. Slack widens the polygon.
double meets(const std::vector<dvec3>& polygon, const dvec3& normal, const dvec3& from, const dvec3& direction) {
    const double slope = glm::dot(normal, direction);
    if (std::abs(slope) < 1e-12) return 1e300;
    const double t = glm::dot(normal, polygon[0] - from) / slope;
    if (t < 1e-7) return 1e300;
    const dvec3 p = from + t * direction;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec3 edge = polygon[(i + 1) % polygon.size()] - polygon[i];
        if (glm::dot(glm::cross(normal, edge), p - polygon[i]) < 0.0) return 1e300;
    }
    return t;
}

/// Sunlight at a point by brute force over facets: the product of transmittances, 0 where blocked.
double sun_by_ray(const Scene& scene, const Building& building, const dvec3& p, const dvec3& to_sun) {
    double share = 1.0;
    bool leaves = false;
    for (const Facet& facet : building.facets) {
        if (meets(facet.vertices_m, facet.normal, p, to_sun) > 1e299) continue;
        if (!facet.is_aperture) return 0.0;
        const Aperture& aperture = building.apertures[index(*building.faces[index(facet.face)].aperture)];
        if (aperture.inner && glm::dot(facet.normal, to_sun) > 0.0) continue;  // its other side counts
        share *= scene.glazings[index(aperture.glazing)].normal_transmittance.g;
        leaves = leaves || (!aperture.inner && glm::dot(aperture.normal, to_sun) < 0.0);
    }
    return leaves ? share : 0.0;
}

/// True within 1e-6 m of the outline of a region.
bool near_outline(const Region& region, const PlanePoint& p) {
    for (const Ring& ring : region) {
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const PlanePoint &a = ring[i], &b = ring[(i + 1) % ring.size()];
            const double dx = double(b.X - a.X), dy = double(b.Y - a.Y), px = double(p.X - a.X), py = double(p.Y - a.Y);
            const double length = std::hypot(dx, dy);
            if (length == 0.0) continue;
            const double along = std::clamp((px * dx + py * dy) / length, 0.0, length);
            if (std::hypot(px - along * dx / length, py - along * dy / length) < 1000.0) return true;
        }
    }
    return false;
}

dvec3 point_on(const Facet& facet, std::mt19937_64& random) {
    double a = uniform(random), b = uniform(random);
    if (a + b > 1) a = 1 - a, b = 1 - b;
    const std::size_t k = 1 + random() % (facet.vertices_m.size() - 2);
    return (1 - a - b) * facet.vertices_m[0] + a * facet.vertices_m[k] + b * facet.vertices_m[k + 1];
}

/// A hall with two windows, a roof light and random furniture; a block outside in the south.
Scene random_hall(std::uint64_t seed, int furniture) {
    Scene scene = empty_scene();
    scene.glazings.push_back({.name = "grey", .normal_transmittance = grey(0.5), .angular_law = AngularLaw::constant});
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, 0.2}, {8.3, 6.3, 3.7}), box("hall", Effect::carve, {0, 0, 0.5}, {8, 6, 3.5}),
                       box("west", Effect::carve, {1, -0.6, 1.2}, {3, 0, 2.8}), box("east", Effect::carve, {5, -0.6, 0.5}, {7, 0, 3}),
                       box("roof", Effect::carve, {3, 3, 3.5}, {4.5, 4, 4}), box("outside", Effect::fill, {2, -4, 0}, {4, -3, 2.5})};
    scene.polyhedra[3].glazing = make_id<GlazingId>(1);
    const Scene loose = random_scene(seed, furniture, seed % 2 == 0 ? Placement::free : Placement::lattice, 0.5);
    for (Polyhedron p : loose.polyhedra) {
        p.effect = Effect::fill;
        for (std::size_t k = 1; k < 4; ++k) p.vertices_m[k] = p.vertices_m[0] + 0.4 * (p.vertices_m[k] - p.vertices_m[0]);
        p.vertices_m[0].z -= 1.0, p.vertices_m[1].z -= 1.0, p.vertices_m[2].z -= 1.0, p.vertices_m[3].z -= 1.0;
        scene.polyhedra.push_back(p);
    }
    return scene;
}

}  // namespace

TEST_CASE("the sun through a thin window lights the rectangle that geometry says", "[core][sunspot][zones]") {
    // Sun in the south, 45 degrees high: a window from z = 1 to 2 in the plane y = 0 lights y = 1 to 2 of the floor.
    Scene scene = empty_scene();
    scene.polygons = {{.id = "floor", .vertices_m = {{0, 0, 0}, {4, 0, 0}, {4, 5, 0}, {0, 5, 0}}},
                      {.id = "wall", .vertices_m = {{4, 0, 0}, {0, 0, 0}, {0, 0, 3}, {4, 0, 3}}}};
    scene.apertures = {{.id = "window", .vertices_m = {{3, 0, 1}, {1, 0, 1}, {1, 0, 2}, {3, 0, 2}}}};
    const Building building = assemble(scene);
    const SunBeam sun = beam(45, 180);
    const LightZones zones = find_light_zones(scene, building, &sun);
    const std::size_t floor = number_of(building, "floor");
    REQUIRE(zones.sunspots[floor].size() == 1);
    const Sunspot& spot = zones.sunspots[floor][0];
    CHECK_THAT(area_m2(spot.region), WithinRel(2.0, 1e-9));
    for (const dvec3& corner : {dvec3(1, 1, 0), dvec3(3, 1, 0), dvec3(3, 2, 0), dvec3(1, 2, 0)})
        CHECK(has_corner(building.faces[floor], spot.region, corner));
    CHECK_THAT(spot.illuminance_lx.g, WithinRel(10000.0 * std::sqrt(0.5), 1e-12));
    // One degree lower: the far edge moves from 2 m to 2 / tan 44.
    const SunBeam lower = beam(44, 180);
    CHECK(has_corner(building.faces[floor], find_light_zones(scene, building, &lower).sunspots[floor][0].region,
                     {1, 2.0 / std::tan(radians_from_degrees(44)), 0}));
}

TEST_CASE("the reveal of a thick wall cuts the sunspot", "[core][sunspot][zones]") {
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.3}, {3, 0, 2.3}));  // wall 0.3 m thick
    const Building building = assemble(scene);
    const SunBeam sun = beam(45, 180);
    const LightZones zones = find_light_zones(scene, building, &sun);
    // The aperture at y = -0.3 throws z 1.3 .. 2.3 on y 0.7 .. 1.7 of the floor (z = 0.3), but the sill's inner edge
    // (y = 0, z = 1.3) hides what is nearer than y = 1.
    const std::size_t floor = number_of(building, "room/bottom"), sill = number_of(building, "window/bottom");
    REQUIRE(zones.sunspots[floor].size() == 1);
    CHECK_THAT(area_m2(zones.sunspots[floor][0].region), WithinRel(2.0 * 0.7, 1e-9));
    CHECK(has_corner(building.faces[floor], zones.sunspots[floor][0].region, {1, 1.0, 0.3}));
    CHECK(has_corner(building.faces[floor], zones.sunspots[floor][0].region, {3, 1.7, 0.3}));
    REQUIRE(zones.sunspots[sill].size() == 1);
    CHECK_THAT(area_m2(zones.sunspots[sill][0].region), WithinRel(2.0 * 0.3, 1e-9));
}

TEST_CASE("a sun patch climbs from the floor over a table and up the wall", "[core][sunspot][zones]") {
    Scene scene = closed_room({4, 2, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.3, 1.3}, {3, 0, 3.3}));
    scene.polyhedra.push_back(box("table", Effect::fill, {1.5, 1.0, 0.3}, {2.5, 1.4, 1.0}));
    const Building building = assemble(scene);
    const SunBeam sun = beam(45, 180);
    const LightZones zones = find_light_zones(scene, building, &sun);
    const auto lit_m2 = [&](const char* name) {
        double sum = 0;
        for (const Sunspot& spot : zones.sunspots[number_of(building, name)]) sum += area_m2(spot.region);
        return sum;
    };
    // Beam: 2 m wide, from the inner edge of the sill (0, 1.3) to the lintel at the facade (-0.3, 3.3), i.e. y + z from 1.3 to 3.
    CHECK_THAT(lit_m2("table/top"), WithinRel(1.0 * 0.4, 1e-9));                      // y + z = 2 .. 2.4
    CHECK_THAT(lit_m2("table/front"), WithinRel(1.0 * 0.7, 1e-9));                    // y = 1, z from 0.3
    CHECK_THAT(lit_m2("room/bottom"), WithinRel(2.0 * (2.0 - 1.0) - 1.0 * 1.0, 1e-9));  // y from 1; in the middle the table or its shadow
    CHECK_THAT(lit_m2("room/back"), WithinRel(2.0 * (1.0 - 0.3) - 1.0 * (0.4 - 0.3), 1e-9));  // z to 1; the table's shadow reaches z = 0.4
}

TEST_CASE("triangular and L-shaped apertures throw spots of their shape", "[core][sunspot][zones]") {
    Scene scene = empty_scene();
    scene.polygons = {{.id = "floor", .vertices_m = {{0, 0, 0}, {4, 0, 0}, {4, 5, 0}, {0, 5, 0}}},
                      {.id = "wall", .vertices_m = {{4, 0, 0}, {0, 0, 0}, {0, 0, 3}, {4, 0, 3}}}};
    scene.apertures = {{.id = "triangle", .vertices_m = {{1.5, 0, 1}, {0.5, 0, 1}, {1, 0, 2}}},
                       {.id = "L", .vertices_m = {{3.5, 0, 0.5}, {2, 0, 0.5}, {2, 0, 2}, {2.5, 0, 2}, {2.5, 0, 1}, {3.5, 0, 1}}}};
    const Building building = assemble(scene);
    const SunBeam sun = beam(45, 180);
    const LightZones zones = find_light_zones(scene, building, &sun);
    const auto& spots = zones.sunspots[number_of(building, "floor")];
    REQUIRE(spots.size() == 2);
    const double triangle = area_m2(spots[0].region), l = area_m2(spots[1].region);
    CHECK_THAT(triangle, WithinRel(0.5, 1e-9));
    CHECK_THAT(l, WithinRel(1.5 * 0.5 + 0.5 * 1.0, 1e-9));
}

TEST_CASE("sunspots agree with rays to the sun, umbra zones see no window", "[core][sunspot][umbra][zones][property]") {
    int lit = 0, dark = 0, hidden = 0;
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        const Scene scene = random_hall(seed, 2 + static_cast<int>(seed) * 2);
        const Building building = assemble(scene);
        const SunBeam sun = beam(15.0 + 5.0 * double(seed), 140.0 + 7.0 * double(seed));
        INFO("seed " << seed);
        const LightZones zones = find_light_zones(scene, building, &sun);
        std::mt19937_64 random(seed);
        int wrong_sun = 0, wrong_umbra = 0;
        for (const Facet& facet : building.facets) {
            if (facet.is_aperture || facet.environment == Environment::outdoor) continue;
            const Face& face = building.faces[index(facet.face)];
            const auto& spots = zones.sunspots[index(facet.face)];
            const Region& umbra = zones.umbra[index(facet.face)];
            for (int i = 0; i < 20 + static_cast<int>(facet.area_m2 * 40); ++i) {
                const dvec3 p = point_on(facet, random);
                const PlanePoint q = face.plane.to_plane(p);
                bool near = near_outline(face.region, q) || near_outline(umbra, q);
                double by_zone = 0.0;
                for (const Sunspot& spot : spots) {
                    near = near || near_outline(spot.region, q);
                    if (contains(spot.region, q)) by_zone = spot.transmittance.g;
                }
                if (near) continue;
                const double by_ray = glm::dot(face.normal, sun.direction) > 0.0
                                          ? sun_by_ray(scene, building, p + 1e-9 * face.normal, sun.direction) : 0.0;
                (by_ray > 0.0 ? lit : dark)++;
                if (std::abs(by_zone - by_ray) > 1e-12) ++wrong_sun;
                if (!contains(umbra, q)) continue;
                // Points of the windows at random: none may be seen.
                ++hidden;
                for (int k = 0; k < 40; ++k) {
                    const Aperture& aperture = building.apertures[random() % building.apertures.size()];
                    const dvec3 target = point_on(building.facets[index(aperture.facets[random() % aperture.facets.size()])], random);
                    const dvec3 way = target - p;
                    if (glm::dot(way, face.normal) <= 1e-9 || glm::dot(way, aperture.normal) >= -1e-9) continue;
                    bool blocked = false;
                    for (const Facet& other : building.facets)
                        blocked = blocked || (!other.is_aperture && meets(other.vertices_m, other.normal, p + 1e-9 * face.normal, way) < 1.0);
                    if (!blocked) ++wrong_umbra;
                }
            }
        }
        CHECK(wrong_sun == 0);
        CHECK(wrong_umbra == 0);
    }
    CHECK(lit > 200);
    CHECK(dark > 2000);
    CHECK(hidden > 500);
}

TEST_CASE("sun through the windows is found again in the sunspots", "[core][sunspot][zones]") {
    // Nothing outdoors stands in the way: what enters the room is what falls on the aperture.
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.3}, {3, 0, 2.3}));
    scene.polyhedra.push_back(box("desk", Effect::fill, {1, 1.1, 1.0}, {2.5, 1.9, 1.05}));
    scene.polyhedra.push_back(box("pillar", Effect::fill, {2.1, 0.5, 0.3}, {2.3, 0.7, 3.3}));
    const Building building = assemble(scene);
    for (const auto& [altitude, azimuth] : {std::pair{20.0, 170.0}, {45.0, 200.0}, {60.0, 130.0}, {5.0, 180.0}}) {
        INFO(altitude << ", " << azimuth);
        const SunBeam sun = beam(altitude, azimuth);
        const LightZones zones = find_light_zones(scene, building, &sun);
        double flux_lm = 0;
        for (const auto& spots : zones.sunspots)
            for (const Sunspot& spot : spots) flux_lm += area_m2(spot.region) * spot.illuminance_lx.g;
        const Aperture& aperture = building.apertures[0];
        CHECK_THAT(flux_lm, WithinRel(-10000.0 * aperture.area_m2 * glm::dot(aperture.normal, sun.direction), 1e-6));
    }
}

TEST_CASE("the umbra of one box is exact, and the same when the box is made of two", "[core][umbra][zones]") {
    // Nothing but a floor, a window and a box: what is not in the umbra of the box sees the window.
    Scene scene = empty_scene();
    scene.polygons = {{.id = "floor", .vertices_m = {{-20, 0, 0.3}, {20, 0, 0.3}, {20, 40, 0.3}, {-20, 40, 0.3}}}};
    scene.apertures = {{.id = "window", .vertices_m = {{4, 0, 1.3}, {2, 0, 1.3}, {2, 0, 2.3}, {4, 0, 2.3}}}};
    Scene whole = scene, split = scene;
    whole.polyhedra = {box("box", Effect::fill, {1.9, 2, 0.3}, {4.2, 2.5, 2.0})};
    split.polyhedra = {box("left", Effect::fill, {1.9, 2, 0.3}, {2.7, 2.5, 2.0}), box("right", Effect::fill, {2.7, 2, 0.3}, {4.2, 2.5, 2.0})};
    const auto umbra = [&](const Scene& s, Building& building) {
        building = assemble(s);
        return find_light_zones(s, building, nullptr).umbra[number_of(building, "floor")];
    };
    Building building, other;
    const Region one = umbra(whole, building), two = umbra(split, other);
    CHECK(area_m2(one) > 1.0);
    CHECK_THAT(area_m2(two), WithinRel(area_m2(one), 1e-7));
    // Just outside its outline a corner of the window is seen, just inside none.
    const Face& floor = *face_named(building, "floor");
    int checked = 0;
    for (const Ring& ring : one) {
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const dvec3 pa = floor.plane.to_world(ring[i]), pb = floor.plane.to_world(ring[(i + 1) % ring.size()]);
            const dvec3 outward = glm::normalize(glm::cross(pb - pa, floor.normal));
            const auto sees = [&](const dvec3& p) {
                for (const dvec3& corner : building.facets[index(building.apertures[0].facets[0])].vertices_m) {
                    bool blocked = false;
                    for (const Facet& facet : building.facets)
                        blocked = blocked || (!facet.is_aperture && meets(facet.vertices_m, facet.normal, p + 1e-9 * floor.normal, corner - p) < 1.0);
                    if (!blocked) return true;
                }
                return false;
            };
            const dvec3 outside = 0.5 * (pa + pb) + 1e-5 * outward;
            if (!contains(floor.region, floor.plane.to_plane(outside))) continue;  // the foot of the box
            ++checked;
            CHECK(sees(outside));
            CHECK_FALSE(sees(outside - 2e-5 * outward));
        }
    }
    CHECK(checked >= 3);
}

TEST_CASE("an L of two boxes hides what its two longest boxes hide", "[core][umbra][zones]") {
    Scene scene = empty_scene();
    scene.polyhedra = {box("a", Effect::fill, {0, 0, 0.5}, {2, 1, 1.5}), box("b", Effect::fill, {0, 1, 0.5}, {1, 3, 1.5})};
    const auto parts = convex_occluders(scene, assemble(scene));
    REQUIRE(parts.size() == 2);
    double volume = 0;
    for (const ConvexSolid& part : parts) {
        const dvec3 size = part.high_m - part.low_m;
        volume += size.x * size.y * size.z;
    }
    CHECK_THAT(volume, WithinRel(2.0 * 1.0 + 1.0 * 3.0, 1e-9));  // 2 x 1 and 1 x 3, overlapping in a square
}

TEST_CASE("degenerate suns and boxes leave areas right", "[core][sunspot][umbra][zones]") {
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.3}, {3, 0, 2.3}));
    const auto lit_m2 = [](const Scene& s, const SunBeam& sun) {
        double sum = 0;
        for (const auto& spots : find_light_zones(s, assemble(s), &sun).sunspots)
            for (const Sunspot& spot : spots) sum += area_m2(spot.region);
        return sum;
    };
    CHECK(lit_m2(scene, beam(30, 90)) == 0.0);             // in the plane of the window
    CHECK(lit_m2(scene, beam(30, 0)) == 0.0);              // behind it
    CHECK(lit_m2(scene, beam(90, 180)) < 1e-3);            // grazes it from above
    CHECK(lit_m2(scene, beam(1e-4, 180)) > 1.9);           // level: the far wall
    Scene filled = scene;
    filled.polyhedra.push_back(box("shutter", Effect::fill, {1, -0.1, 1.3}, {3, 0, 2.3}));
    CHECK_THAT(lit_m2(filled, beam(45, 180)), WithinRel(2.0 * (1.0 - 0.2) + 2.0 * 0.2, 1e-9));  // the shutter and the sill before it
    Scene touching = scene;
    touching.polyhedra.push_back(box("cupboard", Effect::fill, {1, 0, 0.3}, {3, 0.5, 2.3}));
    CHECK_THAT(lit_m2(touching, beam(45, 180)), WithinAbs(0.6 + 2.0 * 0.7 * std::sqrt(1.0), 1e-6));
}
