// What a ray of a hemisphere costs, with its direction, its start, the patch it meets and the count of it, beside bare loops of
// Embree's coherent packets: the same rays against the same facets, made beforehand, and nothing done with what they meet.
// Both are timed in turn, patch by patch, so that their ratio bears a busy machine. Counters: million rays per second of CPU time
// of one core; `share` is hemisphere / bare16.
#include <benchmark/benchmark.h>
#ifdef NATUREL_HAS_EMBREE
#include <cmath>
#include <ctime>
#include <filesystem>
#include <glm/geometric.hpp>
#include <memory>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/scene_reader.h"
#include "embree_backend/embree_api.h"
#include "embree_backend/embree_visibility.h"
#include "embree_backend/sampling.h"
#include "tests/random_scenes.h"

namespace naturel::tests {
namespace {

using namespace embree_sampling;

constexpr int rays_per_row = 4096;

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Place {
    Building building;
    PatchGrid grid;
};

/// 0: a room of 42 facets with a window; 1: the furnished office; 2: a room with 24 boxes.
Place place(std::int64_t number) {
    Scene scene;
    if (number == 0) {
        scene = closed_room({4, 5, 2.8});
        scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.4, 0.9}, {3, 0.1, 2.1}));
        scene.polyhedra.push_back(box("door", Effect::carve, {4, 1, 0}, {4.15, 2, 2.1}));
    } else if (number == 1) {
        scene = read_scene(std::filesystem::path(NATUREL_SOURCE_DIR) / "scenes/furnished_office.json");
    } else {
        scene = closed_room({6, 5, 3});
        for (int k = 0; k < 24; ++k) {
            const glm::dvec3 low{0.3 + 0.95 * (k % 6), 0.4 + 1.2 * (k / 6), 0.0};
            scene.polyhedra.push_back(
                box("box " + std::to_string(k), Effect::fill, low, low + glm::dvec3(0.4, 0.5, 0.5 + 0.25 * (k % 4))));
        }
    }
    Place p;
    p.building = assemble(scene);
    p.grid = make_patch_grid(p.building, {.spacing_m = 0.25});
    return p;
}

struct BareScene {
    embree_api::Device device = embree_api::make_device();
    embree_api::Scene scene;

    explicit BareScene(const Building& building) {
        std::vector<glm::vec3> vertices;
        std::vector<embree_api::Triangle> triangles;
        for (const Facet& facet : building.facets) {
            const auto first = static_cast<std::uint32_t>(vertices.size());
            for (const glm::dvec3& v : facet.vertices_m) vertices.emplace_back(v);
            for (std::uint32_t k = 1; k + 1 < facet.vertices_m.size(); ++k) triangles.push_back({first, first + k, first + k + 1});
        }
        scene = embree_api::make_scene(device.get(), vertices, triangles);
    }
};

/// Rays of one patch: x, y, z of starts, then of directions.
struct Rays {
    std::vector<float> start[3], direction[3];
};

/// spread: rays start all over the patch, as those of a row do; else from its centre.
Rays rays_of(const Place& p, PatchId patch, const RayTable& table, const StartTable& starts, bool spread) {
    Rays rays;
    for (auto* part : {rays.start, rays.direction})
        for (int axis = 0; axis < 3; ++axis) part[axis].resize(static_cast<std::size_t>(table.rays()));
    const Patch& from = p.grid.patches[index(patch)];
    const glm::dvec3 lift = 1e-5 * from.normal;
    const PolygonSampler sampler(p.grid.polygon_of(patch), from.centroid_m, 1e-5, lift);
    const HemisphereFrame frame(from.normal, static_cast<std::uint32_t>(index(patch)) % 8);
    for (std::size_t first = 0; first < rays.start[0].size(); first += rays_per_packet) {
        place_directions(frame, table, first, &rays.direction[0][first], &rays.direction[1][first], &rays.direction[2][first]);
        sampler.place(starts, first, {}, &rays.start[0][first], &rays.start[1][first], &rays.start[2][first]);
    }
    if (!spread)
        for (int axis = 0; axis < 3; ++axis)
            std::ranges::fill(rays.start[axis], static_cast<float>(from.centroid_m[axis] + lift[axis]));
    return rays;
}

