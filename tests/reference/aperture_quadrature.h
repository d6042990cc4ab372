#pragma once
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "core/gauss_legendre.h"
#include "core/visibility.h"

namespace naturel::tests {

/// A parallelogram origin + s u + t v, its normal cross(u, v) towards the point that looks at it.
struct Parallelogram {
    glm::dvec3 origin_m{}, u_m{}, v_m{};
};

/// Illuminance, lx, by the area integral of luminance cos cos' / r^2 over a parallelogram: panels x panels tensor
/// products of 16 Gauss-Legendre nodes. Knows nothing of solid angles, and is accurate where the point is not closer to
/// the parallelogram than a panel is long and the luminance is smooth on a panel.
inline double illuminance_by_quadrature(const GatherPoint& point, const Parallelogram& opening, int panels,
                                        const std::function<double(const glm::dvec3&)>& luminance_cd_m2) {
    const QuadratureRule rule = gauss_legendre(16);
    const glm::dvec3 area = glm::cross(opening.u_m, opening.v_m) / static_cast<double>(panels * panels);
    double sum = 0.0;
    for (int j = 0; j < panels; ++j) {
        for (int i = 0; i < panels; ++i) {
            for (std::size_t b = 0; b < rule.nodes.size(); ++b) {
                for (std::size_t a = 0; a < rule.nodes.size(); ++a) {
                    const double s = (i + rule.nodes[a]) / panels, t = (j + rule.nodes[b]) / panels;
                    const glm::dvec3 ray = opening.origin_m + s * opening.u_m + t * opening.v_m - point.position_m;
                    const double r2 = glm::dot(ray, ray);
                    const double cos_point = glm::dot(point.normal, ray);
                    const double cos_opening = -glm::dot(area, ray);
                    if (cos_point <= 0.0) continue;
                    sum += rule.weights[a] * rule.weights[b] * luminance_cd_m2(ray / std::sqrt(r2)) * cos_point *
                           cos_opening / (r2 * r2);
                }
            }
        }
    }
    return sum;
}

}  // namespace naturel::tests
