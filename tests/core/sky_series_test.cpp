#include "core/sky_series.h"

#include <cmath>
#include <cstring>

#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;

namespace {

// A room with a desk and a glazed window on its south side; another building stands opposite.
Scene room_with_window() {
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.glazings.push_back({.name = "double", .normal_transmittance = grey(0.7), .panes = 2, .inner_reflectance = grey(0.15)});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    scene.polyhedra.push_back(box("desk", Effect::fill, {1, 1.5, 1.0}, {2.5, 2.3, 1.05}));
    scene.polyhedra.push_back(box("opposite", Effect::fill, {0, -12, 0}, {6, -9, 5}));
    scene.grid = {.spacing_m = 0.5, .outdoor_spacing_m = 2.0};
    scene.sensors = {{.id = "plane", .grid = SensorGrid{.z_m = 1.15, .spacing_m = 1.0, .margin_m = 0.5}},
                     {.id = "outdoors", .points = {{{2, -3, 1}, {0, 0, 1}}}}};
    return scene;
}

struct Room {
    explicit Room(Scene base, const Backend& backend, bool zones = true)
        : scene(std::move(base)), building(assemble(scene)),
          grid(make_patch_grid(building, scene.grid, zones ? find_light_zones(scene, building, nullptr) : LightZones{})),
          visibility(backend.make(building, grid)),
          form_factors(compute_form_factors(*visibility, grid, options.form_factors, progress)),
          sensors(place_sensors(scene, building)) {}

    SkySeries series() { return {scene, building, grid, *visibility, form_factors, sensors, options, progress}; }
    DaylightSolution slowly(const Scene& variant) {
        return compute_daylight(variant, building, grid, *visibility, options, sensors, progress);
    }

    DaylightOptions options{};
    NoProgress progress{};
    Scene scene;
    Building building;
    PatchGrid grid;
    std::unique_ptr<Visibility> visibility;
    FormFactors form_factors;
    std::vector<Sensor> sensors;
};

double grey_lx(const Band3& light) { return (light.r + light.g + light.b) / 3.0; }

}  // namespace

TEST_CASE("a series answers without the sun as a calculation of its own", "[sky_series]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Room room(room_with_window(), backend);
    const std::vector<DaylightSolution> solutions = room.series().solve({&room.scene, 1}, room.progress);
    REQUIRE(solutions.size() == 1);
    const DaylightSolution& found = solutions[0];
    const DaylightSolution expected = room.slowly(room.scene);
    CHECK(found.radiosity.converged);
    CHECK(found.sensors.size() == room.sensors.size());
    REQUIRE(found.sensor_values.size() == expected.sensor_values.size());
    // Each direct part aims at the tolerance of 1e-3, IRC is a mean of many.
    for (std::size_t s = 0; s < found.sensor_values.size(); ++s) {
        const PointIlluminance &a = found.sensor_values[s], &b = expected.sensor_values[s];
        CHECK(std::abs(grey_lx(a.total_lx() - b.total_lx())) <= 2e-3 * grey_lx(b.total_lx()));
        CHECK(std::abs(grey_lx(a.indirect_lx.total() - b.indirect_lx.total())) <= 1e-3 * grey_lx(b.indirect_lx.total()));
    }
}
