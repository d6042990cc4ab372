// What each further sky of a series costs next to a calculation of its own: 1000 jobs in one room, 500 clear skies with the sun in as
// many places x 2 sets of reflectances. CPU time, so that other work on the machine matters little.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <map>

#include "core/parallel.h"
#include "core/scene_reader.h"
#include "core/sky_series.h"
#include "tests/all_backends.h"

namespace naturel::tests {
namespace {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
double wall_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// CPU time of each stage, ms.
class StageCosts final : public Progress {
public:
    void begin(std::string_view stage, std::size_t) override { name_ = stage, start_ = cpu_seconds(); }
    void advance(std::size_t) override {}
    void end() override { milliseconds[name_] += 1e3 * (cpu_seconds() - start_); }
    bool interrupted() const override { return false; }

    std::map<std::string, double> milliseconds;

private:
    std::string name_;
    double start_ = 0.0;
};

/// Suns all over the southern sky, with the clear or cloudy skies that go with them.
std::vector<Scene> jobs_of(const Scene& base, std::size_t skies) {
    std::vector<Scene> jobs;
    for (const double factor : {1.0, 0.8}) {
        for (std::size_t k = 0; k < skies; ++k) {
            Scene job = base;
            job.views.clear();
            for (Material& material : job.materials) material.reflectance = factor * material.reflectance;
            const double turn = static_cast<double>(k) / static_cast<double>(skies);
            job.sun = SunDescription{.altitude_rad = 0.15 + 0.9 * std::fmod(7.0 * turn, 1.0),
                                     .azimuth_rad = 1.6 + 3.1 * turn,
                                     .direct_normal_illuminance_lx = k % 3 == 0 ? 0.0 : 8e4};
            job.sky = {.model = k % 3 == 0 ? SkyModel::moon_spencer : SkyModel::cie_clear, .horizontal_illuminance_lx = 12000.0};
            jobs.push_back(std::move(job));
        }
    }
    return jobs;
}

void series(benchmark::State& state, const Backend& backend, const char* file) {
    const ThreadLimit limit(2);
    SceneDefaults defaults;
    defaults.grid.spacing_m = 0.25;
    const Scene scene = read_scene(std::string(NATUREL_SOURCE_DIR) + "/scenes/" + file, defaults);
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building, nullptr));
    const auto visibility = backend.make(building, grid);
    const DaylightOptions options;
    NoProgress progress;
    const std::vector<Sensor> sensors = place_sensors(scene, building);
    const std::vector<Scene> jobs = jobs_of(scene, 500);
    for (auto _ : state) {
        const double begin = wall_seconds();
        benchmark::DoNotOptimize(compute_daylight(jobs[1], building, grid, *visibility, options, sensors, progress));
        const double alone = wall_seconds() - begin;

        const double start = wall_seconds(), start_cpu = cpu_seconds();
        const FormFactors form_factors = compute_form_factors(*visibility, grid, options.form_factors, progress);
        StageCosts costs;
        SkySeries series(scene, building, grid, *visibility, form_factors, sensors, options, costs);
        series.solve({&jobs[1], 1}, costs);
        const double first = wall_seconds() - start, first_cpu = cpu_seconds() - start_cpu;
        benchmark::DoNotOptimize(series.solve({&jobs[501], 1}, progress));
        const double second_cpu = cpu_seconds() - start_cpu - first_cpu;
        const double before = cpu_seconds(), before_wall = wall_seconds();
        benchmark::DoNotOptimize(series.solve(jobs, progress));
        const double each = (cpu_seconds() - before) / static_cast<double>(jobs.size());
        const double each_wall = (wall_seconds() - before_wall) / static_cast<double>(jobs.size());
        for (const auto& [stage, milliseconds] : costs.milliseconds) state.counters["first: " + stage] = milliseconds;
        state.counters["alone_ms"] = 1e3 * alone;
        state.counters["first_ms"] = 1e3 * first;
        state.counters["first_cpu_ms"] = 1e3 * first_cpu;
        state.counters["reflectances_cpu_ms"] = 1e3 * second_cpu;
        state.counters["each_cpu_ms"] = 1e3 * each;
        state.counters["each_ms"] = 1e3 * each_wall;
        state.counters["jobs/s"] = static_cast<double>(jobs.size()) / (wall_seconds() - start);
    }
}

const int registered = [] {
    for (const Backend& backend : all_backends()) {
        if (backend.name != "embree") continue;
        for (const char* file : {"test_room.json", "furnished_office.json"})
            benchmark::RegisterBenchmark(("sky_series/" + std::string(file)).c_str(), series, backend, file)
                ->Unit(benchmark::kMillisecond)->Iterations(1);
    }
    return 0;
}();

}  // namespace
}  // namespace naturel::tests
