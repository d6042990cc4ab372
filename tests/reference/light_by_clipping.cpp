#include "tests/reference/light_by_clipping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/planar_region.h"
#include "core/spherical_polygon.h"

namespace naturel::tests {
namespace {

using glm::dvec3;

/// Radon's rule of degree 5 with seven points (Stroud 1971, T2 5-1): barycentric coordinates and weights.
struct RulePoint {
    double a, b, c, weight;
};
const std::array<RulePoint, 7> radon = [] {
    const double root = std::sqrt(15.0);
    const double p = (6 - root) / 21, q = (6 + root) / 21;
    const double wp = (155 - root) / 1200, wq = (155 + root) / 1200;
    return std::array<RulePoint, 7>{{{1.0 / 3, 1.0 / 3, 1.0 / 3, 9.0 / 40},
                                     {p, p, 1 - 2 * p, wp},
                                     {p, 1 - 2 * p, p, wp},
                                     {1 - 2 * p, p, p, wp},
                                     {q, q, 1 - 2 * q, wq},
                                     {q, 1 - 2 * q, q, wq},
                                     {1 - 2 * q, q, q, wq}}};
}();

class SphericalIntegral {
public:
    SphericalIntegral(const dvec3& normal, const LuminanceOf& luminance) : normal_(normal), luminance_(luminance) {}

    double over(const std::vector<dvec3>& polygon, double scale) const {
        double sum = 0.0;
        for (std::size_t k = 2; k < polygon.size(); ++k) {
            sum += large(glm::normalize(polygon[0]), glm::normalize(polygon[k - 1]), glm::normalize(polygon[k]), scale, 0);
        }
        return sum;
    }

private:
    /// Halves triangles whose sides are long, until the rule makes sense on them.
    double large(const dvec3& a, const dvec3& b, const dvec3& c, double scale, int depth) const {
        const double ab = glm::length(b - a), bc = glm::length(c - b), ca = glm::length(a - c);
        if (std::max({ab, bc, ca}) < 0.3 || depth > 24) return fine(a, b, c, rule(a, b, c), scale, 0);
        if (ab >= bc && ab >= ca) {
            const dvec3 m = glm::normalize(a + b);
            return large(a, m, c, scale, depth + 1) + large(m, b, c, scale, depth + 1);
        }
        return bc >= ca ? large(b, c, a, scale, depth) : large(c, a, b, scale, depth);
    }

    double fine(const dvec3& a, const dvec3& b, const dvec3& c, double whole, double scale, int depth) const {
        const dvec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
        const std::array<double, 4> parts{rule(a, ab, ca), rule(ab, b, bc), rule(ca, bc, c), rule(ab, bc, ca)};
        const double sum = parts[0] + parts[1] + parts[2] + parts[3];
        if (std::abs(sum - whole) <= 1e-9 * scale || depth > 9) return sum;
        return fine(a, ab, ca, parts[0], scale, depth + 1) + fine(ab, b, bc, parts[1], scale, depth + 1) +
               fine(ca, bc, c, parts[2], scale, depth + 1) + fine(ab, bc, ca, parts[3], scale, depth + 1);
    }

    double rule(const dvec3& a, const dvec3& b, const dvec3& c) const {
        const double volume = std::abs(glm::dot(a, glm::cross(b, c)));
        double sum = 0.0;
        for (const RulePoint& p : radon) {
            const dvec3 place = p.a * a + p.b * b + p.c * c;
            const double length = glm::length(place);
            const dvec3 direction = place / length;
            sum += p.weight * luminance_(direction) * std::max(0.0, glm::dot(normal_, direction)) /
                   (length * length * length);
        }
        return 0.5 * volume * sum;
    }

