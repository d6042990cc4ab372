#include "tests/reference/exact_form_factors.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "core/units.h"

namespace naturel::reference {
namespace {

/// sum over i, j, k, l in {0, 1} of (-1)^(i + j + k + l) term(a_i, b_j, c_k, d_l), index 0 being the low end.
template <class Term>
double alternating_sum(Interval a, Interval b, Interval c, Interval d, const Term& term) {
    double sum = 0.0;
    for (int corner = 0; corner < 16; ++corner) {
        const auto end = [&](Interval x, int bit) { return (corner >> bit) & 1 ? x.high : x.low; };
        const int ends = (corner & 1) + (corner >> 1 & 1) + (corner >> 2 & 1) + (corner >> 3 & 1);
        sum += (ends % 2 == 0 ? 1.0 : -1.0) * term(end(a, 0), end(b, 1), end(c, 2), end(d, 3));
    }
    return sum;
}

double area(Interval x, Interval y) {
    return (x.high - x.low) * (y.high - y.low);
}

/// Integral of ln |p - q| over q from a to b.
double log_distance_along(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
    const double length = glm::length(b - a);
    const glm::dvec3 u = (b - a) / length;
    const double along = glm::dot(p - a, u);
    const double aside = glm::length(p - a - along * u);
    const auto antiderivative = [&](double t) {
        const double square = t * t + aside * aside;
        return 0.5 * ((square > 0.0 ? t * std::log(square) : 0.0) - 2.0 * t +
                      (aside > 0.0 ? 2.0 * aside * std::atan(t / aside) : 0.0));
    };
    return antiderivative(length - along) - antiderivative(-along);
}

/// Integral of f over [0, 1] by the tanh-sinh rule (Takahasi & Mori 1974): step 1/16, ends at weights below
/// 1e-15.
template <class Function>
double integrate(const Function& f) {
    constexpr double step = 1.0 / 16.0;
    double sum = 0.0;
    for (int k = -52; k <= 52; ++k) {
        const double s = pi / 2 * std::sinh(step * k);
        const double weight = pi / 4 * std::cosh(step * k) / (std::cosh(s) * std::cosh(s));
        sum += weight * f(1.0 / (1.0 + std::exp(-2.0 * s)));
    }
    return step * sum;
}

}  // namespace

double parallel_rectangles(Interval x1, Interval y1, Interval x2, Interval y2, double distance) {
    const double z = distance;
    return alternating_sum(x1, y1, x2, y2,
                           [&](double x, double y, double xi, double eta) {
                               const double dx = x - xi;
                               const double dy = y - eta;
                               const double rx = std::sqrt(dx * dx + z * z);
                               const double ry = std::sqrt(dy * dy + z * z);
                               return dy * rx * std::atan(dy / rx) + dx * ry * std::atan(dx / ry) -
                                      z * z / 2 * std::log(dx * dx + dy * dy + z * z);
                           }) /
           (2 * pi * area(x1, y1));
}

double perpendicular_rectangles(Interval x1, Interval y1, Interval y2, Interval z2) {
    return alternating_sum(x1, y1, y2, z2,
                           [&](double x, double y, double eta, double xi) {
                               const double dy = y - eta;
                               const double c = x * x + xi * xi;
                               if (c + dy * dy == 0.0) return 0.0;
                               const double root = std::sqrt(c);
                               return (c > 0.0 ? dy * root * std::atan(dy / root) : 0.0) -
                                      (c - dy * dy) / 4 * std::log(c + dy * dy);
                           }) /
           (2 * pi * area(x1, y1));
}

double polygon_to_polygon(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to) {
    glm::dvec3 doubled_area{};
    for (std::size_t i = 1; i + 1 < from.size(); ++i)
        doubled_area += glm::cross(from[i] - from[0], from[i + 1] - from[0]);
    double sum = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i)
        for (std::size_t j = 0; j < to.size(); ++j) {
            const glm::dvec3 a = from[(i + 1) % from.size()] - from[i];
            const glm::dvec3& b0 = to[j];
            const glm::dvec3& b1 = to[(j + 1) % to.size()];
            const double cosine = glm::dot(a, b1 - b0) / glm::length(b1 - b0);
            if (cosine == 0.0) continue;
            sum += cosine * integrate([&](double t) { return log_distance_along(from[i] + t * a, b0, b1); });
        }
    return sum / (2 * pi * 0.5 * glm::length(doubled_area));
}

double point_to_polygon(const glm::dvec3& point, const glm::dvec3& normal,
                        std::span<const glm::dvec3> polygon) {
    double sum = 0.0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const glm::dvec3 a = glm::normalize(polygon[k] - point);
        const glm::dvec3 b = glm::normalize(polygon[(k + 1) % polygon.size()] - point);
        const glm::dvec3 across = glm::cross(a, b);
        const double sine = glm::length(across);
        if (sine > 0.0) sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(across / sine, normal);
    }
    return std::abs(sum) / (2 * pi);  // the sign is that of the sense of the polygon seen from the point
}

}  // namespace naturel::reference
