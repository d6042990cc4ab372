// What rows of form factors by projection cost, beside a bare loop of Embree's coherent packets over the same facets in the
// same directions: cells and rays per second of one core. Interleave repetitions on a busy machine:
// --benchmark_repetitions=9 --benchmark_enable_random_interleaving=true
#include <benchmark/benchmark.h>

#include <filesystem>
#include <glm/geometric.hpp>
#include <memory>

#include "core/building.h"
#include "core/light_zones.h"
#include "core/patch_grid.h"
#include "core/scene_reader.h"
#include "hemicube_backend/hemicube_visibility.h"
#ifdef NATUREL_HAS_EMBREE
#include "embree_backend/embree_api.h"
#endif

namespace naturel::tests {
namespace {

using glm::dvec3;

struct Place {
    Building building;
    PatchGrid grid;

    explicit Place(const Scene& scene)
        : building(assemble(scene)), grid(make_patch_grid(building, scene.grid, find_light_zones(scene, building))) {}
};

const Place& office() {
    static const Place place(read_scene(std::filesystem::path(NATUREL_SOURCE_DIR) / "scenes/furnished_office.json"));
    return place;
}

/// Rows of every `step`-th patch, over and over. Counter: cells per second of CPU time.
void measure_rows(benchmark::State& state, const Place& place, const HemicubeOptions& options, std::size_t step) {
    const auto visibility = make_hemicube_visibility(place.building, place.grid, options);
    const double n = options.resolution;
    const double cells = options.surface == ProjectionSurface::hemicube ? 3 * n * n : n * n;
    FormFactorRow row;
    std::size_t patch = 0;
    for (auto _ : state) {
        visibility->form_factor_row(make_id<PatchId>(patch), row);
        benchmark::DoNotOptimize(row.values.data());
        patch = (patch + step) % place.grid.gather_patch_count;
    }
    state.counters["facets"] = static_cast<double>(place.building.facets.size());
    state.counters["patches"] = static_cast<double>(place.grid.gather_patch_count);
    state.counters["cells"] = benchmark::Counter(cells * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void office_hemicube_rows(benchmark::State& state) {
    measure_rows(state, office(), {.resolution = static_cast<int>(state.range(0))}, 37);
}
void office_single_plane_rows(benchmark::State& state) {
    measure_rows(state, office(), {.surface = ProjectionSurface::single_plane, .resolution = static_cast<int>(state.range(0))}, 37);
}
BENCHMARK(office_hemicube_rows)->Arg(64)->Arg(128)->Arg(256)->Arg(512)->Unit(benchmark::kMicrosecond)->MinTime(0.3);
BENCHMARK(office_single_plane_rows)->Arg(128)->Arg(256)->Unit(benchmark::kMicrosecond)->MinTime(0.3);

#ifdef NATUREL_HAS_EMBREE
/// The directions of a hemi-cube's cells in blocks of 4 x 4 from the centres of the same patches, against facets, and
/// nothing else: no patch is looked up, no weight is summed.
void office_embree_packets(benchmark::State& state) {
    using namespace embree_api;
    const Place& place = office();
    std::vector<glm::vec3> vertices;
    std::vector<Triangle> triangles;
    for (const Facet& facet : place.building.facets) {
        const auto first = static_cast<std::uint32_t>(vertices.size());
        for (const dvec3& vertex_m : facet.vertices_m) vertices.emplace_back(vertex_m);
        for (std::uint32_t k = 1; k + 1 < facet.vertices_m.size(); ++k) triangles.push_back({first, first + k, first + k + 1});
    }
    const Device device = make_device();
    const auto scene = make_scene(device.get(), vertices, triangles);

    const int n = static_cast<int>(state.range(0));
    std::vector<dvec3> directions;  // x right, y up, z forward of the patch
    const auto add_plane = [&](int rows, const dvec3& right, const dvec3& up, const dvec3& forward, double y_begin) {
        for (int row = 0; row < rows; row += 4)
            for (int column = 0; column < n; column += 4)
                for (int k = 0; k < 16; ++k) {
                    const double x = -1 + 2 * (column + k % 4 + 0.5) / n, y = y_begin + 2 * (row + k / 4 + 0.5) / n;
                    directions.push_back(glm::normalize(x * right + y * up + forward));
                }
    };
    const dvec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    add_plane(n, x, y, z, -1);
    for (const dvec3& side : {x, y, -x, -y}) add_plane(n / 2, glm::cross(z, side), z, side, 0);

    std::size_t patch = 0;
    std::vector<Packet> packets(directions.size() / packet_size);
    for (auto _ : state) {
        state.PauseTiming();
        const Patch& from = place.grid.patches[patch];
        const PlaneFrame plane = make_plane_frame(from.centroid_m, from.normal);
        for (std::size_t k = 0; k < directions.size(); ++k) {
            packets[k / packet_size].set_origin(k % packet_size, glm::vec3(from.centroid_m + 1e-5 * from.normal));
            const dvec3& d = directions[k];
            packets[k / packet_size].set_direction(k % packet_size, glm::vec3(d.x * plane.x + d.y * plane.y + d.z * from.normal));
        }
        patch = (patch + 37) % place.grid.gather_patch_count;
        state.ResumeTiming();
        std::uint32_t sum = 0;
        for (Packet& packet : packets) {
            trace(scene.get(), packet);
            sum += packet.triangle(0);
        }
        benchmark::DoNotOptimize(sum);
    }
    state.counters["rays"] =
        benchmark::Counter(static_cast<double>(directions.size()) * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(office_embree_packets)->Arg(128)->Unit(benchmark::kMicrosecond)->MinTime(0.3);
#endif

/// `count` copies of the office side by side and above each other: a row sees one of them, whatever the number of facets.
Place offices(int count) {
    Place all = office();
    all.building.apertures.clear();
    const Building one = all.building;
    all.building.faces.clear();
    all.building.facets.clear();
    int across = 1;
    while (across * across * across < count) ++across;
    for (int k = 0; k < count; ++k) {
        const dvec3 shift_m = dvec3(6, 7, 3.5) * dvec3(k % across, k / across % across, k / across / across);
        const std::size_t first_face = all.building.faces.size();
        for (Face face : one.faces) {
            face.frame.origin_m += shift_m;
            face.plane.origin_m += shift_m;
            if (face.other_side) face.other_side = make_id<FaceId>(first_face + index(*face.other_side));
            all.building.faces.push_back(face);
        }
        for (Facet facet : one.facets) {
            for (dvec3& vertex_m : facet.vertices_m) vertex_m += shift_m;
            facet.face = make_id<FaceId>(first_face + index(facet.face));
            all.building.facets.push_back(facet);
        }
    }
    all.grid = make_patch_grid(all.building, {.spacing_m = 0.5, .outdoor_spacing_m = 10});
    return all;
}

void rows_of_many_offices(benchmark::State& state) {
    const Place place = offices(static_cast<int>(state.range(0)));
    measure_rows(state, place, {.resolution = 128}, 1009);
}
BENCHMARK(rows_of_many_offices)->RangeMultiplier(10)->Range(1, 1000)->Unit(benchmark::kMicrosecond)->MinTime(0.3);

}  // namespace
}  // namespace naturel::tests
