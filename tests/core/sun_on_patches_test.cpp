#include "core/sun_on_patches.h"

#include <cmath>

#include "core/sunspot.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinRel;

TEST_CASE("patches of a grid that knows no sun get the flux of its sunspots", "[sun_on_patches][property]") {
    // A window with a mullion, so that one sunspot has a hole or two parts, and a table that shades and is lit.
    Scene scene = closed_room({4, 5, 3}, 0.5, 0.3);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    scene.polyhedra.push_back(box("mullion", Effect::fill, {1.95, -0.2, 1.2}, {2.05, -0.1, 2.4}));
    scene.polyhedra.push_back(box("transom", Effect::fill, {1, -0.2, 1.75}, {3, -0.1, 1.85}));
    scene.polyhedra.push_back(box("table", Effect::fill, {1, 1.5, 1.0}, {2.5, 2.3, 1.05}));
    scene.grid.spacing_m = 0.3;
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building, nullptr));
    const SunOnPatches sun_on_patches(building, grid);
    const double altitude = GENERATE(0.3, 0.6, 1.1), azimuth = GENERATE(2.2, 3.1, 3.9);
    const SunBeam sun{{std::cos(altitude) * std::sin(azimuth), std::cos(altitude) * std::cos(azimuth), std::sin(altitude)},
                      80000.0, {1.0, 0.9, 0.8}};
    Band3 spots_lm{}, patches_lm{};
    const SunspotFinder finder(scene, building, sun);
    for (std::size_t f = 0; f < building.faces.size(); ++f) {
        for (const Sunspot& spot : finder.on_face(make_id<FaceId>(f))) spots_lm += area_m2(spot.region) * spot.illuminance_lx;
    }
    PatchId last = PatchId::none;
    for (const SunOnPatches::LitPatch& lit : sun_on_patches.lit_by(scene, sun)) {
        CHECK((last == PatchId::none || last < lit.patch));
        last = lit.patch;
        patches_lm += grid.patches[index(lit.patch)].area_m2 * lit.mean_lx;
    }
    CHECK(spots_lm.r > 0.0);
    // Corners are rounded to 1 nm, of cells of 0.3 m; the grid drops slivers of 2 nm.
    CHECK_THAT(patches_lm.r, WithinRel(spots_lm.r, 1e-6));
    CHECK_THAT(patches_lm.b, WithinRel(spots_lm.b, 1e-6));
}
