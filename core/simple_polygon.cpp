#include "core/simple_polygon.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "core/planar_region.h"

namespace naturel {
namespace {

using glm::dvec2;
using glm::dvec3;

/// Closer than this, points and edges count as touching: a thousand units of the plane coordinates (1 nm).
constexpr double touch_m = 1e-6;

/// Twice the vector area (Newell); taken from the first vertex so that far polygons lose no digits.
dvec3 newell_normal(const std::vector<dvec3>& ring) {
    dvec3 sum{};
    for (std::size_t i = 1; i + 1 < ring.size(); ++i)
        sum += glm::cross(ring[i] - ring[0], ring[i + 1] - ring[0]);
    return sum;
}

double size_m(const std::vector<dvec3>& ring) {
    dvec3 low = ring[0], high = ring[0];
    for (const dvec3& p : ring)
        low = glm::min(low, p), high = glm::max(high, p);
    return glm::length(high - low);
}

/// An edge in the plane, with its ring (0 = outline, k + 1 = hole k) and its number in that ring.
struct Edge {
    dvec2 a, b;
    std::size_t ring, number;
};

double cross(const dvec2& a, const dvec2& b) {
    return a.x * b.y - a.y * b.x;
}

double distance_to_segment(const dvec2& p, const dvec2& a, const dvec2& b) {
    const dvec2 ab = b - a;
    const double t = std::clamp(glm::dot(p - a, ab) / glm::dot(ab, ab), 0.0, 1.0);
    return glm::length(p - (a + t * ab));
}

bool boxes_apart(const Edge& e, const Edge& f) {
    const dvec2 e_low = glm::min(e.a, e.b) - touch_m, e_high = glm::max(e.a, e.b) + touch_m;
    const dvec2 f_low = glm::min(f.a, f.b), f_high = glm::max(f.a, f.b);
    return e_high.x < f_low.x || f_high.x < e_low.x || e_high.y < f_low.y || f_high.y < e_low.y;
}

bool cross_or_touch(const Edge& e, const Edge& f) {
    if (boxes_apart(e, f)) return false;
    const bool f_straddles_e = (cross(e.b - e.a, f.a - e.a) > 0) != (cross(e.b - e.a, f.b - e.a) > 0);
    const bool e_straddles_f = (cross(f.b - f.a, e.a - f.a) > 0) != (cross(f.b - f.a, e.b - f.a) > 0);
    return (f_straddles_e && e_straddles_f) || distance_to_segment(e.a, f.a, f.b) < touch_m ||
           distance_to_segment(e.b, f.a, f.b) < touch_m || distance_to_segment(f.a, e.a, e.b) < touch_m ||
           distance_to_segment(f.b, e.a, e.b) < touch_m;
}

/// Neighbours share a corner; they are at fault only if one folds back onto the other.
bool folds_back(const Edge& e, const Edge& next) {
    return distance_to_segment(next.b, e.a, e.b) < touch_m ||
           distance_to_segment(e.a, next.a, next.b) < touch_m;
}

/// Even-odd rule; the point is not on the ring.
bool is_inside(const dvec2& p, const std::vector<dvec2>& ring) {
    bool inside = false;
    for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
        const dvec2& a = ring[i];
        const dvec2& b = ring[j];
        if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y))
            inside = !inside;
    }
    return inside;
}

std::optional<std::size_t> hole_of(std::size_t ring) {
    return ring == 0 ? std::nullopt : std::optional<std::size_t>(ring - 1);
}

std::optional<std::string> find_corner_fault(const std::vector<dvec3>& ring) {
    if (ring.size() < 3) {
        return fmt::format("it has {} {} (a polygon needs at least 3)", ring.size(),
                           ring.size() == 1 ? "vertex" : "vertices");
    }
    if (glm::length(ring.back() - ring.front()) < touch_m) {
        return "the last vertex repeats the first (leave it out: outlines close by themselves)";
    }
    for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
        if (glm::length(ring[i + 1] - ring[i]) < touch_m) {
            return fmt::format("vertices {} and {} coincide (give each corner once)", i, i + 1);
        }
    }
    return std::nullopt;
}

