#include "tests/hall.h"

#include <random>
#include <string>

#include "tests/random_scenes.h"

namespace naturel::tests {

using glm::dvec3;

Scene hall_with_boxes(int count) {
    Scene scene = empty_scene();
    scene.polyhedra.push_back(box("hall", Effect::fill, {-0.3, -0.3, -0.3}, {40.3, 30.3, 8.3}));
    scene.polyhedra.push_back(box("air", Effect::carve, {0, 0, 0}, {40, 30, 8}));
    for (int k = 0; k < 8; ++k) {
        const double left = 1.0 + 5.0 * k;
        scene.polyhedra.push_back(box("window " + std::to_string(k), Effect::carve, {left, -0.4, 1.5}, {left + 3.0, 0.1, 5.5}));
    }
    std::mt19937_64 random(7);
    // Not std::uniform_real_distribution: its values differ between standard libraries.
    const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    for (int k = 0; k < count; ++k) {
        const double x = share(), y = share();
        const dvec3 low{39.0 * x, 29.0 * y, 0.0};
        const double width = share(), depth = share(), height = share();
        scene.polyhedra.push_back(box("box " + std::to_string(k), Effect::fill, low,
                                      low + dvec3(0.3 + 0.7 * width, 0.3 + 0.7 * depth, 0.4 + 1.6 * height)));
    }
    scene.ground.z_m = -0.3;
    scene.sun = SunDescription{.altitude_rad = 0.6, .azimuth_rad = 3.4, .direct_normal_illuminance_lx = 8e4};
    scene.grid.spacing_m = 0.5;
    return scene;
}

}  // namespace naturel::tests
