#include "core/daylight.h"

#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>

#include "core/parallel.h"
#include "core/picture.h"
#include "core/view.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

struct Lit {
    Building building;
    PatchGrid grid;
    std::unique_ptr<Visibility> visibility;
    DaylightSolution solution;
};

Lit light(const Scene& scene, const Backend& backend, const DaylightOptions& options = {}) {
    Building building = assemble(scene);
    PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building));
    auto visibility = backend.make(building, grid);
    NoProgress progress;
    DaylightSolution solution = compute_daylight(scene, building, grid, *visibility, options, progress);
    return {std::move(building), std::move(grid), std::move(visibility), std::move(solution)};
}

// A room with a desk and a window on its south side.
Scene room_with_window() {
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    scene.polyhedra.push_back(box("desk", Effect::fill, {1, 1.5, 1.0}, {2.5, 2.3, 1.05}));
    scene.grid = {.spacing_m = 1.0, .outdoor_spacing_m = 3.0};
    scene.sensors = {{.id = "plane", .grid = SensorGrid{.z_m = 1.15, .spacing_m = 2.0, .margin_m = 0.5}}};
    return scene;
}

}  // namespace

TEST_CASE("a closed furnace of exitance M and reflectance rho is lit by M / (1 - rho) everywhere", "[daylight][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = closed_room({3, 4, 2.5}, 0.6, 0.3);
    scene.polyhedra.push_back(box("cupboard", Effect::fill, {0, 0, 0.3}, {1, 0.5, 2}));
    scene.materials[0].exitance_lm_m2 = {100, 200, 50};
    scene.grid.spacing_m = 0.5;
    scene.sensors = {{.id = "p", .points = {{{1.5, 2, 1.1}, {0, 0, 1}}, {{2, 3, 1}, glm::normalize(dvec3(1, -2, 0.5))}}}};
    const Lit lit = light(scene, backend);
    // 1e-5: the radiosity stops at 1e-6 of the flux; rows sum to 1 after the repair, which is good to 1e-10.
    for (const LightBySource& irc : lit.solution.radiosity.indirect_illuminance_lx) {
        CHECK_THAT(irc.other.r, WithinRel(250.0, 1e-5));
        CHECK_THAT(irc.other.g, WithinRel(500.0, 1e-5));
        CHECK_THAT(irc.other.b, WithinRel(125.0, 1e-5));
        CHECK(irc.sky.g == 0.0);
    }
    // Gathered: a row from a point sums to 1 but for cells or rays lost at edges.
    for (const PointIlluminance& value : lit.solution.sensor_values)
        CHECK_THAT(value.total_lx().g, WithinRel(500.0, 1e-3));
}

TEST_CASE("light that comes in is absorbed, and backends agree on a room with a window", "[daylight][property]") {
    std::vector<double> means;
    for (const Backend& backend : all_backends()) {
        INFO(backend.name);
        const Lit lit = light(room_with_window(), backend);
        const RadiositySolution& radiosity = lit.solution.radiosity;
        CHECK(radiosity.converged);
        CHECK_THAT(radiosity.flux_absorbed_lm.g + radiosity.flux_lost_lm.g, WithinRel(radiosity.flux_in_lm.g, 1e-5));
        double sum = 0.0;
        for (const PointIlluminance& value : lit.solution.sensor_values) {
            sum += value.total_lx().g;
            CHECK(value.total_lx().r == value.total_lx().g);
            CHECK(value.from_sky_lx().g == value.total_lx().g);  // no sun, no lamps
        }
        means.push_back(sum / static_cast<double>(lit.solution.sensor_values.size()));
    }
    // 2 %: one cell of the hemi-cube at the edge of the window is 1 % of its width from the far end of the room.
    for (const double mean : means) CHECK_THAT(mean, WithinRel(means.front(), 0.02));
}

TEST_CASE("twice the sky gives twice the light", "[daylight][property]") {
    const Backend backend = all_backends().front();
    Scene scene = room_with_window();
    const Lit once = light(scene, backend);
    scene.sky.horizontal_illuminance_lx = 20000.0;
    const Lit twice = light(scene, backend);
    for (std::size_t s = 0; s < once.solution.sensor_values.size(); ++s)
        CHECK_THAT(twice.solution.sensor_values[s].total_lx().g, WithinRel(2.0 * once.solution.sensor_values[s].total_lx().g, 1e-9));
}

