#include "core/spherical_polygon.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {

glm::dvec3 vector_solid_angle(std::span<const glm::dvec3> polygon) {
    glm::dvec3 sum{};
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3& a = polygon[i];
        const glm::dvec3& b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
        const glm::dvec3 plane_normal = glm::cross(b, a);  // inward: counter-clockwise seen from the origin
        const double sine = glm::length(plane_normal);     // x |a| |b|, as the cosine below
        if (sine > 0.0) sum += (std::atan2(sine, glm::dot(a, b)) / sine) * plane_normal;
    }
    return 0.5 * sum;
}

double solid_angle(std::span<const glm::dvec3> polygon) {
    double sum = 0.0;
    for (std::size_t i = 2; i < polygon.size(); ++i) {
        const glm::dvec3 a = glm::normalize(polygon[0]);
        const glm::dvec3 b = glm::normalize(polygon[i - 1]);
        const glm::dvec3 c = glm::normalize(polygon[i]);
        const double volume = glm::dot(c, glm::cross(b, a));
        sum += 2.0 * std::atan2(volume, 1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
    }
    return sum;
}

void keep_half_space(std::span<const glm::dvec3> polygon, const glm::dvec3& normal, std::vector<glm::dvec3>& kept) {
    kept.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3& a = polygon[i];
        const glm::dvec3& b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
        const double height_a = glm::dot(normal, a);
        const double height_b = glm::dot(normal, b);
        if (height_a >= 0.0) kept.push_back(a);
        if ((height_a > 0.0 && height_b < 0.0) || (height_a < 0.0 && height_b > 0.0)) {
            const double share = height_a / (height_a - height_b);
            kept.push_back((1.0 - share) * a + share * b);
        }
    }
    if (kept.size() < 3) kept.clear();
}

}  // namespace naturel
