// What a picture costs: 1920 x 1080 pixels of 16 samples of the furnished office on one thread, by both backends, and the same
// rays by Embree alone: packets of eight against the same facets, what they meet written down.
#include <benchmark/benchmark.h>

#include <ctime>

#include "core/parallel.h"
#include "core/picture.h"
#include "core/scene_reader.h"
#include "core/view.h"
#include "tests/all_backends.h"
#ifdef NATUREL_HAS_EMBREE
#include "embree_backend/embree_api.h"
#endif

namespace naturel::tests {
namespace {

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// The office with light on its nodes that costs nothing to compute.
struct Office {
    Scene scene = read_scene(std::string(NATUREL_SOURCE_DIR) + "/scenes/furnished_office.json");
    Building building = assemble(scene);
    PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building));
    NoProgress quiet;
    DaylightSolution solution{.outdoors = light_outdoors(scene, building, grid, *all_backends().front().make(building, grid), quiet)};

    Office() {
        for (const Node& node : grid.nodes) {
            solution.nodes.emplace_back();
            solution.nodes.back().direct.sky_lx = grey(100 + 10 * node.position_m.x);
        }
    }

    View view(ViewKind kind) const {
        View v = scene.views.front();
        v.kind = kind;
        v.width = 1920, v.height = 1080, v.samples = 4;
        if (kind == ViewKind::fisheye) v.field_of_view_rad = pi;
        return v;
    }
};

const Office& office() {
    static const Office one;
    return one;
}

void report(benchmark::State& state, double seconds, std::size_t runs) {
    const double pixels = 1920.0 * 1080.0 * static_cast<double>(runs);
    state.counters["Mpixels/s"] = 1e-6 * pixels / seconds;
    state.counters["Mrays/s"] = 16e-6 * pixels / seconds;
}

void picture(benchmark::State& state) {
    const ThreadLimit one(1);
    const Backend backend = all_backends()[static_cast<std::size_t>(state.range(0))];
    const Office& place = office();
    const auto visibility = backend.make(place.building, place.grid);
    const View view = place.view(static_cast<ViewKind>(state.range(1)));
    state.SetLabel(backend.name);
    NoProgress quiet;
    double seconds = 0.0;
    std::size_t runs = 0;
    for (auto _ : state) {
        const double start = cpu_seconds();
        benchmark::DoNotOptimize(draw_view(place.scene, place.building, place.grid, *visibility, place.solution, view, quiet));
        seconds += cpu_seconds() - start;
        ++runs;
    }
    report(state, seconds, runs);
}

#ifdef NATUREL_HAS_EMBREE
void embree_alone(benchmark::State& state) {
    const ThreadLimit one(1);
    const Office& place = office();
    std::vector<glm::vec3> vertices;
    std::vector<embree_api::Triangle> triangles;
    for (const Facet& facet : place.building.facets) {
        if (facet.is_aperture) break;
        const auto first = static_cast<std::uint32_t>(vertices.size());
        for (const glm::dvec3& v : facet.vertices_m) vertices.emplace_back(v);
        for (std::uint32_t k = 1; k + 1 < facet.vertices_m.size(); ++k) triangles.push_back({first, first + k, first + k + 1});
    }
    const embree_api::Device device = embree_api::make_device();
    const embree_api::Scene scene = embree_api::make_scene(device.get(), vertices, triangles);
    const Camera camera = with_samples(make_camera(place.view(ViewKind::perspective)), 4);
    std::vector<std::uint32_t> seen(static_cast<std::size_t>(camera.width) * 2);
    const glm::vec3 eye(camera.eye_m), right(camera.right * (2 * camera.half_width / camera.width)),
        down(camera.up * (-2 * camera.half_height / camera.height)),
        corner(camera.forward - camera.half_width * camera.right + camera.half_height * camera.up);
    double seconds = 0.0;
    std::size_t runs = 0;
    for (auto _ : state) {
        const double start = cpu_seconds();
        embree_api::Packet packet;
        for (unsigned k = 0; k < 8; ++k) packet.set_origin(k, eye);
        for (int top = 0; top < camera.height; top += 2) {
            for (int left = 0; left < camera.width; left += 4) {
                for (unsigned k = 0; k < 8; ++k) {
                    const float x = static_cast<float>(left + static_cast<int>(k % 4)) + 0.5f, y = static_cast<float>(top + static_cast<int>(k / 4)) + 0.5f;
                    packet.set_direction(k, corner + x * right + y * down);
                }
                embree_api::trace(scene.get(), packet);
                for (unsigned k = 0; k < 8; ++k)
                    seen[static_cast<std::size_t>(k / 4) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(left) + k % 4] = packet.triangle(k);
            }
            benchmark::DoNotOptimize(seen.data());
        }
        seconds += cpu_seconds() - start;
        ++runs;
    }
    report(state, seconds, runs);
}
BENCHMARK(embree_alone)->Unit(benchmark::kMillisecond)->Iterations(2);
BENCHMARK(picture)->Args({2, 0})->Args({2, 2})->Unit(benchmark::kMillisecond)->Iterations(2);
BENCHMARK(embree_alone)->Unit(benchmark::kMillisecond)->Iterations(2);
#endif
BENCHMARK(picture)->Args({0, 0})->Args({0, 2})->Unit(benchmark::kMillisecond)->Iterations(2);

}  // namespace
}  // namespace naturel::tests