TEST_CASE("the solution has the same bits for 1, 2, 3 and 8 threads", "[daylight][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = room_with_window();
    scene.sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 12000.0};
    scene.sun = SunDescription{.altitude_rad = 0.7, .azimuth_rad = 3.0, .direct_normal_illuminance_lx = 60000.0};
    std::vector<double> reference;
    for (const int threads : {1, 2, 3, 8}) {
        const ThreadLimit limit(threads);
        const Lit lit = light(scene, backend);
        std::vector<double> values;
        const auto add = [&](const Band3& band) { values.insert(values.end(), {band.r, band.g, band.b}); };
        for (const PointIlluminance& value : lit.solution.nodes) add(value.total_lx()), add(value.direct.sky_lx), add(value.direct.sun_lx);
        for (const PointIlluminance& value : lit.solution.sensor_values) add(value.total_lx()), add(value.from_sky_lx());
        for (const LightBySource& exitance : lit.solution.radiosity.exitance_lm_m2) add(exitance.sky), add(exitance.other);
        if (reference.empty()) reference = values;
        REQUIRE(values.size() == reference.size());
        CHECK(std::memcmp(values.data(), reference.data(), values.size() * sizeof(double)) == 0);
    }
}

TEST_CASE("the sun through the window lights the floor it falls on and the daylight factor ignores it", "[daylight]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = room_with_window();
    // From the south, 45 degrees high: the window (z 1.2 to 2.4, outer face at y = -0.3) lights y 0.6 to 1.8 of the floor at z = 0.3.
    scene.sun = SunDescription{.altitude_rad = pi / 4, .azimuth_rad = pi, .direct_normal_illuminance_lx = 10000.0};
    scene.sensors = {{.id = "floor", .points = {{{2.8, 1.2, 0.3}, {0, 0, 1}}, {{2.8, 3.0, 0.3}, {0, 0, 1}}}}};
    const Lit lit = light(scene, backend);
    CHECK_THAT(lit.solution.sensor_values[0].direct.sun_lx.g, WithinRel(10000.0 * std::sqrt(0.5), 1e-9));
    CHECK(lit.solution.sensor_values[1].direct.sun_lx.g == 0.0);
    CHECK(lit.solution.sensor_values[1].indirect_lx.other.g > 0.0);
    scene.sun.reset();
    const Lit overcast = light(scene, backend);
    // 5e-3: without the sunspot the grid of 1 m is another one, and the bright ground makes direct light refine elsewhere.
    for (std::size_t s = 0; s < 2; ++s)
        CHECK_THAT(lit.solution.sensor_values[s].from_sky_lx().g, WithinRel(overcast.solution.sensor_values[s].total_lx().g, 5e-3));
}

TEST_CASE("borrowed light passes a pane between two rooms and is less than through a hole", "[daylight]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = room_with_window();
    scene.glazings.push_back({.name = "pane", .normal_transmittance = grey(0.5)});
    scene.polyhedra[0].vertices_m[2].y += 4.0;  // the block reaches further north
    scene.polyhedra.push_back(box("back room", Effect::carve, {0, 5.1, 0.3}, {4, 8, 3.3}));
    scene.polyhedra.push_back(box("opening", Effect::carve, {1, 5, 0.8}, {3, 5.1, 2.8}));
    scene.sensors = {{.id = "p", .points = {{{2, 6.5, 1.1}, {0, 0, 1}}}}};
    const double hole = light(scene, backend).solution.sensor_values[0].total_lx().g;
    scene.polyhedra.back().faces[3].glazing = make_id<GlazingId>(1);
    const Lit glazed = light(scene, backend);
    const double pane = glazed.solution.sensor_values[0].total_lx().g;
    REQUIRE(glazed.building.apertures.size() == 2);
    CHECK(hole > 0.0);
    // Directly half, diffusely less than half (grazing light is reflected).
    CHECK(pane < 0.5 * hole);
    CHECK(pane > 0.35 * hole);
    const RadiositySolution& radiosity = glazed.solution.radiosity;
    CHECK_THAT(radiosity.flux_absorbed_lm.g + radiosity.flux_lost_lm.g, WithinRel(radiosity.flux_in_lm.g, 1e-5));
}

TEST_CASE("a pane that lets nothing pass reflects direct light like a wall", "[daylight]") {
    const Backend backend = all_backends().back();
    Scene scene = room_with_window();
    scene.polyhedra[0].vertices_m[2].y += 4.0;  // the block reaches further north
    scene.materials.push_back({.name = "white", .reflectance = grey(0.9)});
    scene.glazings.push_back({.name = "mirror", .normal_transmittance = {}, .inner_reflectance = grey(0.9)});
    scene.polyhedra[1].faces[3].material = make_id<MaterialId>(1);  // back: y = 5
    scene.sensors = {{.id = "p", .points = {{{2, 3, 1.1}, {0, 0, 1}}}}};
    const double wall = light(scene, backend).solution.sensor_values[0].total_lx().g;
    scene.polyhedra.push_back(box("back room", Effect::carve, {0, 5, 0.3}, {4, 8, 3.3}));
    scene.polyhedra.back().faces[2].glazing = make_id<GlazingId>(1);  // front: y = 5
    const Lit lit = light(scene, backend);
    REQUIRE(lit.building.apertures.size() == 2);
    // 1 %: direct light on the wall is the mean of its nodes, on the pane that of its patches' middles.
    CHECK_THAT(lit.solution.sensor_values[0].total_lx().g, WithinRel(wall, 0.01));
}

