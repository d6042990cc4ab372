#include "core/convex_ring.h"

#include <cmath>
#include <glm/vec2.hpp>

namespace naturel {

namespace {

__extension__ typedef __int128 Wide;

glm::dvec2 from(const PlanePoint& origin, const PlanePoint& p) {
    return {static_cast<double>(p.X - origin.X), static_cast<double>(p.Y - origin.Y)};
}

}  // namespace

bool is_convex(const Ring& ring) {
    const std::size_t n = ring.size();
    if (n < 3) return false;
    for (std::size_t i = 0; i < n; ++i) {
        const PlanePoint &a = ring[i], &b = ring[(i + 1) % n], &c = ring[(i + 2) % n];
        if (Wide(b.X - a.X) * (c.Y - b.Y) - Wide(b.Y - a.Y) * (c.X - b.X) <= 0) return false;
    }
    return true;
}

Ring intersect_convex(const Ring& a, const Ring& b) {
    if (a.size() < 3 || b.size() < 3) return {};
    // Sutherland & Hodgman 1974, on coordinates relative to a corner: those of a face fit in a double exactly.
    const PlanePoint origin = a[0];
    std::vector<glm::dvec2> polygon, kept;
    for (const PlanePoint& p : a) polygon.push_back(from(origin, p));
    std::vector<double> depth_nm2;
    bool cut = false;
    for (std::size_t k = 0; k < b.size(); ++k) {
        const glm::dvec2 start = from(origin, b[k]), edge = from(b[k], b[(k + 1) % b.size()]);
        depth_nm2.clear();
        bool all_inside = true, none_inside = true;
        for (const glm::dvec2& p : polygon) {
            depth_nm2.push_back(edge.x * (p.y - start.y) - edge.y * (p.x - start.x));
            (depth_nm2.back() < 0.0 ? all_inside : none_inside) = false;
        }
        if (none_inside) return {};
        if (all_inside) continue;
        cut = true;
        kept.clear();
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const std::size_t j = (i + 1) % polygon.size();
            if (depth_nm2[i] >= 0.0) kept.push_back(polygon[i]);
            if ((depth_nm2[i] > 0.0 && depth_nm2[j] < 0.0) || (depth_nm2[i] < 0.0 && depth_nm2[j] > 0.0))
                kept.push_back(polygon[i] + depth_nm2[i] / (depth_nm2[i] - depth_nm2[j]) * (polygon[j] - polygon[i]));
        }
        polygon.swap(kept);
    }
    if (!cut) return a;
    Ring ring;
    for (const glm::dvec2& p : polygon) ring.push_back({origin.X + std::llround(p.x), origin.Y + std::llround(p.y)});
    return convex_hull(std::move(ring));  // rounding dents outlines by a nanometre
}

}  // namespace naturel
