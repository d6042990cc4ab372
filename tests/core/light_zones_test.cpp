#include "core/light_zones.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "core/sun.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

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

}  // namespace

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