TEST_CASE("a distant object does not change the light in the room", "[daylight]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = room_with_window();
    const Lit alone = light(scene, backend);
    scene.polyhedra.push_back(box("mast", Effect::fill, {-3, 90000, 0}, {3, 90001, 5}));  // north; the window looks south
    const Lit with_mast = light(scene, backend);
    // 1e-3, the tolerance of the direct component and of the form factors' noise.
    for (std::size_t s = 0; s < alone.solution.sensor_values.size(); ++s)
        CHECK_THAT(with_mast.solution.sensor_values[s].total_lx().g, WithinRel(alone.solution.sensor_values[s].total_lx().g, 1e-3));
}

TEST_CASE("a picture of a furnace shows its luminance in every pixel", "[picture]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = closed_room({3, 4, 2.5}, 0.5, 0.3);
    scene.materials[0].exitance_lm_m2 = grey(100.0);
    scene.grid.spacing_m = 1.0;
    const Lit lit = light(scene, backend);
    NoProgress progress;
    const View view{.id = "v", .from_m = {2.5, 3.5, 1.5}, .to_m = {0, 0, 1}, .field_of_view_rad = 1.4, .width = 40, .height = 30};
    const Picture picture = draw_view(scene, lit.building, lit.grid, *lit.visibility, lit.solution, view, progress);
    REQUIRE(picture.luminance_cd_m2.size() == 40 * 30);
    // L = M_total / pi = 100 / (1 - 0.5) / pi; a crack between facets would show as black
    for (const Band3& luminance : picture.luminance_cd_m2) CHECK_THAT(luminance.g, WithinRel(200.0 / pi, 1e-5));
}

TEST_CASE("a picture shows sky above ground through the window", "[picture]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = room_with_window();
    scene.sky = {.model = SkyModel::uniform, .zenith_luminance_cd_m2 = 1000.0};
    const Lit lit = light(scene, backend);
    NoProgress progress;
    // Level at 1.8 m, straight at the middle of the window.
    const View view{.id = "v", .from_m = {2, 4, 1.8}, .to_m = {2, 0, 1.8}, .field_of_view_rad = 0.2, .width = 10, .height = 10};
    const Picture picture = draw_view(scene, lit.building, lit.grid, *lit.visibility, lit.solution, view, progress);
    CHECK_THAT(picture.luminance_cd_m2[5].g, WithinRel(1000.0, 1e-9));
    CHECK_THAT(picture.luminance_cd_m2[95].g, WithinRel(0.2 * 1000.0, 1e-9));
}

TEST_CASE("a diffuse surface has the same luminance in parallel and perspective pictures", "[picture]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = room_with_window();
    scene.polyhedra.pop_back();  // the desk
    scene.sky = {.model = SkyModel::uniform, .zenith_luminance_cd_m2 = 1000.0};
    const Lit lit = light(scene, backend);
    NoProgress progress;
    // 4 m x 3 m of the floor, at z = 0.3 m, in pixels of 0.1 m, the middle at (2, 2.5); north at the top.
    const View plan{.id = "plan", .kind = ViewKind::parallel, .from_m = {2, 2.5, 2}, .to_m = {2, 2.5, 0.3}, .up = {0, 1, 0},
                    .width_m = 4, .width = 40, .height = 30};
    const Picture parallel = draw_view(scene, lit.building, lit.grid, *lit.visibility, lit.solution, plan, progress);
    double darkest = 1e9, brightest = 0.0;
    for (const std::size_t row : {3u, 15u, 27u}) {
        for (const std::size_t column : {5u, 20u, 31u}) {
            // The same pixel from straight above.
            const dvec3 point_m(0.1 * (static_cast<double>(column) + 0.5), 4 - 0.1 * (static_cast<double>(row) + 0.5), 0.3);
            const View view{.id = "v", .from_m = point_m + dvec3(0, 0, 2), .to_m = point_m, .up = {0, 1, 0},
                            .field_of_view_rad = 2 * std::atan(0.05 / 2), .width = 1, .height = 1};
            const Picture perspective = draw_view(scene, lit.building, lit.grid, *lit.visibility, lit.solution, view, progress);
            const double luminance = parallel.luminance_cd_m2[row * 40 + column].g;
            // Both average the same four points of the floor: rounding.
            CHECK_THAT(luminance, WithinRel(perspective.luminance_cd_m2[0].g, 1e-9));
            darkest = std::min(darkest, luminance), brightest = std::max(brightest, luminance);
        }
    }
    CHECK(brightest > 2 * darkest);  // places can be told apart
}

