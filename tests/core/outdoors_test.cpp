#include "core/outdoors.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "core/sun.h"
#include "tests/catch.h"
#include "core/direct.h"
#include "tests/random_scenes.h"
#include "tests/reference/brute_force_visibility.h"
#include "tests/reference/light_by_clipping.h"

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
        return outdoor_illuminance(light, building, grid, FacetTree(building), visibility, {position_m, normal});
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
    // Uniform: contour integrals; else the tolerance.
    CHECK_THAT(open.sky_lx.g, WithinRel(1.0, scene.sky.model == SkyModel::uniform ? 1e-9 : 1e-3));
    CHECK_THAT(open.sun_lx.g, WithinRel(10.0 * std::sin(0.5), 1e-14));
    CHECK(open.reflected_lx.total() == Band3{});
    const double ground_lx = outdoors.light.ground_luminance_cd_m2.total().g * pi / 0.2;
    CHECK_THAT(ground_lx, WithinRel(1.0 + 10.0 * std::sin(0.5), 1e-14));
}

TEST_CASE("a vertical plane under an overcast sky receives 0.396 of it, and half the ground", "[outdoors][analytic]") {
    const Outdoors outdoors(make_scene(SkyModel::moon_spencer));
    const double azimuth = GENERATE(0.0, 0.7, 2.0);
    const OutdoorIlluminance light = outdoors.at({0, 0, 5}, direction_from_angles(0.0, azimuth));
    // 3/14 + 4/(7 pi), Moon & Spencer; the tolerance.
    CHECK_THAT(light.sky_lx.g, WithinRel(3.0 / 14.0 + 4.0 / (7.0 * pi), 1e-3));
    CHECK_THAT(light.ground_lx.sky.g, WithinRel(0.5 * 0.2, 1e-9));
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
    // The tolerance of what sky and wall give together.
    CHECK_THAT(light.sky_lx.g, WithinAbs(1.0 - share, 1e-3));
    const double facade_lx = pi * facade_luminance.other.g;  // if it filled the whole view
    CHECK_THAT(light.reflected_lx.other.g, WithinAbs(share * facade_lx, 1e-3 * facade_lx));
    CHECK(light.sun_lx == Band3{});
    CHECK(outdoors.at({0, 0, 2}, {0, 0, 1}).sky_lx == light.sky_lx);
}

TEST_CASE("each outdoor interreflection adds its term of the furnace's series", "[outdoors][analytic]") {
    Scene scene = make_scene(SkyModel::uniform);
    scene.materials = {{.name = "glow", .reflectance = grey(0.5), .exitance_lm_m2 = grey(1.0)}};
    scene.ground.z_m = -1.0;
    scene.grid.outdoor_spacing_m = 2.0;
    scene.outdoors.interreflections = GENERATE(0, 1, 4);
    // A closed box, its lit sides inwards: no sky, no ground, and nothing that leaves.
    const double x = 4, y = 3, z = 2;
    const std::vector<std::vector<glm::dvec3>> sides{
        {{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}}, {{0, 0, z}, {0, y, z}, {x, y, z}, {x, 0, z}},
        {{0, 0, 0}, {0, 0, z}, {x, 0, z}, {x, 0, 0}}, {{0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}},
        {{0, 0, 0}, {0, y, 0}, {0, y, z}, {0, 0, z}}, {{x, 0, 0}, {x, 0, z}, {x, y, z}, {x, y, 0}}};
    for (const auto& side : sides)
        scene.polygons.push_back({.id = "side " + std::to_string(scene.polygons.size()), .vertices_m = side, .side = Environment::outdoor});
    const Outdoors outdoors(scene);
    // M (1 + rho + ... + rho^(n + 1))
    const double expected = (1.0 - std::pow(0.5, scene.outdoors.interreflections + 2)) / 0.5;
    for (std::size_t p = outdoors.grid.gather_patch_count; p < outdoors.grid.patches.size(); ++p) {
        // 1e-3: the tolerance; edges between sides of one luminance cost nothing.
        CHECK_THAT(pi * outdoors.light.patch_luminance_cd_m2[p].other.g, WithinRel(expected, 1e-3));
        CHECK_THAT(outdoors.light.patch_luminance_cd_m2[p].sky.g, WithinAbs(0.0, 1e-9));
    }
}

TEST_CASE("a long wall hides its share of a uniform sky from the ground in front of it", "[outdoors][analytic]") {
    Scene scene = make_scene(SkyModel::uniform);
    scene.materials = {{.name = "black", .reflectance = {}}};
    scene.grid.outdoor_spacing_m = 0.5;
    scene.ground.shadows = true;
    const double h = 4.0;
    scene.polyhedra = {box("wall", Effect::fill, {-60, 0, 0}, {60, 0.4, h})};
    scene.grid.outdoor_spacing_m = 1.0;
    const Outdoors outdoors(scene);
    for (const double d : {0.01, 0.7, 1.7, 4.0, 9.0, 30.0}) {
        CAPTURE(d);
        const LightBySource seen = outdoor_luminance(outdoors.light, outdoors.building, outdoors.grid, {0, -d, 10}, {0, 0, -1}, FacetId::none);
        const double expected = 1.0 - 0.5 * (1.0 - d / std::hypot(d, h));
        // 1 %: interpolation over cells of 1 m and more; the wall is 30 heights long, not endless.
        CHECK_THAT(pi * seen.sky.g / 0.2, WithinRel(expected, 0.01));
    }
}

TEST_CASE("the ERC of a facade opposite is what quadrature gives", "[outdoors][direct][analytic]") {
    Scene scene = make_scene(SkyModel::uniform);
    scene.materials = {{.name = "facade", .reflectance = grey(0.4)}};
    scene.grid.outdoor_spacing_m = 4.0;
    scene.polygons = {{.id = "opposite", .vertices_m = {{-9, 8, 2}, {5, 8, 2}, {5, 8, 9}, {-9, 8, 9}}, .side = Environment::outdoor}};
    scene.apertures = {{.id = "w", .vertices_m = {{-1, 2, 1.9}, {1, 2, 1.9}, {1, 2, 3.4}, {-1, 2, 3.4}}}};
    const Outdoors outdoors(scene);
    const DirectLight direct(outdoors.scene, outdoors.building, outdoors.grid, outdoors.light, outdoors.visibility);
    // Half a uniform sky and half the open ground light all of it evenly.
    const double luminance = 0.4 * (0.5 + 0.5 * 0.2) / pi;
    for (const glm::dvec3& normal : {glm::dvec3{0, 0, 1}, glm::dvec3{0, 1, 0}, glm::normalize(glm::dvec3{0.5, 0.5, 0.4})}) {
        const GatherPoint point{{0.3, 0, 1.85}, normal};
        const double expected = illuminance_by_clipping(point, {scene.apertures[0].vertices_m, {}},
                                                        {{scene.polygons[0].vertices_m, [&](const glm::dvec3&) { return luminance; }}},
                                                        [](const glm::dvec3&) { return 0.0; });
        const DirectIlluminance light = direct.without_sun(point);
        CHECK_THAT((light.outdoor_lx.total() - light.ground_lx.total()).g, WithinRel(expected, 2e-3));
    }
}