    const dvec3& normal_;
    const LuminanceOf& luminance_;
};

Ring ring_of(const PlaneFrame& plane, const std::vector<dvec3>& outline_m) {
    Ring ring;
    for (const dvec3& vertex : outline_m) ring.push_back(plane.to_plane(vertex));
    return ring;
}

/// The shadow of a convex polygon on the plane of the opening, seen from the point; empty where it misses the opening.
Region shadow_of(const std::vector<dvec3>& outline_m, const dvec3& from_m, const PlaneFrame& plane,
                 const std::vector<dvec3>& frame_m, double height_m) {
    std::vector<dvec3> left, kept;
    for (const dvec3& vertex : outline_m) left.push_back(vertex - from_m);
    // The pyramid over a rectangle around the opening keeps projections finite. Nothing nearer than a micrometre.
    for (std::size_t k = 0; k < frame_m.size() && !left.empty(); ++k) {
        const dvec3 side = glm::cross(frame_m[(k + 1) % frame_m.size()] - from_m, frame_m[k] - from_m);
        keep_half_space(left, side, kept);
        std::swap(left, kept);
    }
    Ring ring;
    for (const dvec3& vertex : left) {
        const double depth = -glm::dot(plane.normal, vertex);
        if (depth < 1e-6) return {};
        ring.push_back(plane.to_plane(from_m + (height_m / depth) * vertex));
    }
    if (ring.size() < 3) return {};
    if (area_m2(ring) < 0.0) std::reverse(ring.begin(), ring.end());
    return {ring};
}

}  // namespace

double illuminance_by_clipping(const GatherPoint& point, const PlaneOpening& opening,
                               const std::vector<Blocker>& blockers, const LuminanceOf& behind) {
    const std::vector<dvec3>& outline = opening.outline_m;
    dvec3 area{};
    for (std::size_t k = 2; k < outline.size(); ++k)
        area += glm::cross(outline[k - 1] - outline[0], outline[k] - outline[0]);
    const PlaneFrame plane = make_plane_frame(outline[0], glm::normalize(area));
    const double height_m = glm::dot(plane.normal, point.position_m - outline[0]);
    if (height_m <= 0.0) return 0.0;

    Region open{ring_of(plane, outline)};
    for (const auto& hole : opening.holes_m) open = subtract(open, {ring_of(plane, hole)});
    // A rectangle around it, counter-clockwise.
    double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
    for (const dvec3& vertex : outline) {
        const double x = glm::dot(plane.x, vertex - outline[0]), y = glm::dot(plane.y, vertex - outline[0]);
        x0 = std::min(x0, x - 0.01), x1 = std::max(x1, x + 0.01), y0 = std::min(y0, y - 0.01), y1 = std::max(y1, y + 0.01);
    }
    std::vector<dvec3> frame;
    for (const auto& [x, y] : {std::pair{x0, y0}, std::pair{x1, y0}, std::pair{x1, y1}, std::pair{x0, y1}})
        frame.push_back(outline[0] + x * plane.x + y * plane.y);

    double sum = 0.0;
    const auto add = [&](const Region& region, const LuminanceOf& luminance) {
        const SphericalIntegral integral(point.normal, luminance);
        for (const Ring& ring : convex_parts(region)) {
            std::vector<dvec3> polygon, front, half;
            for (const PlanePoint& vertex : ring) polygon.push_back(plane.to_world(vertex) - point.position_m);
            keep_half_space(polygon, point.normal, front);
            for (const double up : {1.0, -1.0}) {
                keep_half_space(front, {0, 0, up}, half);
                if (half.empty()) continue;
                const double projected_sr = glm::dot(point.normal, vector_solid_angle(half));
                if (projected_sr > 0.0) {
                    const double scale = projected_sr * std::max(1e-12, luminance(glm::normalize(vector_solid_angle(half))));
                    sum += integral.over(half, scale);
                }
            }
        }
    };
    for (const Blocker& blocker : blockers) {
        const Region shadow = shadow_of(blocker.outline_m, point.position_m, plane, frame, height_m);
        if (shadow.empty()) continue;
        if (blocker.luminance_cd_m2) add(intersect(open, shadow), blocker.luminance_cd_m2);
        open = subtract(open, shadow);
    }
    add(open, behind);
    return sum;
}

}  // namespace naturel::tests
