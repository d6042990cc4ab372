#include "core/sky_series.h"

#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>

#include "core/parallel.h"
#include "core/sky_table.h"

#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;

namespace {

// A room with a desk and a glazed window on its south side; another building stands opposite.
Scene room_with_window() {
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.glazings.push_back({.name = "double", .normal_transmittance = grey(0.7), .panes = 2, .inner_reflectance = grey(0.15)});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    scene.polyhedra.push_back(box("desk", Effect::fill, {1, 1.5, 1.0}, {2.5, 2.3, 1.05}));
    scene.polyhedra.push_back(box("opposite", Effect::fill, {0, -12, 0}, {6, -9, 5}));
    scene.grid = {.spacing_m = 0.5, .outdoor_spacing_m = 2.0};
    scene.sensors = {{.id = "plane", .grid = SensorGrid{.z_m = 1.15, .spacing_m = 1.0, .margin_m = 0.5}},
                     {.id = "outdoors", .points = {{{2, -3, 1}, {0, 0, 1}}}}};
    return scene;
}

struct Room {
    explicit Room(Scene base, const Backend& backend, bool zones = true)
        : scene(std::move(base)), building(assemble(scene)),
          grid(make_patch_grid(building, scene.grid, zones ? find_light_zones(scene, building, nullptr) : LightZones{})),
          visibility(backend.make(building, grid)),
          form_factors(compute_form_factors(*visibility, grid, options.form_factors, progress)),
          sensors(place_sensors(scene, building)) {}

    SkySeries series() { return {scene, building, grid, *visibility, form_factors, sensors, options, progress}; }
    DaylightSolution slowly(const Scene& variant) {
        return compute_daylight(variant, building, grid, *visibility, options, sensors, progress);
    }

    DaylightOptions options{};
    NoProgress progress{};
    Scene scene;
    Building building;
    PatchGrid grid;
    std::unique_ptr<Visibility> visibility;
    FormFactors form_factors;
    std::vector<Sensor> sensors;
};

double grey_lx(const Band3& light) { return (light.r + light.g + light.b) / 3.0; }

}  // namespace

namespace {

// Bits of all that a series answers for sensors.
bool same_bits(const DaylightSolution& a, const DaylightSolution& b) {
    return a.sensor_values.size() == b.sensor_values.size() &&
           std::memcmp(a.sensor_values.data(), b.sensor_values.data(), a.sensor_values.size() * sizeof(PointIlluminance)) == 0 &&
           a.radiosity.flux_in_lm == b.radiosity.flux_in_lm && a.radiosity.flux_absorbed_lm == b.radiosity.flux_absorbed_lm &&
           a.radiosity.iterations == b.radiosity.iterations && a.radiosity.relative_residual == b.radiosity.relative_residual;
}

std::vector<double> uneven_patches() {
    std::vector<double> values;
    for (int k = 0; k < 145; ++k) values.push_back(2000.0 + 1500.0 * std::sin(1.7 * k));
    return values;
}

// Skies of every kind; the sun of those that have one stands where its surroundings shine through the window.
std::vector<Scene> variants_of(const Scene& base) {
    std::vector<SkyDescription> skies{
        {.model = SkyModel::uniform, .horizontal_illuminance_lx = 10000.0},
        {.model = SkyModel::moon_spencer, .horizontal_illuminance_lx = 10000.0},
        {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 10000.0},
        {.model = SkyModel::cie_general, .horizontal_illuminance_lx = 10000.0, .cie_type = 13},
        {.model = SkyModel::perez, .perez = {.direct_normal_W_m2 = 800.0, .diffuse_horizontal_W_m2 = 60.0}},
        {.model = SkyModel::table, .table = std::make_shared<const SkyTable>(tregenza_patches(), uneven_patches(), false)},
        {.model = SkyModel::table, .table = std::make_shared<const SkyTable>(tregenza_patches(), uneven_patches(), true)},
    };
    std::vector<Scene> variants;
    for (const SkyDescription& sky : skies) {
        variants.push_back(base);
        variants.back().sky = sky;
        variants.back().sun = SunDescription{.altitude_rad = 0.5, .azimuth_rad = 3.0};
    }
    return variants;
}

}  // namespace

