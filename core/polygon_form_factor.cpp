#include "core/polygon_form_factor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "core/units.h"

namespace naturel {
namespace {

using glm::dvec3;

/// Lengths are in units of the distance of the polygons, so that logarithms are small. A vertex this close to a plane is on it.
constexpr double on_plane = 1e-10;

bool in_plane(const std::vector<dvec3>& polygon, const dvec3& point, const dvec3& normal) {
    return std::ranges::all_of(polygon, [&](const dvec3& v) { return std::abs(glm::dot(v - point, normal)) < on_plane; });
}

double radius(const std::vector<dvec3>& polygon) {
    double square = 0.0;
    for (const dvec3& v : polygon) square = std::max(square, glm::dot(v - polygon[0], v - polygon[0]));
    return std::sqrt(square);
}

/// The area integral by the rule of degree 2 on the triangles of both fans: for polygons so far from each other that the
/// outline integrals cancel. With both sizes below 0.02 of the distance it errs by less than 1e-6 of the value.
double exchange_of_dots(const std::vector<dvec3>& a, const dvec3& normal_a, const std::vector<dvec3>& b,
                        const dvec3& normal_b) {
    struct Dot {
        dvec3 place{};
        double area = 0.0;
    };
    const auto dots = [](const std::vector<dvec3>& polygon) {
        std::vector<Dot> all;
        for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
            const dvec3 &p = polygon[0], &q = polygon[k], &r = polygon[k + 1];
            const double area = glm::length(glm::cross(q - p, r - p)) / 6.0;
            all.insert(all.end(), {{(4.0 * p + q + r) / 6.0, area}, {(p + 4.0 * q + r) / 6.0, area}, {(p + q + 4.0 * r) / 6.0, area}});
        }
        return all;
    };
    const std::vector<Dot> dots_b = dots(b);
    double sum = 0.0;
    for (const Dot& p : dots(a))
        for (const Dot& q : dots_b) {
            const dvec3 way = q.place - p.place;
            const double square = glm::dot(way, way);
            sum += p.area * q.area * glm::dot(way, normal_a) * -glm::dot(way, normal_b) / (square * square);
        }
    return sum / pi;
}

/// A side of a polygon.
struct Side {
    dvec3 start{}, direction{};
    double length = 0.0;
};

std::vector<Side> sides(const std::vector<dvec3>& polygon) {
    std::vector<Side> all;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const dvec3 way = polygon[(k + 1) % polygon.size()] - polygon[k];
        const double length = glm::length(way);
        if (length > 0.0) all.push_back({polygon[k], way / length, length});
    }
    return all;
}

/// Integral of ln r along a side, r the distance from a point: in closed form.
double log_distance_along(const dvec3& point, const Side& side) {
    const double along = glm::dot(point - side.start, side.direction);
    const double aside_2 = std::max(0.0, glm::dot(point - side.start, point - side.start) - along * along);
    const double aside = std::sqrt(aside_2);
    const auto antiderivative = [&](double t) {
        const double square = t * t + aside_2;
        return (square > 0.0 ? 0.5 * t * std::log(square) : 0.0) - t + (aside > 0.0 ? aside * std::atan(t / aside) : 0.0);
    };
    return antiderivative(side.length - along) - antiderivative(-along);
}

/// Integral of ln r over both of two parallel sides, in closed form: with x the distance along them and h across, the
/// function whose second derivative is ln(x^2 + h^2) / 2, at the four ends.
double log_distance_between_parallels(const Side& a, const Side& b, double cosine) {
    const dvec3 way = b.start - a.start;
    const double offset = glm::dot(way, a.direction);
    const double h_2 = std::max(0.0, glm::dot(way, way) - offset * offset);
    const double h = std::sqrt(h_2);
    const auto second_antiderivative = [&](double x) {
        const double square = x * x + h_2;
        return (square > 0.0 ? 0.25 * (x * x - h_2) * std::log(square) : 0.0) - 0.75 * x * x +
               (h > 0.0 ? h * x * std::atan(x / h) : 0.0);
    };
    // Ends of b along a.
    const double b0 = offset, b1 = offset + (cosine > 0.0 ? b.length : -b.length);
    const double sum = second_antiderivative(b1) - second_antiderivative(b0) - second_antiderivative(b1 - a.length) +
                       second_antiderivative(b0 - a.length);
    return cosine > 0.0 ? sum : -sum;
}

