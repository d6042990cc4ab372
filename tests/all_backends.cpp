#include "tests/all_backends.h"

#include "hemicube_backend/hemicube_visibility.h"
#ifdef NATUREL_HAS_EMBREE
#include "embree_backend/embree_visibility.h"
#endif

namespace naturel::tests {

std::vector<Backend> all_backends() {
    std::vector<Backend> backends;
    backends.push_back({"hemicube", [](const Building& building, const PatchGrid& grid) {
                            return make_hemicube_visibility(building, grid, {});
                        }});
    backends.push_back({"single plane", [](const Building& building, const PatchGrid& grid) {
                            return make_hemicube_visibility(building, grid,
                                                            {.surface = ProjectionSurface::single_plane});
                        }});
#ifdef NATUREL_HAS_EMBREE
    backends.push_back({"embree", [](const Building& building, const PatchGrid& grid) {
                            return make_embree_visibility(building, grid, {});
                        }});
#endif
    return backends;
}

}  // namespace naturel::tests
