// What light zones and the grid that follows them cost.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <random>

#include "core/building.h"
#include "core/light_zones.h"
#include "core/patch_grid.h"
#include "core/scene_reader.h"
#include "tests/random_scenes.h"

namespace naturel::tests {
namespace {

using glm::dvec3;

/// A hall of 40 x 30 x 8 m with eight windows in its south wall, the sun in them, and `count` boxes at random on its floor.
Scene hall_with_boxes(int count) {
    Scene scene = empty_scene();
    scene.polyhedra.push_back(box("hall", Effect::fill, {-0.3, -0.3, -0.3}, {40.3, 30.3, 8.3}));
    scene.polyhedra.push_back(box("air", Effect::carve, {0, 0, 0}, {40, 30, 8}));
    for (int k = 0; k < 8; ++k) {
        const double left = 1.0 + 5.0 * k;
        scene.polyhedra.push_back(box("window " + std::to_string(k), Effect::carve, {left, -0.4, 1.5}, {left + 3.0, 0.1, 5.5}));
    }
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int k = 0; k < count; ++k) {
        const dvec3 low{39.0 * share(random), 29.0 * share(random), 0.0};
        const dvec3 size{0.3 + 0.7 * share(random), 0.3 + 0.7 * share(random), 0.4 + 1.6 * share(random)};
        scene.polyhedra.push_back(box("box " + std::to_string(k), Effect::fill, low, low + size));
    }
    scene.ground.z_m = -0.3;
    scene.sun = SunDescription{.altitude_rad = 0.6, .azimuth_rad = 3.4, .direct_normal_illuminance_lx = 8e4};
    scene.grid.spacing_m = 0.5;
    return scene;
}

void find_zones(benchmark::State& state, const Scene& scene, const Building& building) {
    for (auto _ : state) benchmark::DoNotOptimize(find_light_zones(scene, building));
}

void lay_grid(benchmark::State& state, const Scene& scene, const Building& building) {
    const LightZones zones = find_light_zones(scene, building);
    std::size_t patches = 0;
    for (auto _ : state) patches = make_patch_grid(building, scene.grid, zones).patches.size();
    state.counters["patches"] = static_cast<double>(patches);
}

void hall_zones(benchmark::State& state) {
    const Scene scene = hall_with_boxes(static_cast<int>(state.range(0)));
    find_zones(state, scene, assemble(scene));
}
void hall_grid(benchmark::State& state) {
    const Scene scene = hall_with_boxes(static_cast<int>(state.range(0)));
    lay_grid(state, scene, assemble(scene));
}
BENCHMARK(hall_zones)->Arg(50)->Arg(500)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(hall_grid)->Arg(50)->Arg(500)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

Scene office() { return read_scene(std::filesystem::path(NATUREL_SOURCE_DIR) / "scenes/furnished_office.json"); }

void office_zones(benchmark::State& state) {
    const Scene scene = office();
    find_zones(state, scene, assemble(scene));
}
void office_grid(benchmark::State& state) {
    const Scene scene = office();
    lay_grid(state, scene, assemble(scene));
}
BENCHMARK(office_zones)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(office_grid)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace
}  // namespace naturel::tests