TEST_CASE("a series answers without the sun as a calculation of its own", "[sky_series]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Room room(room_with_window(), backend);
    const std::vector<DaylightSolution> solutions = room.series().solve({&room.scene, 1}, room.progress);
    REQUIRE(solutions.size() == 1);
    const DaylightSolution& found = solutions[0];
    const DaylightSolution expected = room.slowly(room.scene);
    CHECK(found.radiosity.converged);
    CHECK(found.sensors.size() == room.sensors.size());
    REQUIRE(found.sensor_values.size() == expected.sensor_values.size());
    // Each direct part aims at the tolerance of 1e-3, IRC is a mean of many.
    for (std::size_t s = 0; s < found.sensor_values.size(); ++s) {
        const PointIlluminance &a = found.sensor_values[s], &b = expected.sensor_values[s];
        CHECK(std::abs(grey_lx(a.total_lx() - b.total_lx())) <= 2e-3 * grey_lx(b.total_lx()));
        CHECK(std::abs(grey_lx(a.indirect_lx.total() - b.indirect_lx.total())) <= 1e-3 * grey_lx(b.indirect_lx.total()));
    }
}

TEST_CASE("skies of every kind are met within the tolerance of direct light", "[sky_series][slow]") {
    const Backend backend = all_backends().back();
    Room room(room_with_window(), backend);
    std::vector<Scene> variants = variants_of(room.scene);
    const std::vector<DaylightSolution> solutions = room.series().solve(variants, room.progress);
    for (std::size_t k = 0; k < variants.size(); ++k) {
        INFO("sky " << k);
        Scene exact = variants[k];
        exact.direct.tolerance = 2e-4;
        const DaylightSolution expected = room.slowly(exact);
        double worst = 0.0, worst_indirect = 0.0;
        for (std::size_t s = 0; s < expected.sensor_values.size(); ++s) {
            const PointIlluminance &a = solutions[k].sensor_values[s], &b = expected.sensor_values[s];
            worst = std::max(worst, std::abs(grey_lx(a.total_lx() - b.total_lx())) / grey_lx(b.total_lx()));
            worst_indirect = std::max(worst_indirect, std::abs(grey_lx(a.indirect_lx.total() - b.indirect_lx.total())) /
                                                          std::max(1e-9, grey_lx(b.indirect_lx.total())));
        }
        // Patches of a table meet in steps, which rays at fixed places find no better than this; everything else is smooth.
        CHECK(worst <= (variants[k].sky.table && !variants[k].sky.table->is_interpolated() ? 3e-3 : 1e-3));
        CHECK(worst_indirect <= 1e-3);
    }
}

TEST_CASE("answers of a series do not depend on what is solved with them", "[sky_series][determinism][slow]") {
    Room room(room_with_window(), all_backends().back());
    std::vector<Scene> variants = variants_of(room.scene);
    for (std::size_t k = 0; k < 4; ++k) {  // a second set of reflectances, with sun
        variants.push_back(variants[k]);
        variants.back().materials[0].reflectance = {0.6, 0.5, 0.3};
        variants.back().sun->direct_normal_illuminance_lx = 60000.0;
    }
    std::vector<DaylightSolution> together;
    {
        const ThreadLimit limit(3);
        together = room.series().solve(variants, room.progress);
    }
    const ThreadLimit limit(1);
    SkySeries one_by_one = room.series();
    for (std::size_t k = variants.size(); k-- > 0;) {
        INFO(k);
        CHECK(same_bits(one_by_one.solve({&variants[k], 1}, room.progress)[0], together[k]));
    }
}

TEST_CASE("a series is linear in the level of the sky", "[sky_series][property]") {
    Room room(room_with_window(), all_backends().front());
    std::vector<Scene> variants(2, room.scene);
    variants[0].sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 5000.0};
    variants[1].sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 10000.0};
    const auto solutions = room.series().solve(variants, room.progress);
    for (std::size_t s = 0; s < room.sensors.size(); ++s) {
        const double once = grey_lx(solutions[0].sensor_values[s].total_lx()), twice = grey_lx(solutions[1].sensor_values[s].total_lx());
        CHECK(std::abs(twice - 2.0 * once) <= 1e-12 * twice);
    }
}

