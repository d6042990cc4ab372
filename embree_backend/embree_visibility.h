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
    /// Hemisphere: the rays of a patch are doubled until estimated_error() of its row is no larger; 0: never.
    double target_error = 0.0;
    int most_rays_per_patch = 1 << 20;  ///< where a target error ends all the same
    double pair_tolerance = 1e-4;  ///< pairwise: largest estimated error of a form factor
    std::uint64_t seed = 1;
};

/// Root of the sum of the squares of the errors of a row: the standard error of the light it gathers, as a share of the
/// largest exitance it sees, if the exitances of patches have nothing to do with each other. (docs/embree.md)
double estimated_error(const FormFactorRow& row);

/// Visibility by ray casting with Embree.
std::unique_ptr<Visibility> make_embree_visibility(const Building& building, const PatchGrid& grid,
                                                   const EmbreeOptions& options = {});

}  // namespace naturel