namespace {

/// Area-weighted mean illuminance of all surfaces of a room, lx.
double mean_room_illuminance(const Lit& lit, bool sun_alone) {
    double sum = 0.0, area = 0.0;
    for (std::size_t p = 0; p < lit.grid.indoor_patch_count; ++p) {
        const LightBySource total = lit.solution.patch_direct_lx[p] + lit.solution.radiosity.indirect_illuminance_lx[p];
        sum += lit.grid.patches[p].area_m2 * (sun_alone ? total.other.g : total.total().g);
        area += lit.grid.patches[p].area_m2;
    }
    return sum / area;
}

Scene sunny_room_with_window() {
    Scene scene = room_with_window();
    scene.sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 12000.0};
    scene.sun = SunDescription{.altitude_rad = 0.62, .azimuth_rad = 2.75, .direct_normal_illuminance_lx = 70000.0};
    return scene;
}

}  // namespace

TEST_CASE("with zones the mean illuminance hardly depends on the grid spacing", "[daylight][zones][convergence]") {
    const Backend backend = all_backends().back();
    Scene scene = sunny_room_with_window();
    const auto means = [&](double spacing_m, bool zones) {
        scene.grid.spacing_m = spacing_m;
        scene.grid.zones = zones;
        const Lit lit = light(scene, backend);
        return std::pair{mean_room_illuminance(lit, false), mean_room_illuminance(lit, true)};
    };
    const auto coarse = means(1.0, true), fine = means(0.5, true), finest = means(0.25, true);
    INFO("all light, with zones: " << coarse.first << ", " << fine.first << ", " << finest.first << " lx");
    CHECK_THAT(fine.first, WithinRel(coarse.first, 0.01));
    CHECK_THAT(finest.first, WithinRel(fine.first, 0.01));
    // What is left comes from the sky and the sunlit ground at the window, not from the spots.
    const auto coarse_without = means(1.0, false), fine_without = means(0.5, false);
    INFO("sun: with zones " << coarse.second << ", " << fine.second << ", without " << coarse_without.second << ", "
                            << fine_without.second << " lx");
    CHECK(std::abs(coarse_without.second / fine_without.second - 1.0) > 2.0 * std::abs(coarse.second / fine.second - 1.0));
}

TEST_CASE("the sun's light jumps within one pixel at the edge of a sunspot at any grid spacing", "[picture][zones]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = sunny_room_with_window();
    scene.sky = {.model = SkyModel::uniform, .zenith_luminance_cd_m2 = 1e-3};  // next to nothing but the sun
    scene.ground.reflectance = {};
    scene.materials[0].reflectance = grey(0.5);
    for (const double spacing_m : {1.7, 0.4}) {
        INFO(spacing_m << " m");
        scene.grid.spacing_m = spacing_m;
        const Lit lit = light(scene, backend);
        NoProgress progress;
        // Straight down on the floor.
        const View view{.id = "plan", .from_m = {2, 2.5, 3.2}, .to_m = {2, 2.5, 0}, .up = {0, 1, 0}, .field_of_view_rad = 1.0, .width = 120, .height = 90};
        const Picture picture = draw_view(scene, lit.building, lit.grid, *lit.visibility, lit.solution, view, progress);
        const double spot = 70000.0 * std::sin(0.62) * 0.5 / pi;
        // Outside the spot there is interreflection only, below a tenth of the sun.
        const auto at = [&](int column, int row) {
            return picture.luminance_cd_m2[static_cast<std::size_t>(row * 120 + column)].g / spot;
        };
        int jumps = 0, gradual = 0;
        for (int row = 1; row < 89; ++row) {
            for (int column = 1; column < 119; ++column) {
                double darkest = 2.0, brightest = 0.0;
                for (int j = row - 1; j <= row + 1; ++j)
                    for (int i = column - 1; i <= column + 1; ++i)
                        darkest = std::min(darkest, at(i, j)), brightest = std::max(brightest, at(i, j));
                const bool edge = darkest < 0.2 && brightest > 0.95;
                jumps += edge ? 1 : 0;
                gradual += !edge && at(column, row) > 0.2 && at(column, row) < 0.95 ? 1 : 0;
            }
        }
        CHECK(jumps > 100);
        CHECK(gradual == 0);
    }
}
