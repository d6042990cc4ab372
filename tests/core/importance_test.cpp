#include "core/importance.h"

#include <random>

#include "core/daylight.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinRel;

TEST_CASE("a reading by importance is that of the radiosity, whatever the light", "[importance][property]") {
    // Two rooms with a pane between them, coloured.
    Scene scene = closed_room({4, 3, 2.5}, 0.5, 0.3);
    scene.materials[0].reflectance = {0.7, 0.5, 0.2};
    scene.polyhedra.push_back(box("next", Effect::carve, {4.2, 0, 0.3}, {6, 3, 2.8}));
    scene.polyhedra.push_back(box("door", Effect::carve, {4, 1, 0.3}, {4.2, 2, 2.3}));
    scene.glazings.push_back({.name = "pane", .normal_transmittance = {0.8, 0.6, 0.4}, .inner_reflectance = grey(0.15)});
    scene.polyhedra.back().faces[4].glazing = make_id<GlazingId>(1);
    scene.grid.spacing_m = 1.0;
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    const auto visibility = all_backends().front().make(building, grid);
    NoProgress progress;
    const auto repair = GENERATE(FormFactorRepair::reciprocal, FormFactorRepair::none);
    const FormFactors form_factors = compute_form_factors(*visibility, grid, {.repair = repair}, progress);
    std::vector<PatchOptics> optics = patch_optics(scene, building, grid);
    REQUIRE(std::ranges::any_of(optics, [](const PatchOptics& p) { return p.transmittance.r > 0.0; }));
    std::vector<double> area_m2;
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (std::size_t p = 0; p < grid.gather_patch_count; ++p) {
        area_m2.push_back(grid.patches[p].area_m2);
        optics[p].exitance_lm_m2.other = {share(random), share(random), share(random)};
    }
    const RadiosityOptions options{.tolerance = 1e-9};
    const RadiositySolution radiosity =
        solve_radiosity(form_factors, area_m2, optics, std::vector<LightBySource>(area_m2.size()), options, progress);
    constexpr std::size_t readings = 20;  // more than go through the matrix together
    std::vector<std::vector<double>> weights(readings, std::vector<double>(area_m2.size()));
    for (auto& of_patches : weights)
        for (double& weight : of_patches) weight = share(random) < 0.2 ? share(random) : 0.0;
    const Importance importance = solve_importance(
        form_factors, area_m2, optics, readings, 3,
        [&](std::size_t reading, std::size_t, std::span<double> out) {
            for (std::size_t p = 0; p < out.size(); ++p)
                if (weights[reading][p] > 0.0) out[p] = weights[reading][p];  // the others are zeros already
        },
        options, progress);
    CHECK(importance.converged);
    for (std::size_t r = 0; r < readings; ++r) {
        Band3 read, owed;
        for (std::size_t p = 0; p < area_m2.size(); ++p) {
            read += weights[r][p] * radiosity.exitance_lm_m2[p].other;
            const Band3 of_one{importance.of(p, 0)[r], importance.of(p, 1)[r], importance.of(p, 2)[r]};
            owed += of_one * optics[p].exitance_lm_m2.other;
        }
        // Both stop at 1e-9 of the mean exitance; 1e-7 leaves room for readings of few patches.
        CHECK_THAT(owed.r, WithinRel(read.r, 1e-7));
        CHECK_THAT(owed.g, WithinRel(read.g, 1e-7));
        CHECK_THAT(owed.b, WithinRel(read.b, 1e-7));
    }
}
