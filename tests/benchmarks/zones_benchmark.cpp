// What light zones and the grid that follows them cost.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "core/building.h"
#include "core/light_zones.h"
#include "core/patch_grid.h"
#include "core/scene_reader.h"
#include "tests/hall.h"

namespace naturel::tests {
namespace {

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
BENCHMARK(hall_zones)->Arg(50)->Arg(150)->Arg(500)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(hall_grid)->Arg(50)->Arg(150)->Arg(500)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

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
