#include "core/sensors.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using glm::dvec3;

namespace {

std::vector<Sensor> sensors_of(Scene scene, SensorGrid grid) {
    scene.sensors = {{.id = "plane", .grid = grid}};
    return place_sensors(scene, assemble(scene));
}

}  // namespace

TEST_CASE("a sensor grid keeps its margin and is centred in the room", "[core][sensors]") {
    const auto sensors = sensors_of(closed_room({4, 5.2, 3}), {.z_m = 0.85, .spacing_m = 0.5, .margin_m = 0.5});
    REQUIRE(sensors.size() == 7 * 9);
    CHECK(glm::distance(sensors.front().point.position_m, dvec3(0.5, 0.6, 0.85)) < 1e-8);
    CHECK(glm::distance(sensors.back().point.position_m, dvec3(3.5, 4.6, 0.85)) < 1e-8);
    CHECK(sensors.front().id == "plane/1");
    for (const Sensor& sensor : sensors) CHECK((sensor.medium == Medium::indoor_air));
}

TEST_CASE("a window reveal does not shift the sensor grid", "[core][sensors]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.6, 0.5}, {3, 0, 2}));
    const auto sensors = sensors_of(scene, {.z_m = 0.85, .spacing_m = 0.5, .margin_m = 0.5});
    REQUIRE(sensors.size() == 7 * 9);
    CHECK(glm::distance(sensors.front().point.position_m, dvec3(0.5, 0.5, 0.85)) < 1e-8);
}

TEST_CASE("sensor grids leave out what stands in the room and cover every room", "[core][sensors]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polyhedra.push_back(box("pillar", Effect::fill, {1.8, 2.3, 0}, {2.2, 2.7, 3}));
    CHECK(sensors_of(scene, {.z_m = 0.85, .spacing_m = 0.5, .margin_m = 0.5}).size() == 7 * 9 - 9);  // the pillar and 0.5 m around it
    Scene two = empty_scene();
    two.polyhedra = {box("building", Effect::fill, {-1, -1, 0}, {12, 6, 4}), box("west", Effect::carve, {0, 0, 0}, {4, 5, 3}),
                     box("east", Effect::carve, {6, 0, 0}, {10, 5, 3})};
    CHECK(sensors_of(two, {.z_m = 0.85, .spacing_m = 0.5, .margin_m = 0.5}).size() == 2 * 7 * 9);
    CHECK(sensors_of(two, {.z_m = 3.5, .spacing_m = 0.5, .margin_m = 0.5}).empty());
    CHECK(sensors_of(two, {.z_m = 0.85, .spacing_m = 0.5, .margin_m = 2.1}).empty());
}

TEST_CASE("a sensor on a surface is lifted off it and knows what surrounds it", "[core][sensors]") {
    Scene scene = closed_room({4, 5, 3});
    scene.sensors = {{.id = "p",
                      .points = {{{2, 2, 0}, {0, 0, 1}}, {{0, 1, 1}, {1, 0, 0}}, {{2, 2, 3.1}, {0, 0, 1}}, {{9, 9, 1}, {0, 0, 1}}}}};
    const auto sensors = place_sensors(scene, assemble(scene));
    REQUIRE(sensors.size() == 4);
    CHECK_THAT(sensors[0].point.position_m.z, WithinAbs(1e-5, 1e-12));
    CHECK_THAT(sensors[1].point.position_m.x, WithinAbs(1e-5, 1e-12));
    CHECK((sensors[0].medium == Medium::indoor_air));
    CHECK((sensors[2].medium == Medium::solid));
    CHECK((sensors[3].medium == Medium::outdoor_air));
}

TEST_CASE("an indoor polygon does not draw the open air indoors, a room of polygons does", "[core][sensors]") {
    Scene scene = closed_room({4, 5, 3});
    scene.polygons = {{.id = "shelf", .vertices_m = {{1, 1, 1}, {2, 1, 1}, {2, 2, 1}, {1, 2, 1}}}};
    scene.sensors = {{.id = "p", .points = {{{2, -5, 1}, {0, 0, 1}}}}};
    CHECK((place_sensors(scene, assemble(scene))[0].medium == Medium::outdoor_air));

    Scene imported = empty_scene();
    imported.polygons = {{.id = "floor", .vertices_m = {{0, 0, -1}, {4, 0, -1}, {4, 5, -1}, {0, 5, -1}}}};
    imported.polyhedra = {box("tower", Effect::fill, {20, 20, 0}, {25, 25, 9}), box("crate", Effect::fill, {0, 0, -1}, {1, 1, 1})};
    imported.sensors = {{.id = "plane", .grid = SensorGrid{.z_m = -0.2, .spacing_m = 1.0, .margin_m = 0.5}}};
    const auto sensors = place_sensors(imported, assemble(imported));
    REQUIRE(sensors.size() == 4 * 5 - 1);  // the crate and less than 0.5 m around it
    for (const Sensor& sensor : sensors) CHECK((sensor.medium == Medium::indoor_air));
}

TEST_CASE("neither an alcove nor a pillar shifts the sensor grid", "[core][sensors]") {
    // The alcove is 1 m wide, less than half of the room: the grid is centred in the 5 m of the room alone. The pillar, between the
    // points, takes its own width away.
    Scene scene = empty_scene();
    scene.polyhedra = {box("building", Effect::fill, {-2, -2, 0}, {9, 12, 4}), box("room", Effect::carve, {0, 0, 0}, {6, 5, 3}),
                       box("alcove", Effect::carve, {2, 5, 0}, {3, 9, 3}), box("pillar", Effect::fill, {2.75, 2.25, 0}, {3.25, 2.75, 3})};
    const auto sensors = sensors_of(scene, {.z_m = 0.85, .spacing_m = 1.0, .margin_m = 0.0});
    // y: 0 to 5 m in the room and on to 9 m in the alcove; x: 0 to 6 m. Points on the outline count or not by rounding.
    std::size_t inside = 0;
    for (const Sensor& sensor : sensors) {
        const auto& p = sensor.point.position_m;
        CHECK(std::abs(p.x - std::round(p.x)) < 1e-4);
        CHECK(std::abs(p.y - std::round(p.y)) < 1e-4);
        if (p.x > 0.5 && p.x < 5.5 && p.y > 0.5 && p.y < 4.5) ++inside;
    }
    CHECK(inside == 5 * 4);
}