double distance_to(const Side& side, const dvec3& point) {
    const double along = std::clamp(glm::dot(point - side.start, side.direction), 0.0, side.length);
    return glm::distance(point, side.start + along * side.direction);
}

/// The same over skew sides: one integral in closed form, the other by Gauss-Legendre on pieces of `a` that are no longer than
/// their middle is far from `b`. The nearest singularity of the integrand is then a piece's length away: 10 nodes err by 1e-12.
/// Pieces at a crossing end at 1e-5 of the side, where the integrand is finite.
double log_distance_between(const Side& a, double from, double to, double shortest, const Side& b) {
    static constexpr std::array<double, 5> node{0.1488743389816312, 0.4333953941292472, 0.6794095682990244,
                                                0.8650633666889845, 0.9739065285171717};
    static constexpr std::array<double, 5> weight{0.2955242247147529, 0.2692667193099963, 0.2190863625159820,
                                                  0.1494513491505806, 0.0666713443086881};
    const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
    if (half > shortest && distance_to(b, a.start + middle * a.direction) < 3.0 * half)
        return log_distance_between(a, from, middle, shortest, b) + log_distance_between(a, middle, to, shortest, b);
    double sum = 0.0;
    for (std::size_t k = 0; k < node.size(); ++k)
        sum += weight[k] * (log_distance_along(a.start + (middle + half * node[k]) * a.direction, b) +
                            log_distance_along(a.start + (middle - half * node[k]) * a.direction, b));
    return half * sum;
}

}  // namespace

void keep_front(std::span<const dvec3> polygon, const dvec3& normal, double plane_m, double on_plane_m, std::vector<dvec3>& kept) {
    const auto height = [&](const dvec3& v) {
        const double h = glm::dot(normal, v) - plane_m;
        return std::abs(h) < on_plane_m ? 0.0 : h;
    };
    kept.clear();
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const dvec3 &from = polygon[k], &to = polygon[(k + 1) % polygon.size()];
        const double h0 = height(from), h1 = height(to);
        if (h0 >= 0.0) kept.push_back(from);
        if (h0 * h1 < 0.0) kept.push_back(from + (h0 / (h0 - h1)) * (to - from));
    }
    if (kept.size() < 3) kept.clear();
}

double unoccluded_exchange_m2(std::span<const dvec3> a, const dvec3& normal_a, std::span<const dvec3> b,
                              const dvec3& normal_b) {
    dvec3 middle_a{}, middle_b{};
    for (const dvec3& v : a) middle_a += v / static_cast<double>(a.size());
    for (const dvec3& v : b) middle_b += v / static_cast<double>(b.size());
    const double unit_m = glm::distance(middle_a, middle_b);
    if (unit_m == 0.0) return 0.0;
    const auto in_units = [&](std::span<const dvec3> polygon) {
        std::vector<dvec3> scaled;
        for (const dvec3& v : polygon) scaled.push_back((v - middle_a) / unit_m);
        return scaled;
    };
    const std::vector<dvec3> whole_a = in_units(a), whole_b = in_units(b);
    const dvec3 on_a = whole_a[0], on_b = whole_b[0];
    std::vector<dvec3> p, q;
    keep_front(whole_a, normal_b, glm::dot(normal_b, on_b), on_plane, p);
    keep_front(whole_b, normal_a, glm::dot(normal_a, on_a), on_plane, q);
    if (in_plane(p, on_b, normal_b) || in_plane(q, on_a, normal_a)) return 0.0;
    if (radius(p) < 0.02 && radius(q) < 0.02) return std::max(0.0, exchange_of_dots(p, normal_a, q, normal_b)) * unit_m * unit_m;

    // A F = 1 / (2 pi) closed integral over both outlines of ln r dr_a . dr_b (docs/method.md).
    const std::vector<Side> sides_a = sides(p), sides_b = sides(q);
    double sum = 0.0;
    for (const Side& side_a : sides_a)
        for (const Side& side_b : sides_b) {
            const double cosine = glm::dot(side_a.direction, side_b.direction);
            if (std::abs(cosine) < 1e-15) continue;
            constexpr double parallel = 1e-9;  // sine: moves an end by 1e-9 of a side
            if (glm::length(glm::cross(side_a.direction, side_b.direction)) < parallel)
                sum += cosine * log_distance_between_parallels(side_a, side_b, cosine);
            else
                sum += cosine * log_distance_between(side_a, 0.0, side_a.length, 1e-5 * side_a.length, side_b);
        }
    return std::max(0.0, sum / (2.0 * pi)) * unit_m * unit_m;
}

}  // namespace naturel
