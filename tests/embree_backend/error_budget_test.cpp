#include "core/error_budget.h"

#include <cmath>

#include "embree_backend/embree_visibility.h"
#include "hemicube_backend/hemicube_visibility.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A closed room of which one face shines; with a pillar it is not convex. With a window it has direct light, too.
Scene room(bool pillar, bool window) {
    Scene scene = empty_scene();
    scene.materials.push_back({.name = "lamp", .reflectance = grey(0.5), .exitance_lm_m2 = grey(1000.0)});
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, 0}, {4.3, 5.3, 3.4}),
                       box("room", Effect::carve, {0, 0, 0.3}, {4, 5, 3.1})};
    scene.polyhedra[1].faces[0].material = make_id<MaterialId>(scene.materials.size() - 1);
    if (window) scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1.2}, {3, 0, 2.4}));
    if (pillar) scene.polyhedra.push_back(box("pillar", Effect::fill, {1.8, 2.2, 0.3}, {2.2, 2.6, 3.1}));
    scene.sky = {.model = SkyModel::moon_spencer, .horizontal_illuminance_lx = 10000.0};
    scene.grid.spacing_m = 0.7;
    scene.sensors = {{.id = "plane", .grid = SensorGrid{.z_m = 0.85, .spacing_m = 1.0, .margin_m = 0.4}}};
    return scene;
}

struct Study {
    Scene scene;
    Building building;
    PatchGrid grid;
    BudgetFormFactors form_factors;
    ErrorBudget budget;
};

Study study(const Scene& scene, const HemicubeOptions& method) {
    Study found{.scene = scene, .building = assemble(scene), .grid = {}, .form_factors = {}, .budget = {}};
    found.grid = make_patch_grid(found.building, scene.grid);
    const auto reference = make_embree_visibility(found.building, found.grid,
                                                  {.form_factors = FormFactorMethod::pairwise, .rays_per_point = 4096, .pair_tolerance = 1e-5});
    const auto again = make_embree_visibility(found.building, found.grid, {.rays_per_patch = 4096, .rays_per_point = 4096, .seed = 2});
    const auto projection = make_hemicube_visibility(found.building, found.grid, method);
    BudgetOptions options;
    if (method.surface == ProjectionSurface::single_plane) options.half_side_over_height = method.half_side_over_height;
    NoProgress progress;
    found.budget = compute_error_budget(found.scene, found.building, found.grid, {*reference, *again, *projection}, options,
                                        found.form_factors, progress);
    return found;
}

constexpr HemicubeOptions article{.surface = ProjectionSurface::single_plane, .resolution = 64, .random_rotation = false};

/// Largest change of total illuminance, as a share of the mean of the reference, in sequence.
double largest_share(const ErrorBudget& budget, std::string_view name) {
    double mean_lx = 0.0;
    for (const ComponentsAndTotal& sensor : budget.reference.sensors) mean_lx += sensor.total() / static_cast<double>(budget.reference.sensors.size());
    const LightState* before = &budget.reference;
    for (const Ingredient& ingredient : budget.ingredients) {
        if (ingredient.name == name) {
            double largest = 0.0;
            for (std::size_t s = 0; s < before->sensors.size(); ++s)
                largest = std::max(largest, std::abs((ingredient.in_sequence.sensors[s] - before->sensors[s]).total()));
            return largest / mean_lx;
        }
        before = &ingredient.in_sequence;
    }
    return -1.0;
}

}  // namespace

TEST_CASE("the errors of the ingredients add up to that of the method at every point", "[compare][property]") {
    const ErrorBudget budget = study(room(true, true), article).budget;
    REQUIRE(budget.ingredients.size() == 10);
    for (const bool at_nodes : {false, true}) {
        const auto& reference = at_nodes ? budget.reference.nodes : budget.reference.sensors;
        const auto& method = at_nodes ? budget.method().nodes : budget.method().sensors;
        REQUIRE(!reference.empty());
        for (std::size_t p = 0; p < reference.size(); ++p) {
            for (std::size_t c = 0; c < ComponentsAndTotal::names.size(); ++c) {
                double sum = 0.0, before = reference[p].lx[c];
                for (const Ingredient& ingredient : budget.ingredients) {
                    const double now = (at_nodes ? ingredient.in_sequence.nodes : ingredient.in_sequence.sensors)[p].lx[c];
                    sum += now - before;
                    before = now;
                }
                // Rounding of ten differences.
                CHECK(std::abs(sum - (method[p].lx[c] - reference[p].lx[c])) <= 1e-12 * (1.0 + std::abs(reference[p].lx[c])));
            }
        }
    }
    CHECK(largest_share(budget, "partial visibility") > 1e-4);  // the pillar
}

TEST_CASE("ingredients that cannot err in a scene have no error there", "[compare][property]") {
    SECTION("an empty convex room hides nothing, and without windows there is no direct light") {
        const ErrorBudget budget = study(room(false, false), article).budget;
        // Closed forms on either side: what is left is the tolerance by which a pair counts as seen wholly.
        CHECK(largest_share(budget, "partial visibility") <= 1e-9);
        for (const auto* name : {"element centres", "element count", "near-aperture zones", "aperture visibility"})
            CHECK(largest_share(budget, name) == 0.0);
        CHECK(largest_share(budget, "proximity") > 1e-5);
        CHECK(largest_share(budget, "truncation") > 1e-4);
    }
    SECTION("a hemi-cube leaves nothing out, and a square without end next to nothing") {
        HemicubeOptions hemicube = article;
        hemicube.surface = ProjectionSurface::hemicube;
        CHECK(largest_share(study(room(false, false), hemicube).budget, "truncation") == -1.0);
        HemicubeOptions wide = article;
        wide.half_side_over_height = 1e4;
        CHECK(largest_share(study(room(false, false), wide).budget, "truncation") <= 1e-7);
    }
}

TEST_CASE("what a square leaves out of an empty room is the closed form", "[compare][analytic]") {
    const double ratio = GENERATE(1.0, 3.0, 7.0, 14.0, 28.0);
    CAPTURE(ratio);
    const Scene scene = room(false, false);
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    const auto visibility = make_embree_visibility(building, grid, {.form_factors = FormFactorMethod::pairwise, .pair_tolerance = 1e-6});
    NoProgress progress;
    const FormFactors reference = compute_form_factors(*visibility, grid, {.repair = FormFactorRepair::none}, progress);
    const FormFactors caught = caught_by_square(seen_from_centroids(reference, grid), building, grid, ratio);
    const double s = ratio / std::sqrt(1.0 + ratio * ratio), lost = 1.0 - 4.0 / pi * s * std::atan(s);
    for (std::size_t i = 0; i < caught.row_count(); ++i) {
        double sum = 0.0;
        for (std::uint64_t k = caught.row_begin[i]; k < caught.row_begin[i + 1]; ++k) sum += caught.value[k];
        // A room that is closed and empty is seen in closed form: rounding of sums of some hundred terms. 2 % is what is asked for.
        CHECK_THAT(caught.truncated[i], WithinRel(lost, 1e-6));
        CHECK_THAT(sum + caught.truncated[i], WithinAbs(1.0, 1e-6));
    }
}
