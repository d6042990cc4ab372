#pragma once
#include <cstdint>
#include <memory>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

struct EmbreeOptions {
    int rays_per_patch = 4096;   ///< for a row of form factors; rounded up to a multiple of 256
    int rays_per_point = 16384;  ///< for gathering at a point; rounded up to a multiple of 256
    std::uint64_t seed = 1;
};

/// Visibility by ray casting with Embree.
std::unique_ptr<Visibility> make_embree_visibility(const Building& building, const PatchGrid& grid,
                                                   const EmbreeOptions& options = {});

}  // namespace naturel
