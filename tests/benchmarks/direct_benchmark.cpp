// What direct light costs at 1000 points behind four glazed windows under a clear sky, and how much of that is visibility.
#include <benchmark/benchmark.h>
#include <time.h>

#include <cmath>
#include <cstdio>

#include "core/direct.h"
#include "core/parallel.h"
#include "tests/all_backends.h"
#include "tests/random_scenes.h"

namespace naturel::tests {
namespace {

using glm::dvec3;

/// CPU time of this thread, s.
double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Passes questions on, and counts them and the time they take. For one thread.
class TimedVisibility final : public Visibility {
public:
    explicit TimedVisibility(const Visibility& told) : told_(told) {}
    std::string_view name() const noexcept override { return told_.name(); }
    std::vector<std::pair<std::string, std::string>> settings() const override { return told_.settings(); }
    void first_seen(const GatherPoint& from, std::span<const dvec3> directions, std::span<FacetId> seen) const override {
        const double start = thread_seconds();
        told_.first_seen(from, directions, seen);
        seconds += thread_seconds() - start;
        rays += directions.size();
        ++calls;
    }
    void form_factor_row(PatchId from, FormFactorRow& row) const override { told_.form_factor_row(from, row); }
    void gather_row(const GatherPoint& from, FormFactorRow& row) const override { told_.gather_row(from, row); }
    void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const override {
        told_.view_facets(camera, row_begin, row_end, seen);
    }

    mutable double seconds = 0.0;
    mutable std::size_t rays = 0, calls = 0;

private:
    const Visibility& told_;
};

/// An office of 10 x 7 x 3 m with four double-glazed windows in a wall of 30 cm, a table, a shelf and a building opposite.
Scene office() {
    Scene scene = empty_scene();
    scene.glazings.push_back({.name = "double", .normal_transmittance = grey(0.78), .panes = 2});
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, 0}, {10.3, 7.3, 3.6}),
                       box("room", Effect::carve, {0, 0, 0.3}, {10, 7, 3.3})};
    for (int k = 0; k < 4; ++k) {
        const double left = 0.4 + 2.4 * k;
        scene.polyhedra.push_back(box("window " + std::to_string(k), Effect::carve, {left, -0.3, 1.2}, {left + 1.9, 0, 2.8}));
        scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    }
    scene.polyhedra.push_back(box("table", Effect::fill, {3, 2, 1.0}, {6, 3.2, 1.05}));
    scene.polyhedra.push_back(box("shelf", Effect::fill, {7, 2.5, 0.3}, {7.4, 5, 2.0}));
    scene.polyhedra.push_back(box("opposite", Effect::fill, {-5, -25, 0}, {8, -15, 9}));
    scene.sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 12000.0};
    scene.sun = SunDescription{.altitude_rad = 0.7, .azimuth_rad = 3.4, .direct_normal_illuminance_lx = 8e4};
    scene.direct.tolerance = 1e-3;
    return scene;
}

void direct_light(benchmark::State& state, const Backend& backend) {
    const ThreadLimit limit(1);
    const Scene scene = office();
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    const auto visibility = backend.make(building, grid);
    const TimedVisibility timed(*visibility);
    NoProgress progress;
    const OutdoorLight outdoors = light_outdoors(scene, building, grid, *visibility, progress);
    const DirectLight direct(scene, building, grid, outdoors, timed);
    std::vector<GatherPoint> points;
    for (int j = 0; j < 25; ++j) {
        for (int i = 0; i < 40; ++i) points.push_back({{0.125 + 0.25 * i, 0.14 + 0.28 * j, 1.1}, {0, 0, 1}});
    }
    double sum = 0.0, best = 1e300, best_share = 0.0;
    std::size_t rounds = 0;
    for (auto _ : state) {
        const double before = timed.seconds, start = thread_seconds();
        for (const GatherPoint& point : points) sum += direct.without_sun(point).by_source().total().g;
        const double taken = thread_seconds() - start;
        if (taken < best) best = taken, best_share = (timed.seconds - before) / taken;
        ++rounds;
    }
    benchmark::DoNotOptimize(static_cast<const double&>(sum));
    const double count = static_cast<double>(points.size());
    state.counters["points/s"] = count / best;
    state.counters["us/point"] = 1e6 * best / count;
    state.counters["visibility_%"] = 100.0 * best_share;
    state.counters["rays/point"] = static_cast<double>(timed.rays) / (count * static_cast<double>(rounds));
    state.counters["calls/point"] = static_cast<double>(timed.calls) / (count * static_cast<double>(rounds));
    state.counters["mean_lx"] = sum / (count * static_cast<double>(rounds));
}

const int registered = [] {
    for (const Backend& backend : all_backends()) {
        benchmark::RegisterBenchmark(("direct_light/" + backend.name).c_str(), direct_light, backend)
            ->Unit(benchmark::kMillisecond)->Iterations(5);
    }
    return 0;
}();

}  // namespace
}  // namespace naturel::tests
