// What a direction costs in each sky, and a whole sky with its integral.
#include <benchmark/benchmark.h>

#include <random>

#include "core/sky.h"
#include "core/sky_models.h"
#include "core/sky_table.h"
#include "core/sun.h"

namespace naturel::tests {
namespace {

const glm::dvec3 sun = direction_from_angles(0.7, 2.5);

SkyDescription described(const SkyModelInfo& info) {
    SkyDescription sky{.model = info.model, .horizontal_illuminance_lx = 10000.0};
    sky.cie_type = info.cie_type;
    sky.perez.direct_normal_W_m2 = 500.0;
    sky.perez.diffuse_horizontal_W_m2 = 150.0;
    sky.table = std::make_shared<SkyTable>(tregenza_patches(), std::vector<double>(145, 1.0), true);
    sky.expression = "1 + 2*sin(altitude)";
    return sky;
}

std::vector<glm::dvec3> directions() {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    std::vector<glm::dvec3> all(4096);
    for (glm::dvec3& d : all)
        d = direction_from_angles(std::asin(share(random)), 6.28 * share(random));
    return all;
}

void directions_of(benchmark::State& state, const SkyModelInfo& info) {
    const Sky sky(described(info), sun);
    const std::vector<glm::dvec3> all = directions();
    for (auto _ : state) {
        double sum = 0.0;
        for (const glm::dvec3& d : all)
            sum += sky.luminance(d).value;
        benchmark::DoNotOptimize(sum);
    }
    state.counters["per_direction"] =
        benchmark::Counter(static_cast<double>(all.size()),
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void whole(benchmark::State& state, const SkyModelInfo& info) {
    for (auto _ : state)
        benchmark::DoNotOptimize(Sky(described(info), sun).zenith_luminance());
}

const bool registered = [] {
    for (const SkyModelInfo& info : sky_models()) {
        benchmark::RegisterBenchmark(("sky/direction/" + std::string(info.name)).c_str(), directions_of, info)
            ->Unit(benchmark::kMicrosecond);
        benchmark::RegisterBenchmark(("sky/whole/" + std::string(info.name)).c_str(), whole, info)
            ->Unit(benchmark::kMicrosecond);
    }
    return true;
}();

}  // namespace
}  // namespace naturel::tests
