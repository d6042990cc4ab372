#include <cmath>

#include "core/daylight.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

/// Form factor from a point to an a x b rectangle in a parallel plane at distance c, the point in front of a corner.
double corner_form_factor(double a, double b, double c) {
    const double A = a / c, B = b / c, ra = std::sqrt(1 + A * A), rb = std::sqrt(1 + B * B);
    return (A / ra * std::atan(B / ra) + B / rb * std::atan(A / rb)) / (2.0 * pi);
}

}  // namespace

TEST_CASE("a glowing room lends the other its light through a pane, whichever of the two it is",
          "[daylight][glazing][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    const bool first_glows = GENERATE(true, false);
    INFO(backend.name << ", " << (first_glows ? "first" : "second") << " room glows");
    constexpr double exitance = 1000.0;
    const Band3 transmittance{0.8, 0.5, 0.0};  // of the pane, the same at every angle

    // Two rooms of 2 m x 3 m x 2 m side by side in y; between them, at y = 3, a pane of the whole section.
    Scene scene = closed_room({2, 3, 2}, 0.0, 0.3);
    scene.polyhedra[0].vertices_m[2].y += 4.0;
    scene.materials.push_back({.name = "glow", .reflectance = grey(0.0), .exitance_lm_m2 = grey(exitance)});
    scene.glazings.push_back(
        {.name = "pane", .normal_transmittance = transmittance, .angular_law = AngularLaw::constant});
    scene.polyhedra.push_back(box("second", Effect::carve, {0, 3, 0.3}, {2, 6, 2.3}));
    scene.polyhedra.back().faces[2].glazing = make_id<GlazingId>(scene.glazings.size() - 1);
    scene.polyhedra[first_glows ? 1 : 2].material = make_id<MaterialId>(1);
    scene.grid = {.spacing_m = 0.5};
    // In the dark room, 1 m from the pane on its axis, facing it.
    scene.sensors = {{.id = "p", .points = {{{1, first_glows ? 4.0 : 2.0, 1.3}, {0, first_glows ? -1.0 : 1.0, 0}}}}};

    Building building = assemble(scene);
    REQUIRE(building.apertures.size() == 1);
    REQUIRE(building.apertures[0].inner);
    const PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building));
    const auto visibility = backend.make(building, grid);
    NoProgress progress;
    const DaylightSolution solution = compute_daylight(scene, building, grid, *visibility, {}, progress);

    // The pane sees nothing but glow, so its far side emits transmittance x exitance, evenly.
    const double form_factor = 4.0 * corner_form_factor(1.0, 1.0, 1.0);
    const Band3 sensor = solution.sensor_values[0].total_lx();
    // 1 %: rays and cells that meet the edge of the pane.
    CHECK_THAT(sensor.r, WithinRel(0.8 * exitance * form_factor, 0.01));
    CHECK_THAT(sensor.g, WithinRel(0.5 * exitance * form_factor, 0.01));
    CHECK(sensor.b == 0.0);

    // Glowing surfaces give; black ones take. What the pane does not let pass it absorbs.
    const RadiositySolution& radiosity = solution.radiosity;
    const double glowing_m2 = 2 * (2 * 3) + 2 * (2 * 3) + 2 * 2;
    for (const auto band : {&Band3::r, &Band3::g, &Band3::b}) {
        CHECK_THAT(radiosity.flux_in_lm.*band, WithinRel(exitance * glowing_m2, 1e-9));
        CHECK_THAT(radiosity.flux_absorbed_lm.*band + radiosity.flux_lost_lm.*band,
                   WithinRel(radiosity.flux_in_lm.*band, 1e-5));
    }
    CHECK(solution.radiosity.converged);
}
