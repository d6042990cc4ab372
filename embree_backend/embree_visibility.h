#pragma once
#include <cstdint>
#include <memory>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

/// How form factors are found.
enum class FormFactorMethod {
    hemisphere,  ///< rays from all over a patch: fast, cost linear in patches
    pairwise,    ///< every pair of patches, exact but for a tolerance: cost quadratic in patches
};

struct EmbreeOptions {
    FormFactorMethod form_factors = FormFactorMethod::hemisphere;
    int rays_per_patch = 4096;   ///< for a row of form factors; rounded up to a multiple of 256
    int rays_per_point = 16384;  ///< for gathering at a point; rounded up to a multiple of 256
    double pair_tolerance = 1e-4;  ///< pairwise: largest estimated error of a form factor
    std::uint64_t seed = 1;
};

/// Visibility by ray casting with Embree.
std::unique_ptr<Visibility> make_embree_visibility(const Building& building, const PatchGrid& grid,
                                                   const EmbreeOptions& options = {});

}  // namespace naturel