template <class Packet>
void load(const Rays& rays, std::size_t first, unsigned count, Packet& packet) {
    for (unsigned k = 0; k < count; ++k) {
        packet.ray.org_x[k] = rays.start[0][first + k];
        packet.ray.org_y[k] = rays.start[1][first + k];
        packet.ray.org_z[k] = rays.start[2][first + k];
        packet.ray.dir_x[k] = rays.direction[0][first + k];
        packet.ray.dir_y[k] = rays.direction[1][first + k];
        packet.ray.dir_z[k] = rays.direction[2][first + k];
        packet.ray.tfar[k] = INFINITY;
        packet.hit.geomID[k] = embree_api::no_hit;
        packet.hit.instID[0][k] = embree_api::no_hit;
    }
}

template <class Packet>
void prepare(Packet& packet, unsigned count) {
    for (unsigned k = 0; k < count; ++k) {
        packet.ray.tnear[k] = packet.ray.time[k] = 0.0f;
        packet.ray.mask[k] = ~0u;
        packet.ray.flags[k] = 0;
    }
}

/// CPU seconds of a bare loop; Width 8 or 16.
template <unsigned Width>
double bare_seconds(RTCScene scene, const Rays& rays) {
    alignas(64) static const int valid[16] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    alignas(64) std::conditional_t<Width == 16, RTCRayHit16, RTCRayHit8> packet;
    prepare(packet, Width);
    const double start = cpu_seconds();
    for (std::size_t first = 0; first < rays.start[0].size(); first += Width) {
        load(rays, first, Width, packet);
#if NATUREL_EMBREE_MAJOR >= 4
        RTCIntersectArguments arguments;
        rtcInitIntersectArguments(&arguments);
        arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
        if constexpr (Width == 16) rtcIntersect16(valid, scene, &packet, &arguments);
        else rtcIntersect8(valid, scene, &packet, &arguments);
#else
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        if constexpr (Width == 16) rtcIntersect16(valid, scene, &context, &packet);
        else rtcIntersect8(valid, scene, &context, &packet);
#endif
        benchmark::DoNotOptimize(packet.hit.primID[0]);
    }
    return cpu_seconds() - start;
}

void hemisphere(benchmark::State& state) {
    const Place p = place(state.range(0));
    const auto visibility = make_embree_visibility(p.building, p.grid, {.rays_per_patch = rays_per_row});
    const BareScene bare(p.building);
    const RayTable table = make_ray_table(make_tiles(rays_per_row), 1);
    const StartTable starts = make_start_table(make_tiles(rays_per_row));
    FormFactorRow row;
    double own = 0.0, bare16 = 0.0, bare8 = 0.0, centre16 = 0.0, entries = 0.0;
    std::size_t rows = 0;
    for (auto _ : state) {
        const PatchId patch = make_id<PatchId>(37 * rows % p.grid.gather_patch_count);
        const Rays spread = rays_of(p, patch, table, starts, true), centre = rays_of(p, patch, table, starts, false);
        bare16 += bare_seconds<16>(bare.scene.get(), spread);
        const double start = cpu_seconds();
        visibility->form_factor_row(patch, row);
        own += cpu_seconds() - start;
        bare8 += bare_seconds<8>(bare.scene.get(), spread);
        centre16 += bare_seconds<16>(bare.scene.get(), centre);
        entries += static_cast<double>(row.values.size());
        ++rows;
    }
    const double all = 1e-6 * rays_per_row * static_cast<double>(rows);
    state.counters["facets"] = static_cast<double>(p.building.facets.size());
    state.counters["patches"] = static_cast<double>(p.grid.gather_patch_count);
    state.counters["entries"] = entries / static_cast<double>(rows);
    state.counters["hemisphere"] = all / own;
    state.counters["bare16"] = all / bare16;
    state.counters["bare8"] = all / bare8;
    state.counters["bare16_centre"] = all / centre16;
    state.counters["share"] = bare16 / own;
}
BENCHMARK(hemisphere)->ArgName("place")->DenseRange(0, 2)->Unit(benchmark::kMillisecond)->MinTime(2.0);

}  // namespace
}  // namespace naturel::tests
#endif
