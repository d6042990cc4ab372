#include "tests/random_scenes.h"

#include <glm/geometric.hpp>

#include "core/polyhedra.h"

namespace naturel::tests {

using glm::dvec3;

Polyhedron box(std::string id, Effect effect, dvec3 low_m, dvec3 high_m) {
    const dvec3 size = high_m - low_m;
    return {.id = std::move(id),
            .kind = PolyhedronKind::parallelepiped,
            .effect = effect,
            .vertices_m = {low_m, low_m + dvec3(size.x, 0, 0), low_m + dvec3(0, size.y, 0), low_m + dvec3(0, 0, size.z)},
            .material = MaterialId{}};
}

Scene empty_scene(double reflectance) {
    Scene scene;
    scene.name = "test";
    scene.materials = {{.name = "surface", .reflectance = grey(reflectance)}};
    scene.glazings = {{.name = "unglazed", .angular_law = AngularLaw::constant}};
    scene.sky.horizontal_illuminance_lx = 10000.0;
    return scene;
}

Scene closed_room(dvec3 size_m, double reflectance, double floor_z_m) {
    Scene scene = empty_scene(reflectance);
    const dvec3 low(0, 0, floor_z_m);
    scene.polyhedra = {box("building", Effect::fill, low - 0.3, low + size_m + 0.3), box("room", Effect::carve, low, low + size_m)};
    return scene;
}

Scene random_scene(std::uint64_t seed, int count, Placement placement, double low_z_m) {
    Scene scene = empty_scene();
    std::mt19937_64 random(seed);
    // Not std::uniform_real_distribution: its values differ between standard libraries.
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const auto whole = [&](int low, int high) { return low + static_cast<int>(random() % static_cast<std::uint64_t>(high - low + 1)); };
    while (static_cast<int>(scene.polyhedra.size()) < count) {
        Polyhedron p{.id = "p" + std::to_string(scene.polyhedra.size()), .material = MaterialId{}};
        p.kind = static_cast<PolyhedronKind>(whole(0, 2));
        p.effect = whole(0, 1) == 0 ? Effect::fill : Effect::carve;
        if (placement == Placement::free) {
            const dvec3 origin(uniform(0, 8), uniform(0, 8), uniform(low_z_m + 3, low_z_m + 5));
            p.vertices_m[0] = origin;
            for (std::size_t k = 1; k < 4; ++k)
                p.vertices_m[k] = origin + dvec3(uniform(-1.5, 1.5), uniform(-1.5, 1.5), uniform(-1.0, 1.0)) * 1.4;
        } else {
            const dvec3 origin(whole(0, 6), whole(0, 6), low_z_m + whole(0, 5));
            p.vertices_m = {origin, origin + dvec3(whole(1, 3), 0, 0), origin + dvec3(0, whole(1, 3), 0),
                            origin + dvec3(whole(0, 3) == 0 ? 1 : 0, 0, whole(1, 3))};
        }
        const double size = glm::distance(p.vertices_m[0], p.vertices_m[1]) + glm::distance(p.vertices_m[0], p.vertices_m[2]) +
                            glm::distance(p.vertices_m[0], p.vertices_m[3]);
        if (volume_m3(p) > 1e-3 * size * size * size) scene.polyhedra.push_back(p);
    }
    return scene;
}

}  // namespace naturel::tests
