// Skies without light, black and nearly white rooms, glazing that lets nothing pass: right answers, and no NaN on the way.
#include <cmath>
#include <glm/geometric.hpp>

#include "core/daylight.h"
#include "core/sky_levels.h"
#include "core/sky_models.h"
#include "core/sky_table.h"
#include "core/sun.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

struct Lit {
    explicit Lit(const Scene& scene, const Backend& backend = all_backends().back())
        : building(assemble(scene)),
          grid(make_patch_grid(building, scene.grid, find_light_zones(scene, building))),
          visibility(backend.make(building, grid)),
          solution(compute_daylight(scene, building, grid, *visibility, {}, progress)) {}

    NoProgress progress;
    Building building;
    PatchGrid grid;
    std::unique_ptr<Visibility> visibility;
    DaylightSolution solution;
};

/// A room with a glazed window to the south and the sun in it.
Scene sunny_room(double reflectance) {
    Scene scene = closed_room({4, 5, 3}, reflectance, 0.3);
    scene.glazings.push_back({.name = "single", .normal_transmittance = grey(0.88)});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    scene.sky = {.model = SkyModel::moon_spencer, .horizontal_illuminance_lx = 10'000.0};
    scene.sun = {.altitude_rad = 0.6, .azimuth_rad = 2.9, .direct_normal_illuminance_lx = 50'000.0};
    scene.grid = {.spacing_m = 2.0, .outdoor_spacing_m = 4.0};
    scene.sensors = {{.id = "p", .points = {{{2, 1, 1}, {0, 0, 1}}, {{1, 3, 1.5}, {0, -1, 0}}}}};
    return scene;
}

/// Nothing shines: not a single value differs from zero, and none is NaN.
void check_dark(const DaylightSolution& solution) {
    for (const auto* values : {&solution.nodes, &solution.sensor_values})
        for (const PointIlluminance& value : *values) CHECK(value.total_lx() == Band3{});
    for (const LightBySource& light : solution.patch_direct_lx) CHECK(light.total() == Band3{});
    for (const LightBySource& light : solution.radiosity.exitance_lm_m2) CHECK(light.total() == Band3{});
    for (const LightBySource& light : solution.outdoors.patch_luminance_cd_m2) CHECK(std::isfinite(light.total().g));
    CHECK(solution.radiosity.converged);
    CHECK(solution.radiosity.relative_residual == 0.0);
}

}  // namespace

TEST_CASE("every sky of level zero is dark", "[sky][extremes]") {
    const bool by_zenith = GENERATE(false, true);
    for (const SkyModelInfo& info : sky_models()) {
        SkyDescription description{.model = info.model, .cie_type = info.cie_type, .expression = "1 + altitude"};
        description.perez = {.direct_normal_W_m2 = 500.0, .diffuse_horizontal_W_m2 = 100.0};
        description.table = std::make_shared<SkyTable>(tregenza_patches(), std::vector<double>(145, 3.0), true);
        (by_zenith ? description.zenith_luminance_cd_m2 : description.horizontal_illuminance_lx) = 0.0;
        const Sky sky(description, direction_from_angles(0.7, 2.0));
        INFO(info.name);
        CHECK(sky.horizontal_illuminance().value == 0.0);
        CHECK(sky.zenith_luminance().value == 0.0);
        CHECK(sky.plane_illuminance({0, 1, 0}).value == 0.0);
        for (const double altitude : {0.0, 0.3, 0.7, 0.5 * pi}) CHECK(sky.luminance(direction_from_angles(altitude, 2.0)).value == 0.0);
    }
}

TEST_CASE("a table of zeros, a formula of zero and weather without light are dark skies", "[sky][extremes]") {
    const bool interpolated = GENERATE(false, true);
    SkyDescription table{.model = SkyModel::table};
    table.table = std::make_shared<SkyTable>(tregenza_patches(), std::vector<double>(145, 0.0), interpolated);
    const SkyDescription formula{.model = SkyModel::expression, .expression = "0"}, weather{.model = SkyModel::perez};
    SkyDescription table_of_level_zero = table;
    table_of_level_zero.horizontal_illuminance_lx = 0.0;
    for (const SkyDescription& description : {table, table_of_level_zero, formula, weather}) {
        const Sky sky(description, direction_from_angles(0.7, 2.0));
        INFO(sky_model(description).name);
        CHECK(sky.horizontal_illuminance().value == 0.0);
        CHECK(sky.luminance(direction_from_angles(0.3, 1.0)).value == 0.0);
    }
}

TEST_CASE("under a dark sky without sun a building is dark, and with the sun it has the sun's light alone", "[daylight][extremes]") {
    Scene scene = sunny_room(0.5);
    const Lit day(scene);
    scene.sky.horizontal_illuminance_lx = 0.0;
    const Lit without_sky(scene);
    for (std::size_t k = 0; k < day.solution.sensor_values.size(); ++k) {
        const PointIlluminance &both = day.solution.sensor_values[k], &sun = without_sky.solution.sensor_values[k];
        CHECK(sun.from_sky_lx() == Band3{});
        CHECK(sun.direct.sun_lx == both.direct.sun_lx);
        // What the sun reflects outdoors is integrated with the sky where there is one: the tolerance of direct light.
        CHECK_THAT(sun.total_lx().g, WithinRel((both.total_lx() - both.from_sky_lx()).g, 2e-3));
        CHECK(sun.total_lx().g > 0.0);
    }
    for (const double altitude : {0.0, -0.3}) {
        scene.sun->altitude_rad = altitude;
        check_dark(Lit(scene).solution);
    }
    scene.sun.reset();
    check_dark(Lit(scene).solution);
}

TEST_CASE("glazing that lets nothing pass keeps a room dark", "[daylight][glazing][extremes]") {
    const auto law = GENERATE(AngularLaw::fresnel, AngularLaw::mitalas, AngularLaw::rivero, AngularLaw::constant, AngularLaw::diffuse,
                              AngularLaw::table);
    INFO("law " << static_cast<int>(law));
    Scene scene = sunny_room(0.5);
    Glazing& glass = scene.glazings[1];
    glass.angular_law = law;
    glass.normal_transmittance = {};
    if (law == AngularLaw::table) glass.angular_table = {{0.0, {}}, {0.5 * pi, {}}};
    glass.inner_reflectance = grey(0.3);
    const Lit lit(scene);
    check_dark(lit.solution);
    CHECK(lit.solution.outdoors.horizontal_illuminance().value == 10'000.0);
}

TEST_CASE("glazing as dirty as can be, or all frame, keeps a room dark", "[daylight][glazing][extremes]") {
    Scene scene = sunny_room(0.5);
    double& share = GENERATE(false, true) ? scene.glazings[1].maintenance : scene.glazings[1].frame;
    share = 0.0;
    check_dark(Lit(scene).solution);
}

TEST_CASE("a room of one reflectance is lit by M / (1 - rho), from black to 0.99", "[daylight][analytic][extremes]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    const double reflectance = GENERATE(0.0, 0.9, 0.99);
    INFO(backend.name << ", reflectance " << reflectance);
    Scene scene = closed_room({3, 4, 2.5}, reflectance, 0.3);
    scene.polyhedra.push_back(box("cupboard", Effect::fill, {0, 0, 0.3}, {1, 0.5, 2}));
    scene.materials[0].exitance_lm_m2 = {100, 200, 50};
    scene.grid.spacing_m = 0.5;
    scene.sensors = {{.id = "p", .points = {{{1.5, 2, 1.1}, {0, 0, 1}}, {{2, 3, 1}, glm::normalize(dvec3(1, -2, 0.5))}}}};
    const Lit lit(scene, backend);
    CHECK(lit.solution.radiosity.converged);
    for (const LightBySource& irc : lit.solution.radiosity.indirect_illuminance_lx) {
        // The iteration stops at 1e-6 of the flux that came in; what is left of it goes round 1 / (1 - rho) times.
        // Rows sum to 1 within 1e-10, of which 1 / (1 - rho) remains.
        CHECK_THAT(irc.other.r, WithinRel(100.0 / (1.0 - reflectance), 1e-5));
        CHECK_THAT(irc.other.g, WithinRel(200.0 / (1.0 - reflectance), 1e-5));
    }
    for (const PointIlluminance& value : lit.solution.sensor_values)
        CHECK_THAT(value.total_lx().g, WithinRel(200.0 / (1.0 - reflectance), 1e-3));  // cells or rays lost at edges
}

TEST_CASE("in a black room there is no indirect light, in one of 0.99 every lumen finds its way out", "[daylight][extremes]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Lit black(sunny_room(0.0), backend);
    for (const PointIlluminance& value : black.solution.sensor_values) {
        CHECK(value.indirect_lx.total() == Band3{});
        CHECK(value.total_lx().g > 0.0);
    }
    const Scene scene = sunny_room(0.99);
    const Lit white(scene, backend);
    const RadiositySolution& radiosity = white.solution.radiosity;
    CHECK(radiosity.converged);
    // Counted anew: surfaces keep 1 % of what meets them, the window all.
    double in_lm = 0.0, gone_lm = 0.0;
    for (std::size_t p = 0; p < white.grid.gather_patch_count; ++p) {
        const double area = white.grid.patches[p].area_m2, indirect_lx = radiosity.indirect_illuminance_lx[p].total().g;
        if (p < white.grid.indoor_patch_count) {
            const double direct_lx = white.solution.patch_direct_lx[p].total().g;
            in_lm += area * direct_lx;
            gone_lm += 0.01 * area * (direct_lx + indirect_lx);
        } else {
            gone_lm += area * indirect_lx;
        }
    }
    // The iteration's 1e-6, gone round up to 1 / (1 - rho) times.
    CHECK_THAT(gone_lm, WithinRel(in_lm, 1e-4));
}
