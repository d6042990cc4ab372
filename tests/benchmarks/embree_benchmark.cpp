// What form factors cost: pairwise, hemispheres of rays, and Embree alone.
#include <benchmark/benchmark.h>
#ifdef NATUREL_HAS_EMBREE
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <vector>

#include "core/parallel.h"
#include "core/patch_grid.h"
#include "core/scene_reader.h"
#include "embree_backend/embree_visibility.h"
#include "embree_backend/pairwise.h"
#include "tests/reference/occluded_pairs.h"

namespace naturel::tests {
namespace {

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void pairwise(benchmark::State& state) {
    const ThreadLimit one(1);
    const Building building = assemble(room_with_boxes(static_cast<int>(state.range(0))));
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.25});
    const PairwiseExchange exchange(building, grid, {.tolerance = std::pow(10.0, -static_cast<double>(state.range(1)))});
    NoProgress quiet;
    PairwiseCount count;
    double seconds = 0.0, worst = 0.0;
    std::size_t runs = 0;
    for (auto _ : state) {
        const double start = cpu_seconds();
        count = {};
        const FormFactorRows rows = exchange.rows(true, quiet, &count);
        seconds += cpu_seconds() - start;
        ++runs;
        worst = 0.0;
        for (std::size_t i = 0; i + 1 < rows.row_begin.size(); ++i) {
            double sum = 0.0;
            for (auto e = rows.row_begin[i]; e < rows.row_begin[i + 1]; ++e) sum += rows.value[e];
            worst = std::max(worst, std::abs(sum - 1.0));
        }
    }
    const double n = static_cast<double>(grid.gather_patch_count), pairs = n * (n - 1) / 2;
    state.counters["patches"] = n;
    state.counters["Mpairs/s"] = 1e-6 * pairs * static_cast<double>(runs) / seconds;
    state.counters["facing"] = static_cast<double>(count.facing) / pairs;
    state.counters["blocked"] = static_cast<double>(count.blocked) / pairs;
    state.counters["partial"] = static_cast<double>(count.partial) / pairs;
    state.counters["worst_row"] = worst;
}
BENCHMARK(pairwise)->Args({0, 4})->Args({24, 4})->Args({24, 5})->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->Iterations(1);

double wall_seconds() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

/// All rows of the furnished office by one thread and by two, in turn. cpu_ratio: CPU time of two over that of one, which tells
/// what the second thread costs even where other programs take their share of the machine.
void rows_on_threads(benchmark::State& state) {
    const Building building = assemble(read_scene(std::filesystem::path(NATUREL_SOURCE_DIR) / "scenes/furnished_office.json"));
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.25});
    const bool pairwise = state.range(0) == 0;
    const auto visibility = make_embree_visibility(
        building, grid,
        {.form_factors = pairwise ? FormFactorMethod::pairwise : FormFactorMethod::hemisphere,
         .rays_per_patch = static_cast<int>(state.range(0))});
    NoProgress quiet;
    std::vector<double> wall[2], cpu[2], speedup, cpu_ratio;
    for (auto _ : state) {
        for (int threads = 1; threads <= 2; ++threads) {
            const ThreadLimit limit(threads);
            const double start = wall_seconds(), cpu_start = cpu_seconds();
            benchmark::DoNotOptimize(visibility->form_factor_rows(grid.gather_patch_count, true, quiet));
            wall[threads - 1].push_back(wall_seconds() - start);
            cpu[threads - 1].push_back(cpu_seconds() - cpu_start);
        }
        speedup.push_back(wall[0].back() / wall[1].back());
        cpu_ratio.push_back(cpu[1].back() / cpu[0].back());
    }
    state.counters["wall1"] = median(wall[0]);
    state.counters["wall2"] = median(wall[1]);
    state.counters["speedup"] = median(speedup);
    state.counters["cpu_ratio"] = median(cpu_ratio);
}
BENCHMARK(rows_on_threads)->ArgName("rays")->Arg(4096)->Arg(16384)->Arg(0)->Unit(benchmark::kSecond)->Iterations(7);

}  // namespace
}  // namespace naturel::tests
#endif