TEST_CASE("a series with sun, other reflectances and other glass keeps to a calculation of its own", "[sky_series]") {
    Scene variant = room_with_window();
    variant.sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 10000.0, .colour = {{0.7, 1.0, 1.8}}};
    variant.sun = SunDescription{.altitude_rad = 0.6, .azimuth_rad = 3.3, .direct_normal_illuminance_lx = 60000.0};
    variant.materials[0].reflectance = {0.6, 0.5, 0.3};
    variant.materials[0].exitance_lm_m2 = {10.0, 20.0, 5.0};
    variant.glazings[1].normal_transmittance = {0.5, 0.6, 0.7};
    const Backend backend = all_backends().back();
    Room room(room_with_window(), backend);
    const DaylightSolution found = room.series().solve({&variant, 1}, room.progress)[0];
    // Cut along its sunspots, of which the series' grid knows nothing.
    const PatchGrid own_grid = make_patch_grid(room.building, variant.grid, find_light_zones(variant, room.building));
    const auto own_visibility = backend.make(room.building, own_grid);
    const DaylightSolution expected =
        compute_daylight(variant, room.building, own_grid, *own_visibility, room.options, room.sensors, room.progress);
    Band3 sum, mean, sky_sum, sky_mean;
    const auto gap = [](const Band3& a, const Band3& b) { return Band3{std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)}; };
    for (std::size_t s = 0; s < room.sensors.size(); ++s) {
        const PointIlluminance &a = found.sensor_values[s], &b = expected.sensor_values[s];
        CHECK(a.direct.sun_lx == b.direct.sun_lx);
        sum += gap(a.indirect_lx.total(), b.indirect_lx.total());
        mean += b.indirect_lx.total();
        sky_sum += gap(a.indirect_lx.sky, b.indirect_lx.sky);
        sky_mean += b.indirect_lx.sky;
    }
    // Cells of half a metre, of which a sunspot lights parts: the light of a cell is spread over all of it.
    CHECK(largest(sum - 0.02 * mean) <= 0.0);
    // That of the sky has the colour of the sky; its nodes are others than those of a grid with sunspots.
    CHECK(largest(sky_sum - 0.01 * sky_mean) <= 0.0);
    const RadiositySolution& flux = found.radiosity;
    CHECK(std::abs(grey_lx(flux.flux_in_lm - flux.flux_absorbed_lm - flux.flux_lost_lm)) <= 1e-5 * grey_lx(flux.flux_in_lm));
    CHECK(std::abs(grey_lx(flux.flux_in_lm - expected.radiosity.flux_in_lm)) <= 5e-3 * grey_lx(flux.flux_in_lm));
}

