#include "embree_backend/cell_patches.h"

#include <glm/geometric.hpp>
#include <random>

#include "embree_backend/hit_counts.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;

TEST_CASE("cells of a grid know the patches that a search finds", "[embree][property]") {
    std::size_t places = 0, unknown = 0, beside_lines = 0;
    for (unsigned seed = 1; seed <= 6; ++seed) {
        const Building building = assemble(random_scene(seed, 12, seed % 2 == 0 ? Placement::free : Placement::lattice, 0.5));
        const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.3});
        const CellPatches cells(grid, building.faces.size());
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> share(0.01, 0.99);
        std::size_t wrong = 0;
        for (std::size_t id = 0; id < grid.patches.size(); ++id) {
            const std::span<const glm::dvec3> corners = grid.polygon_of(make_id<PatchId>(id));
            const PatchGrid::FaceGrid& face = grid.face_grid(grid.patches[id].face);
            const CellPatches::FaceCells& own = cells.of_face(grid.patches[id].face);
            for (int n = 0; n < 20; ++n) {
                const glm::dvec3& from = corners[random() % corners.size()];
                const glm::dvec3 on_outline = glm::mix(from, corners[random() % corners.size()], share(random));
                const glm::dvec3 point = glm::mix(on_outline, grid.patches[id].centroid_m, share(random));
                const auto column = static_cast<float>(own.division * glm::dot(point - face.origin_m, face.du));
                const auto row = static_cast<float>(own.division * glm::dot(point - face.origin_m, face.dv));
                const std::uint32_t entry = cells.counters()[own.first + static_cast<std::uint32_t>(static_cast<int>(row) * own.columns + static_cast<int>(column))];
                ++places;
                if (entry < CellPatches::cut) {
                    wrong += entry != HitCounts::counter_of(grid.patch_at(grid.patches[id].face, point));
                } else if (const PatchId beside = cells.patch_beside(entry, column, row); beside != PatchId::none) {
                    ++beside_lines;
                    wrong += beside != grid.patch_at(grid.patches[id].face, point);
                } else {
                    ++unknown;
                }
            }
        }
        INFO("seed " << seed);
        CHECK(wrong == 0);
    }
    INFO(unknown << " of " << places << " places unknown, " << beside_lines << " beside lines");
    CHECK(beside_lines > 0);
    CHECK(20 * unknown <= places);  // the search is for few
}
