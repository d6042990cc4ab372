#include "core/patch_means.h"

#include <glm/geometric.hpp>
#include <span>

namespace naturel {

using glm::dvec3;

std::vector<double> mean_weights(const PatchGrid& grid, PatchId id) {
    const std::span<const dvec3> polygon = grid.polygon_of(id);
    const dvec3 &centroid_m = grid.patches[index(id)].centroid_m, &normal = grid.patches[index(id)].normal;
    const std::size_t n = polygon.size();
    std::vector<double> weights(n, 0.0);
    double area = 0.0, centre_weight = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const dvec3 a = polygon[i] - centroid_m, b = polygon[(i + 1) % n] - centroid_m;
        const double triangle = 0.5 * glm::dot(normal, glm::cross(a, b));
        weights[i] += triangle / 3.0;
        weights[(i + 1) % n] += triangle / 3.0;
        centre_weight += triangle / 3.0;
        area += triangle;
    }
    for (double& w : weights) w = (w + centre_weight / static_cast<double>(n)) / area;
    return weights;
}

AreaSamples area_samples(const PatchGrid& grid, PatchId id) {
    const std::span<const dvec3> polygon = grid.polygon_of(id);
    const dvec3& centroid_m = grid.patches[index(id)].centroid_m;
    const double area_m2 = grid.patches[index(id)].area_m2;
    AreaSamples samples;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec3 &a = centroid_m, &b = polygon[i], &c = polygon[(i + 1) % polygon.size()];
        const double share = 0.5 * glm::length(glm::cross(b - a, c - a)) / area_m2 / 4.0;
        const dvec3 middle = (a + b + c) / 3.0;
        for (const dvec3& p : {middle, 0.5 * (a + middle), 0.5 * (b + middle), 0.5 * (c + middle)}) {
            samples.positions_m.push_back(p);
            samples.shares.push_back(share);
        }
    }
    return samples;
}

}  // namespace naturel
