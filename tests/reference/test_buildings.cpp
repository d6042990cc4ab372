#include "tests/reference/test_buildings.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <string>

#include "core/polyhedra.h"
#include "core/sun.h"
#include "tests/random_scenes.h"

namespace naturel::tests {

namespace {

using glm::dvec3;

// Not std::uniform_real_distribution: its values differ between standard libraries.
class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high) { return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53; }
    int whole(int low, int high) { return low + static_cast<int>(engine_() % static_cast<std::uint64_t>(high - low + 1)); }
    // On a grid of 0.25 m, so that faces of different things often coincide.
    double coarse(double low, double high) { return 0.25 * whole(static_cast<int>(4.0 * low), static_cast<int>(4.0 * high)); }

private:
    std::mt19937_64 engine_;
};

Polyhedron thing(Random& random, const std::string& id, const dvec3& low_m, const dvec3& high_m) {
    const bool upright = random.whole(0, 2) > 0;
    if (upright) {
        const dvec3 origin(random.coarse(low_m.x, high_m.x), random.coarse(low_m.y, high_m.y), random.coarse(low_m.z, high_m.z));
        return box(id, Effect::fill, origin, origin + dvec3(random.coarse(0.25, 1), random.coarse(0.25, 1), random.coarse(0.25, 1)));
    }
    Polyhedron p{.id = id, .kind = static_cast<PolyhedronKind>(random.whole(0, 2)), .material = MaterialId{}};
    do {
        p.vertices_m[0] = {random.uniform(low_m.x, high_m.x), random.uniform(low_m.y, high_m.y), random.uniform(low_m.z, high_m.z)};
        for (std::size_t k = 1; k < 4; ++k)
            p.vertices_m[k] = p.vertices_m[0] + dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    } while (volume_m3(p) < 0.02);
    return p;
}

}  // namespace

Scene random_building(std::uint64_t seed) {
    Random random(seed);
    Scene scene = empty_scene();
    scene.glazings.push_back({.name = "clear", .normal_transmittance = grey(0.88)});
    scene.glazings.push_back({.name = "red", .normal_transmittance = {0.7, 0.2, 0.1}, .panes = 2, .frame = 0.8});
    const auto any_glazing = [&] { return make_id<GlazingId>(static_cast<std::size_t>(random.whole(0, 2))); };
    const bool basement = seed % 3 == 2;
    const double floor = basement ? -2.0 : 0.0;
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, 0}, {8.3, 5.3, 3.1}),
                       box("west", Effect::carve, {0, 0, floor}, {4, 5, 2.75}),
                       box("east", Effect::carve, {4.25, 0, 0}, {8, 5, 2.75})};
    Polyhedron door = box("door", Effect::carve, {4, 1, 0}, {4.25, 3, 2});
    door.faces[4].glazing = any_glazing();
    scene.polyhedra.push_back(door);
    const int windows = random.whole(2, 4);
    for (int k = 0; k < windows; ++k) {
        const double x = random.coarse(0.25, 6), z = random.coarse(0.25, 1.5), w = random.coarse(0.5, 1.5), h = random.coarse(0.5, 1);
        Polyhedron window = box("window " + std::to_string(k), Effect::carve, {}, {1, 1, 1});
        switch (random.whole(0, 3)) {
            case 0:  // south wall
                window.vertices_m = {dvec3(x, -0.5, z), dvec3(x + w, -0.5, z), dvec3(x, 0, z), dvec3(x, -0.5, z + h)};
                break;
            case 1:  // a triangle in the south wall
                window.kind = PolyhedronKind::prism;
                window.vertices_m = {dvec3(x, 0, z), dvec3(x + w, 0, z), dvec3(x, 0, z + h), dvec3(x, -0.5, z)};
                break;
            case 2:  // splayed through the roof
                window.vertices_m = {dvec3(x, 1.5, 2.75), dvec3(x + w, 1.5, 2.75), dvec3(x, 2.5, 2.75), dvec3(x, 1.25, 3.25)};
                break;
            default:  // east wall
                window.vertices_m = {dvec3(8, 1, z), dvec3(8.5, 1, z), dvec3(8, 1 + w, z), dvec3(8, 1, z + h)};
        }
        window.glazing = any_glazing();
        scene.polyhedra.push_back(window);
    }
    if (basement) scene.polyhedra.push_back(box("pit", Effect::carve, {-1, 2, -1.5}, {0, 3, 0.5}));
    const int furniture = random.whole(3, 12), outdoors = random.whole(0, 6);
    for (int k = 0; k < furniture; ++k)
        scene.polyhedra.push_back(thing(random, "thing " + std::to_string(k), {0, 0.25, floor}, {7, 4, 1.5}));
    for (int k = 0; k < outdoors; ++k)
        scene.polyhedra.push_back(thing(random, "outdoors " + std::to_string(k), {0, -3, 0}, {9, -1.5, 3}));
    const double y = random.uniform(0.5, 2);
    scene.polygons = {{.id = "shelf", .vertices_m = {{0.5, y, 1}, {2, y, 1}, {2, y + 1, 1.3}, {0.5, y + 1, 1.3}}, .two_sided = true}};
    return scene;
}

Scene polygon_room(dvec3 size_m) {
    Scene scene = empty_scene();
    const double x = size_m.x, y = size_m.y, z = size_m.z;
    scene.polygons = {{.id = "floor", .vertices_m = {{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}}},
                      {.id = "ceiling", .vertices_m = {{0, 0, z}, {0, y, z}, {x, y, z}, {x, 0, z}}},
                      {.id = "south", .vertices_m = {{0, 0, 0}, {0, 0, z}, {x, 0, z}, {x, 0, 0}}},
                      {.id = "north", .vertices_m = {{0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}}},
                      {.id = "west", .vertices_m = {{0, 0, 0}, {0, y, 0}, {0, y, z}, {0, 0, z}}},
                      {.id = "east", .vertices_m = {{x, 0, 0}, {x, 0, z}, {x, y, z}, {x, y, 0}}}};
    return scene;
}

dvec3 random_sun(std::uint64_t seed) {
    Random random(seed + 7);
    // Mostly from the south, where the windows are.
    return direction_from_angles(random.uniform(0.1, 1.5), random.uniform(0.4, 1.6) * std::numbers::pi);
}

}  // namespace naturel::tests
