#include "core/outdoors.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "core/sun.h"
#include "tests/catch.h"
#include "tests/reference/brute_force_visibility.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Outdoors {
    explicit Outdoors(const Scene& description)
        : scene(description),
          building(assemble(scene)),
          grid(make_patch_grid(building, scene.grid)),
          visibility(building),
          light(light_outdoors(scene, building, grid, visibility, progress)) {}

    OutdoorIlluminance at(const glm::dvec3& position_m, const glm::dvec3& normal) const {
        return outdoor_illuminance(light, building, grid, visibility, {position_m, normal});
    }
    LightBySource seen(const glm::dvec3& from_m, const glm::dvec3& direction, bool* is_sky = nullptr) const {
        FacetId facet{};
        visibility.first_seen({from_m, direction}, {&direction, 1}, {&facet, 1});
        if (is_sky) *is_sky = outdoor_source(building, direction, facet) == OutdoorSource::sky;
        return outdoor_luminance(light, building, grid, from_m, direction, facet);
    }

    Scene scene;
    Building building;
    PatchGrid grid;
    BruteForceVisibility visibility;
    NoProgress progress;
    OutdoorLight light;
};

Scene make_scene(SkyModel model) {
    Scene scene;
    scene.materials = {{.name = "facade", .reflectance = {0.2, 0.4, 0.6}, .exitance_lm_m2 = {1.0, 2.0, 3.0}}};
    scene.glazings = {{.name = "unglazed", .angular_law = AngularLaw::constant}};
    scene.ground = {.z_m = 0.0, .reflectance = grey(0.2)};
    scene.sky = {.model = model, .horizontal_illuminance_lx = 1.0};
    return scene;
}

/// Vertical, its lit side to the south, 2 m above the ground.
SurfacePolygon facade(double x0, double x1, double height, double y) {
    return {.id = "facade",
            .vertices_m = {{x0, y, 2}, {x1, y, 2}, {x1, y, 2 + height}, {x0, y, 2 + height}},
            .holes_m = {},
            .side = Environment::outdoor};
}

}  // namespace

TEST_CASE("open ground receives the sky's horizontal illuminance and the sun's", "[outdoors][analytic]") {
    Scene scene = make_scene(GENERATE(SkyModel::uniform, SkyModel::moon_spencer, SkyModel::cie_clear));
    scene.sun = {.altitude_rad = 0.5, .azimuth_rad = 1.0, .direct_normal_illuminance_lx = 10.0};
    const Outdoors outdoors(scene);
    const OutdoorIlluminance open = outdoors.at({3, 4, 5}, {0, 0, 1});
    // 1024 strata, judged by their centres: uniform exact, Moon & Spencer 0.25 % (luminance falls steeply at the
    // rim), clear 0.6 % (the peak around the sun is narrow).
    CHECK_THAT(open.sky_lx.g, WithinRel(1.0, scene.sky.model == SkyModel::uniform        ? 1e-12
                                             : scene.sky.model == SkyModel::moon_spencer ? 3e-3
                                                                                         : 1e-2));
    CHECK_THAT(open.sun_lx.g, WithinRel(10.0 * std::sin(0.5), 1e-14));
    CHECK(open.reflected_lx.total() == Band3{});
    const double ground_lx = outdoors.light.ground_luminance_cd_m2.total().g * pi / 0.2;
    CHECK_THAT(ground_lx, WithinRel(1.0 + 10.0 * std::sin(0.5), 1e-14));
}

TEST_CASE("a vertical plane under an overcast sky receives 0.396 of it, and half the ground", "[outdoors][analytic]") {
    const Outdoors outdoors(make_scene(SkyModel::moon_spencer));
    const double azimuth = GENERATE(0.0, 0.7, 2.0);
    const OutdoorIlluminance light = outdoors.at({0, 0, 5}, direction_from_angles(0.0, azimuth));
    // 3/14 + 4/(7 pi), Moon & Spencer; 1024 strata, of which 32 touch the horizon when turned.
    CHECK_THAT(light.sky_lx.g, WithinRel(3.0 / 14.0 + 4.0 / (7.0 * pi), 5e-3));
    CHECK_THAT(light.reflected_lx.sky.g, WithinRel(0.5 * 0.2, 5e-3));
    CHECK_THAT(light.sky_lx.g / 0.396177 + light.reflected_lx.sky.g / 0.1, WithinRel(2.0, 2e-3));
}

