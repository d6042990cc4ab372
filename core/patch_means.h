#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "core/patch_grid.h"

namespace naturel {

/// Mean over a patch of what is linear between its corners and the mean of the corners at its centroid: the weights of the corners.
/// Parallelograms: all equal.
std::vector<double> mean_weights(const PatchGrid& grid, PatchId patch);

/// Points that share the area of a patch, with their shares: four in each triangle of the fan round the centroid.
struct AreaSamples {
    std::vector<glm::dvec3> positions_m;
    std::vector<double> shares;
};
AreaSamples area_samples(const PatchGrid& grid, PatchId patch);

}  // namespace naturel
