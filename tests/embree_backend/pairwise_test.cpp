#include "embree_backend/pairwise.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "core/parallel.h"
#include "core/polygon_form_factor.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;

TEST_CASE("pairs past boxes close their rows, and a row alone has the bits of all rows", "[embree][pairwise][property]") {
    Scene scene = closed_room({3, 2.5, 2.4});
    scene.polyhedra.push_back(box("box", Effect::fill, {0.6, 0.7, 0}, {1.3, 1.2, 0.8}));
    scene.polyhedra.push_back(box("shelf", Effect::fill, {1.8, 1.0, 1.0}, {2.6, 2.0, 1.1}));
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.5});
    const double tolerance = 1e-5;
    const PairwiseExchange exchange(building, grid, {.tolerance = tolerance});
    NoProgress quiet;
    const FormFactorRows rows = exchange.rows(true, quiet);
    FormFactorRow row;
    double worst = 0.0;
    std::size_t different = 0;
    for (std::size_t i = 0; i < grid.gather_patch_count; ++i) {
        double sum = 0.0;
        for (auto e = rows.row_begin[i]; e < rows.row_begin[i + 1]; ++e) sum += rows.value[e];
        worst = std::max(worst, std::abs(sum - 1.0));
        if (i % 7 != 0) continue;
        exchange.row(make_id<PatchId>(i), row);
        different += row.values.size() != rows.row_begin[i + 1] - rows.row_begin[i];
        for (std::size_t k = 0; k < row.values.size(); ++k)
            different += index(row.patches[k]) != rows.column[rows.row_begin[i] + k] || row.values[k] != rows.value[rows.row_begin[i] + k];
    }
    // Some hundred values of a row err by less than the tolerance each, in either direction.
    CHECK(worst < 20 * tolerance);
    CHECK(different == 0);
}

TEST_CASE("triangles and quadrilaterals take rules that agree with the contour integral", "[embree][pairwise][property]") {
    // Wedges cut the grids of floor and ceiling into triangles and trapezia.
    Scene scene = closed_room({3, 2.5, 2.4});
    Polyhedron wedge{.id = "wedge", .kind = PolyhedronKind::prism, .effect = Effect::fill, .material = MaterialId{}};
    wedge.vertices_m = {glm::dvec3(0, 0, 0), {1.3, 0, 0}, {0, 1.1, 0}, {0, 0, 2.4}};
    scene.polyhedra.push_back(wedge);
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.3});
    NoProgress quiet;
    const FormFactorRows rows = PairwiseExchange(building, grid, {}).rows(false, quiet);
    double worst = 0.0;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < grid.gather_patch_count; ++i) {
        const Patch& a = grid.patches[i];
        const auto corners = grid.polygon_of(make_id<PatchId>(i));
        if (corners.size() == 4 && glm::length(corners[0] + corners[2] - corners[1] - corners[3]) < 1e-8) continue;
        for (auto e = rows.row_begin[i]; e < rows.row_begin[i + 1]; e += 7) {
            const Patch& b = grid.patches[rows.column[e]];
            const double exact = unoccluded_exchange_m2(corners, a.normal, grid.polygon_of(make_id<PatchId>(rows.column[e])), b.normal);
            worst = std::max(worst, std::abs(rows.value[e] - exact / a.area_m2));
            ++compared;
        }
    }
    CHECK(compared > 500);
    CHECK(worst < 1e-6);  // rules err by 1e-5 of A / (pi r^2), which is below 0.1 where they are used
}