TEST_CASE("a facade has the luminance of what falls on it and of its own light", "[outdoors][analytic]") {
    Scene scene = make_scene(SkyModel::uniform);
    scene.polygons = {facade(0, 2, 2, 5)};
    scene.sun = {.altitude_rad = 0.5, .azimuth_rad = pi, .direct_normal_illuminance_lx = 10.0};
    const Outdoors outdoors(scene);
    REQUIRE(outdoors.grid.patches.size() == outdoors.grid.gather_patch_count + 4);
    const LightBySource seen = outdoors.seen({1.3, 0, 3.1}, {0, 1, 0});
    const double from_sky = 0.5 + 0.5 * 0.2;                                                // and the ground
    const double from_sun = 10.0 * std::cos(0.5) + 0.5 * 0.2 * 10.0 * std::sin(0.5);        // and the ground
    // The facade stands along an axis of the strata: half of them see the sky, exactly.
    CHECK_THAT(seen.sky.r, WithinRel(0.2 * from_sky / pi, 1e-12));
    CHECK_THAT(seen.sky.b, WithinRel(0.6 * from_sky / pi, 1e-12));
    CHECK_THAT(seen.other.r, WithinRel((0.2 * from_sun + 1.0) / pi, 1e-12));
    CHECK_THAT(seen.other.b, WithinRel((0.6 * from_sun + 3.0) / pi, 1e-12));
}

TEST_CASE("a direction outdoors brings sky, ground, or the patch it meets from the front", "[outdoors][property]") {
    Scene scene = make_scene(SkyModel::moon_spencer);
    SurfacePolygon indoor = facade(5, 7, 2, 5);
    indoor.side = Environment::indoor;
    scene.polygons = {facade(0, 2, 2, 5), indoor};
    const Outdoors outdoors(scene);
    bool is_sky = false;
    const glm::dvec3 up = glm::normalize(glm::dvec3{0, -1, 0.5}), down = glm::normalize(glm::dvec3{0, -1, -0.5});
    CHECK(outdoors.seen({1, 0, 3}, up, &is_sky).sky == grey(outdoors.light.sky.luminance(up).value));
    CHECK(is_sky);
    CHECK(outdoors.seen({1, 0, 3}, down, &is_sky).sky == outdoors.light.ground_luminance_cd_m2.sky);
    CHECK_FALSE(is_sky);
    CHECK(outdoors.seen({1, 0, 3}, {0, 1, 0}, &is_sky).other.g > 0.0);
    CHECK_FALSE(is_sky);
    CHECK(outdoors.seen({1, 9, 3}, {0, -1, 0}, &is_sky).total() == Band3{});  // from behind
    CHECK_FALSE(is_sky);
    CHECK(outdoors.seen({6, 0, 3}, {0, 1, 0}).total() == Band3{});  // indoor facet
}

TEST_CASE("a building in front takes sky and sun away and gives its light", "[outdoors][analytic]") {
    Scene scene = make_scene(SkyModel::uniform);
    scene.ground.reflectance = {};
    scene.sun = {.altitude_rad = 0.3, .azimuth_rad = 0.0, .direct_normal_illuminance_lx = 10.0};
    scene.grid.outdoor_spacing_m = 5.0;
    scene.polygons = {facade(-10, 10, 20, 4)};
    const Outdoors outdoors(scene);
    // A square of strata is hidden: the sky loses what the facade gives, per luminance.
    const OutdoorIlluminance light = outdoors.at({0, 0, 2}, {0, 0, 1});
    const LightBySource facade_luminance = outdoors.light.patch_luminance_cd_m2[outdoors.grid.gather_patch_count];
    // Configuration factor of a 20 x 20 m wall from the foot of its middle, 4 m away (Lambert).
    const double beta = std::atan(10.0 / 4.0), gamma = std::atan(20.0 / 4.0);
    const double share = 2 * (beta - std::atan(10.0 / std::hypot(4.0, 20.0)) * std::cos(gamma)) / (2 * pi);
    // 1024 strata: the outline of the wall crosses some 60 of them, at random.
    CHECK_THAT(light.sky_lx.g, WithinAbs(1.0 - share, 5e-3));
    const double facade_lx = pi * facade_luminance.other.g;  // if it filled the whole view
    CHECK_THAT(light.reflected_lx.other.g, WithinAbs(share * facade_lx, 5e-3 * facade_lx));
    CHECK(light.sun_lx == Band3{});
    CHECK(outdoors.at({0, 0, 2}, {0, 0, 1}).sky_lx == light.sky_lx);
}