std::optional<PolygonFault> find_crossing(const std::vector<std::vector<dvec2>>& rings) {
    std::vector<Edge> edges;
    for (std::size_t r = 0; r < rings.size(); ++r) {
        for (std::size_t i = 0; i < rings[r].size(); ++i) {
            edges.push_back({rings[r][i], rings[r][(i + 1) % rings[r].size()], r, i});
        }
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
        for (std::size_t j = i + 1; j < edges.size(); ++j) {
            const Edge& e = edges[i];
            const Edge& f = edges[j];
            if (e.ring != f.ring) {
                if (!cross_or_touch(e, f)) continue;
                if (e.ring == 0)
                    return PolygonFault{hole_of(f.ring),
                                        "the hole crosses or touches the outline (it must lie inside)"};
                return PolygonFault{
                    hole_of(f.ring),
                    fmt::format("the hole overlaps hole {} (holes must lie apart)", e.ring - 1)};
            }
            const std::size_t last = rings[e.ring].size() - 1;
            const bool e_first = f.number == e.number + 1, f_first = e.number == 0 && f.number == last;
            bool fault = false;
            if (e_first) fault = folds_back(e, f);
            if (f_first) fault = fault || folds_back(f, e);
            if (!e_first && !f_first) fault = cross_or_touch(e, f);
            if (fault) {
                return PolygonFault{
                    hole_of(e.ring),
                    fmt::format(
                        "the edges from vertices {} and {} cross or touch (an outline must not meet itself)",
                        e.number, f.number)};
            }
        }
    }
    return std::nullopt;
}

}  // namespace

double polygon_area_m2(const std::vector<dvec3>& vertices_m) {
    return 0.5 * glm::length(newell_normal(vertices_m));
}

std::optional<PolygonFault> find_polygon_fault(const std::vector<dvec3>& vertices_m,
                                               const std::vector<std::vector<dvec3>>& holes_m) {
    std::vector<const std::vector<dvec3>*> rings{&vertices_m};
    for (const auto& hole : holes_m)
        rings.push_back(&hole);

    std::size_t vertex_count = 0;
    for (std::size_t r = 0; r < rings.size(); ++r) {
        vertex_count += rings[r]->size();
        if (auto text = find_corner_fault(*rings[r])) return PolygonFault{hole_of(r), *text};
    }
    if (vertex_count > max_polygon_vertices) {
        return PolygonFault{std::nullopt,
                            fmt::format("it has {} vertices with the holes (at most {}: divide the polygon)",
                                        vertex_count, max_polygon_vertices)};
    }
    for (std::size_t r = 0; r < rings.size(); ++r) {
        if (glm::length(newell_normal(*rings[r])) < touch_m * touch_m) {
            return PolygonFault{
                hole_of(r),
                "it has no area: its vertices lie on one line or its edges cross (give the corners in order "
                "around the outline)"};
        }
    }

    const dvec3 normal = glm::normalize(newell_normal(vertices_m));
    dvec3 centre{};
    for (const dvec3& p : vertices_m)
        centre += (p - vertices_m[0]) / static_cast<double>(vertices_m.size());
    centre += vertices_m[0];
    const double tolerance_m = 1e-6 * std::max(1.0, size_m(vertices_m));
    const PlaneFrame plane = make_plane_frame(centre, normal);
    std::vector<std::vector<dvec2>> flat(rings.size());
    for (std::size_t r = 0; r < rings.size(); ++r) {
        for (std::size_t i = 0; i < rings[r]->size(); ++i) {
            const dvec3 p = (*rings[r])[i] - centre;
            if (const double off_m = std::abs(glm::dot(p, normal)); off_m > tolerance_m) {
                return PolygonFault{
                    hole_of(r),
                    fmt::format("vertex {} lies {:.3g} m off the plane of the outline (at most {:.3g} m)", i,
                                off_m, tolerance_m)};
            }
            flat[r].push_back({glm::dot(p, plane.x), glm::dot(p, plane.y)});
        }
    }

    if (auto fault = find_crossing(flat)) return fault;
    for (std::size_t r = 1; r < flat.size(); ++r) {
        if (!is_inside(flat[r][0], flat[0]))
            return PolygonFault{hole_of(r), "the hole lies outside the outline (it must lie inside)"};
        for (std::size_t q = 1; q < r; ++q) {
            if (is_inside(flat[r][0], flat[q]) || is_inside(flat[q][0], flat[r])) {
                return PolygonFault{hole_of(r),
                                    fmt::format("the hole overlaps hole {} (holes must lie apart)", q - 1)};
            }
        }
    }
    return std::nullopt;
}

}  // namespace naturel