TEST_CASE("a series knows of the sun on a pane from inside", "[sky_series]") {
    // A low sun through the south window on a mirror of a north window, and little else of it.
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.glazings.push_back({.name = "clear", .normal_transmittance = grey(0.8)});
    scene.glazings.push_back({.name = "mirror", .normal_transmittance = grey(0.1), .inner_reflectance = grey(0.8)});
    scene.polyhedra.push_back(box("south", Effect::carve, {1.2, -0.5, 1.4}, {2.8, 0, 2.2}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    scene.polyhedra.push_back(box("north", Effect::carve, {0.2, 5, 0.5}, {3.8, 5.5, 2.8}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(2);
    scene.grid.spacing_m = 1.0;
    scene.sky.horizontal_illuminance_lx = 1000.0;
    scene.sun = SunDescription{.altitude_rad = 0.1, .azimuth_rad = pi, .direct_normal_illuminance_lx = 60000.0};
    scene.sensors = {{.id = "p", .points = {{{2, 2, 1}, {0, 0, 1}}}}};
    Room room(scene, all_backends().back());
    const double found = grey_lx(room.series().solve({&scene, 1}, room.progress)[0].sensor_values[0].indirect_lx.total());
    // Cut along its sunspots: on the grid of the series, which knows none, a calculation of its own samples them and is 2 % off.
    const PatchGrid own_grid = make_patch_grid(room.building, scene.grid, find_light_zones(scene, room.building));
    const auto own_visibility = all_backends().back().make(room.building, own_grid);
    const DaylightSolution expected =
        compute_daylight(scene, room.building, own_grid, *own_visibility, room.options, room.sensors, room.progress);
    // Both take the sun in the same points of the pane, and the sky within the tolerance of 1e-3.
    CHECK(std::abs(found / grey_lx(expected.sensor_values[0].indirect_lx.total()) - 1.0) <= 1e-3);
}

TEST_CASE("sets with few variants are solved forwards, with the same light and the same bits in any company", "[sky_series][determinism]") {
    Scene base = room_with_window();
    base.polyhedra.push_back(box("north", Effect::carve, {0.5, 5, 0.5}, {3.5, 5.5, 2.8}));  // panes that light meets from inside
    base.polyhedra.back().glazing = make_id<GlazingId>(1);
    Room room(base, all_backends().back());
    std::vector<Scene> variants = variants_of(room.scene);
    variants.resize(3);
    for (std::size_t k = 0; k < 2; ++k) {
        variants.push_back(variants[k]);
        variants.back().materials[0].reflectance = {0.6, 0.5, 0.3};
        variants.back().materials[0].exitance_lm_m2 = {10.0, 20.0, 5.0};
        variants.back().glazings[1].normal_transmittance = {0.5, 0.6, 0.7};
        variants.back().sky.colour = {{0.7, 1.0, 1.8}};
        variants.back().sun = SunDescription{.altitude_rad = 0.6, .azimuth_rad = 3.3, .direct_normal_illuminance_lx = 60000.0};
    }
    const std::vector<DaylightSolution> by_importance = room.series().solve(variants, room.progress);
    const std::vector<std::size_t> few(variants.size(), 0);
    std::vector<DaylightSolution> forwards;
    {
        const ThreadLimit limit(3);
        forwards = room.series().solve(variants, few, room.progress);
    }
    for (std::size_t k = 0; k < variants.size(); ++k) {
        INFO("variant " << k);
        const auto near = [&](const Band3& a, const Band3& b, const Band3& of) {
            // Both stop at 1e-6 of the mean exitance, in norms of their own.
            CHECK(largest(a - b) <= 1e-5 * largest(of));
            CHECK(largest(b - a) <= 1e-5 * largest(of));
        };
        for (std::size_t s = 0; s < room.sensors.size(); ++s) {
            const PointIlluminance &a = forwards[k].sensor_values[s], &b = by_importance[k].sensor_values[s];
            CHECK(a.direct.sky_lx == b.direct.sky_lx);
            CHECK(a.direct.sun_lx == b.direct.sun_lx);
            near(a.indirect_lx.sky, b.indirect_lx.sky, b.indirect_lx.sky);
            near(a.indirect_lx.other, b.indirect_lx.other, b.indirect_lx.other);
        }
        const RadiositySolution &a = forwards[k].radiosity, &b = by_importance[k].radiosity;
        CHECK(a.converged);
        CHECK(a.exitance_lm_m2.empty());
        near(a.flux_in_lm, b.flux_in_lm, b.flux_in_lm);
        near(a.flux_absorbed_lm, b.flux_absorbed_lm, b.flux_in_lm);
        near(a.flux_lost_lm, b.flux_lost_lm, b.flux_in_lm);
    }
    const ThreadLimit limit(1);
    SkySeries one_by_one = room.series();
    for (std::size_t k = variants.size(); k-- > 0;) {
        INFO(k);
        CHECK(same_bits(one_by_one.solve({&variants[k], 1}, {few.data(), 1}, room.progress)[0], forwards[k]));
    }
}

TEST_CASE("the memory of a series grows with its sets of reflectances, as far as they are kept, and with colours", "[sky_series]") {
    const Scene grey_room = closed_room({4, 5, 3}, 0.5, 0.3);
    Scene coloured = grey_room;
    coloured.materials[0].reflectance = {0.5, 0.4, 0.3};
    const Building building = assemble(grey_room);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 1.0});
    const auto cost = [&](const Scene& scene, std::size_t sets) { return sky_series_cost(scene, grid, 100, sets, 1000, 1e5); };
    CHECK(cost(grey_room, 1).bytes < cost(grey_room, 5).bytes);
    CHECK(cost(grey_room, 5).bytes == cost(grey_room, 500).bytes);
    CHECK(cost(coloured, 1).bytes > 2.0 * cost(grey_room, 1).bytes);
    // A table of doubles [patch or node][reading] alone.
    CHECK(cost(grey_room, 1).bytes > 8.0 * 100.0 * static_cast<double>(grid.nodes.size() + grid.gather_patch_count));
    CHECK(cost(grey_room, 1).set_seconds > 0.0);
    CHECK(sky_series_cost(grey_room, grid, 100, 1, 1, 1e5).bytes < cost(grey_room, 1).bytes);
}
