#include "embree_backend/pairwise.h"

#include <cmath>

#include "core/parallel.h"
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
