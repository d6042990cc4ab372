#include "core/planar_region.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

namespace naturel {

namespace {

using ClipperLib::ClipType;

// Corners that dent an outline by less than this are rounding of cuts at 1 nm, not reflex corners. A vertex of a cut is
// off by up to 0.71 nm, and a corner sees three of them.
constexpr double rounding_nm = 4.0;

// Rings narrower than this are left over by the same rounding.
constexpr double sliver_width_nm = 2.0;

Region combine(ClipType operation, const Region& a, const Region& b) {
    ClipperLib::Clipper clipper;
    clipper.AddPaths(a, ClipperLib::ptSubject, true);
    clipper.AddPaths(b, ClipperLib::ptClip, true);
    Region result;
    clipper.Execute(operation, result, ClipperLib::pftNonZero, ClipperLib::pftNonZero);
    return result;
}

double distance(const PlanePoint& a, const PlanePoint& b) {
    return std::hypot(static_cast<double>(b.X - a.X), static_cast<double>(b.Y - a.Y));
}

// Height of `corner` over the line from `before` to `after`, nm; negative where the outline turns right (reflex).
double corner_height(const PlanePoint& before, const PlanePoint& corner, const PlanePoint& after) {
    const double length = distance(before, after);
    const double cross = static_cast<double>(corner.X - before.X) * static_cast<double>(after.Y - corner.Y) -
                         static_cast<double>(corner.Y - before.Y) * static_cast<double>(after.X - corner.X);
    return length > 0.0 ? cross / length : 0.0;
}

// Twice the signed area of a triangle, exactly; positive when a, b, c turn left.
__extension__ typedef __int128 Wide;
Wide turn(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
    return Wide(b.X - a.X) * (c.Y - b.Y) - Wide(b.Y - a.Y) * (c.X - b.X);
}

bool properly_cross(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const PlanePoint& d) {
    const auto sign = [](Wide w) { return (w > 0) - (w < 0); };
    return sign(turn(a, b, c)) * sign(turn(a, b, d)) < 0 && sign(turn(c, d, a)) * sign(turn(c, d, b)) < 0;
}

// True when p lies on the segment from a to b, ends excluded.
bool lies_between(const PlanePoint& p, const PlanePoint& a, const PlanePoint& b) {
    if (p == a || p == b || turn(a, b, p) != 0) return false;
    return std::min(a.X, b.X) <= p.X && p.X <= std::max(a.X, b.X) && std::min(a.Y, b.Y) <= p.Y && p.Y <= std::max(a.Y, b.Y);
}

// Cuts one connected part (outer ring, holes) into convex rings whose corners are all corners of the part, so that
// nothing is gained or lost: holes are joined to the outline by bridges, the outline is cut into triangles by its ears,
// and triangles are joined again across diagonals where the result stays convex (Hertel & Mehlhorn 1983).
class ConvexDecomposition {
public:
    explicit ConvexDecomposition(const Region& part) {
        for (const Ring& ring : part) {
            std::vector<std::size_t> corners;
            for (const PlanePoint& p : ring) {
                corners.push_back(points_.size());
                points_.push_back(p);
            }
            if (outline_.empty()) {
                outline_ = std::move(corners);
            } else {
                holes_.push_back(std::move(corners));
            }
        }
    }

    std::vector<Ring> run() {
        join_holes();
        cut_ears();
        join_triangles();
        std::vector<Ring> result;
        for (const auto& polygon : polygons_) {
            if (polygon.empty()) continue;
            Ring ring;
            for (const std::size_t corner : polygon) ring.push_back(points_[corner]);
            result.push_back(std::move(ring));
        }
        return result;
    }

private:
    const PlanePoint& at(std::size_t corner) const { return points_[corner]; }

    // True when the direction from outline_[i] to p points into the outline.
    bool opens_towards(std::size_t i, const PlanePoint& p) const {
        const std::size_t n = outline_.size();
        const PlanePoint &before = at(outline_[(i + n - 1) % n]), &here = at(outline_[i]), &after = at(outline_[(i + 1) % n]);
        if (turn(before, here, after) >= 0) return turn(here, after, p) > 0 && turn(before, here, p) > 0;
        return turn(here, after, p) > 0 || turn(before, here, p) > 0;
    }

    bool blocked(const PlanePoint& a, const PlanePoint& b, const std::vector<std::size_t>& ring) const {
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const PlanePoint &c = at(ring[i]), &d = at(ring[(i + 1) % ring.size()]);
            if (properly_cross(a, b, c, d) || lies_between(c, a, b)) return true;
        }
        return false;
    }

    void join_holes() {
        // The hole that reaches furthest left sees the outline; joined to it, it becomes part of the outline.
        const auto leftmost = [&](auto& ring) {
            return std::min_element(ring.begin(), ring.end(), [&](std::size_t a, std::size_t b) {
                return at(a).X != at(b).X ? at(a).X < at(b).X : at(a).Y < at(b).Y;
            });
        };
        std::sort(holes_.begin(), holes_.end(), [&](const auto& a, const auto& b) {
            const PlanePoint &p = at(*leftmost(a)), &q = at(*leftmost(b));
            return p.X != q.X ? p.X < q.X : p.Y < q.Y;
        });
        for (std::size_t h = 0; h < holes_.size(); ++h) {
            std::vector<std::size_t>& hole = holes_[h];
            if (join_touching(hole)) continue;
            std::rotate(hole.begin(), leftmost(hole), hole.end());
            const PlanePoint from = at(hole[0]);
            std::vector<std::pair<double, std::size_t>> by_distance;
            for (std::size_t i = 0; i < outline_.size(); ++i) by_distance.emplace_back(distance(from, at(outline_[i])), i);
            std::sort(by_distance.begin(), by_distance.end());
            std::size_t bridge = by_distance.front().second;
            for (const auto& [length, i] : by_distance) {
                const PlanePoint to = at(outline_[i]);
                const bool open = opens_towards(i, from) && !blocked(from, to, outline_) &&
                                  std::none_of(holes_.begin() + static_cast<std::ptrdiff_t>(h), holes_.end(),
                                               [&](const auto& other) { return blocked(from, to, other); });
                if (open) {
                    bridge = i;
                    break;
                }
            }
            splice(hole, bridge);
        }
    }

    // Joins a hole that touches the outline in a corner: there the bridge has no length.
    bool join_touching(std::vector<std::size_t>& hole) {
        for (std::size_t k = 0; k < hole.size(); ++k) {
            for (std::size_t i = 0; i < outline_.size(); ++i) {
                if (!(at(outline_[i]) == at(hole[k])) || !opens_towards(i, at(hole[(k + 1) % hole.size()]))) continue;
                std::rotate(hole.begin(), hole.begin() + static_cast<std::ptrdiff_t>(k), hole.end());
                splice(hole, i);
                return true;
            }
        }
        return false;
    }

    // Walks round the hole when the outline comes past its corner `bridge`.
    void splice(const std::vector<std::size_t>& hole, std::size_t bridge) {
        std::vector<std::size_t> joined(outline_.begin(), outline_.begin() + static_cast<std::ptrdiff_t>(bridge) + 1);
        joined.insert(joined.end(), hole.begin(), hole.end());
        joined.push_back(hole[0]);
        joined.insert(joined.end(), outline_.begin() + static_cast<std::ptrdiff_t>(bridge), outline_.end());
        outline_ = std::move(joined);
    }

    bool is_ear(std::size_t i) const {
        const std::size_t n = outline_.size();
        const PlanePoint &a = at(outline_[(i + n - 1) % n]), &b = at(outline_[i]), &c = at(outline_[(i + 1) % n]);
        if (turn(a, b, c) <= 0) return false;
        for (std::size_t k = 0; k < n; ++k) {
            const PlanePoint& p = at(outline_[k]);
            // Where the outline touches itself at the tip, it may pass through the ear from there.
            if (p == b && (properly_cross(a, c, p, at(outline_[(k + 1) % n])) ||
                           properly_cross(a, c, p, at(outline_[(k + n - 1) % n]))))
                return false;
            if (p == a || p == b || p == c) continue;
            if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
        }
        return true;
    }

    void cut_ears() {
        std::size_t i = 0, tried = 0;
        while (outline_.size() >= 3) {
            const std::size_t n = outline_.size();
            i %= n;
            const std::size_t a = outline_[(i + n - 1) % n], b = outline_[i], c = outline_[(i + 1) % n];
            const Wide area = turn(at(a), at(b), at(c));
            // After a full round without an ear only rings that touch themselves are left: take any corner that turns left.
            const bool give_way = tried >= n && (area > 0 || tried >= 2 * n);
            if (area == 0) {
                outline_.erase(outline_.begin() + static_cast<std::ptrdiff_t>(i));  // takes nothing away
                tried = 0;
            } else if (give_way || is_ear(i)) {
                if (area > 0) polygons_.push_back({a, b, c});
                outline_.erase(outline_.begin() + static_cast<std::ptrdiff_t>(i));
                ++i;  // fans of thin triangles are avoided by not starting where the last ear was
                tried = 0;
            } else {
                ++i;
                ++tried;
            }
        }
    }

    void join_triangles() {
        std::map<std::pair<std::size_t, std::size_t>, std::size_t> owner;  // of directed edges
        std::vector<std::pair<double, std::pair<std::size_t, std::size_t>>> diagonals;
        for (std::size_t p = 0; p < polygons_.size(); ++p) {
            const auto& t = polygons_[p];
            for (std::size_t k = 0; k < 3; ++k) {
                const std::pair edge{t[k], t[(k + 1) % 3]};
                owner[edge] = p;
                if (owner.contains({edge.second, edge.first})) diagonals.emplace_back(-distance(at(edge.first), at(edge.second)), edge);
            }
        }
        std::sort(diagonals.begin(), diagonals.end());  // long diagonals first: leaves compact pieces
        for (const auto& [length, edge] : diagonals) {
            const auto [u, v] = edge;
            const std::size_t p = owner[{u, v}], q = owner[{v, u}];
            if (p == q) continue;
            // p reads u v ..., q reads v u ...
            auto first = polygons_[p], second = polygons_[q];
            std::rotate(first.begin(), std::find(first.begin(), first.end(), u), first.end());
            std::rotate(second.begin(), std::find(second.begin(), second.end(), v), second.end());
            if (first[1] != v || second[1] != u) continue;
            // At u the joined ring goes from first.back() over u to second[2]; at v from second.back() over v to first[2].
            const auto stays_convex = [&](std::size_t before, std::size_t corner, std::size_t after) {
                return corner_height(at(before), at(corner), at(after)) > -rounding_nm;
            };
            if (!stays_convex(first.back(), u, second[2]) || !stays_convex(second.back(), v, first[2])) continue;
            std::vector<std::size_t> joined(first.begin() + 1, first.end());         // v ... before u
            joined.insert(joined.end(), second.begin() + 1, second.end());           // u ... before v
            for (std::size_t k = 0; k < joined.size(); ++k) owner[{joined[k], joined[(k + 1) % joined.size()]}] = p;
            polygons_[p] = std::move(joined);
            polygons_[q].clear();
        }
    }

    std::vector<PlanePoint> points_;
    std::vector<std::size_t> outline_;             // corners as positions in points_
    std::vector<std::vector<std::size_t>> holes_;
    std::vector<std::vector<std::size_t>> polygons_;
};

// Cuts a part into the trapezoids between the heights of its corners. Many and thin, but right for any outline, also one
// that touches itself in several corners, where ears cannot be told apart by position.
std::vector<Ring> trapezoids(const Region& part) {
    std::vector<ClipperLib::cInt> heights;
    ClipperLib::cInt left = part[0][0].X, right = left;
    for (const Ring& ring : part) {
        for (const PlanePoint& p : ring) {
            heights.push_back(p.Y);
            left = std::min(left, p.X), right = std::max(right, p.X);
        }
    }
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
    std::vector<Ring> result;
    for (std::size_t i = 0; i + 1 < heights.size(); ++i) {
        const Ring strip{{left, heights[i]}, {right, heights[i]}, {right, heights[i + 1]}, {left, heights[i + 1]}};
        for (const Region& piece : connected_parts(intersect(part, {strip}))) {
            Ring hull = convex_hull(piece.front());
            if (!hull.empty()) result.push_back(std::move(hull));
        }
    }
    return result;
}

// Rounding to 1 nm leaves corners that should lie on an edge, or on another corner, beside it, on the wrong side as often as
// not; outlines then cross themselves by a nanometre. Makes such corners touch exactly.
Region welded(Region region) {
    std::vector<PlanePoint*> corners;
    for (Ring& ring : region)
        for (PlanePoint& p : ring) corners.push_back(&p);
    std::sort(corners.begin(), corners.end(), [](const PlanePoint* a, const PlanePoint* b) {
        return a->X != b->X ? a->X < b->X : a->Y < b->Y;
    });
    constexpr double reach_nm = sliver_width_nm;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        for (std::size_t j = i + 1; j < corners.size() && static_cast<double>(corners[j]->X - corners[i]->X) <= reach_nm; ++j)
            if (distance(*corners[i], *corners[j]) <= reach_nm) *corners[j] = *corners[i];
    }
    Region result;
    for (const Ring& ring : region) {
        Ring split;
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const PlanePoint &a = ring[i], &b = ring[(i + 1) % ring.size()];
            split.push_back(a);
            const double length = distance(a, b);
            if (length <= reach_nm) continue;
            const double ux = static_cast<double>(b.X - a.X) / length, uy = static_cast<double>(b.Y - a.Y) / length;
            std::vector<std::pair<double, PlanePoint>> on_edge;
            for (const Ring& other : region) {
                for (const PlanePoint& p : other) {
                    const auto px = static_cast<double>(p.X - a.X), py = static_cast<double>(p.Y - a.Y);
                    const double along = px * ux + py * uy;
                    if (std::abs(px * uy - py * ux) <= reach_nm && along > reach_nm && along < length - reach_nm)
                        on_edge.emplace_back(along, p);
                }
            }
            std::sort(on_edge.begin(), on_edge.end(), [](const auto& p, const auto& q) { return p.first < q.first; });
            for (const auto& [along, p] : on_edge)
                if (!(p == split.back())) split.push_back(p);
        }
        result.push_back(std::move(split));
    }
    return result;
}

bool is_sliver(const Ring& ring) {
    if (ring.size() < 3) return true;
    double outline = 0.0;
    for (std::size_t i = 0; i < ring.size(); ++i) outline += distance(ring[i], ring[(i + 1) % ring.size()]);
    return std::abs(area_m2(ring)) * nanometres_per_metre * nanometres_per_metre < 0.5 * sliver_width_nm * outline;
}

}  // namespace

PlanePoint PlaneFrame::to_plane(const glm::dvec3& point_m) const {
    const glm::dvec3 d = point_m - origin_m;
    return {std::llround(glm::dot(d, x) * nanometres_per_metre), std::llround(glm::dot(d, y) * nanometres_per_metre)};
}

glm::dvec3 PlaneFrame::to_world(const PlanePoint& point) const {
    return origin_m + static_cast<double>(point.X) / nanometres_per_metre * x +
           static_cast<double>(point.Y) / nanometres_per_metre * y;
}

PlaneFrame make_plane_frame(const glm::dvec3& origin_m, const glm::dvec3& normal) {
    // The axis least along the normal gives a well-conditioned x; walls get a horizontal one.
    const glm::dvec3 helper = std::abs(normal.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(helper, normal));
    return {origin_m, x, glm::cross(normal, x), normal};
}

Region unite(const Region& a, const Region& b) { return combine(ClipperLib::ctUnion, a, b); }
Region intersect(const Region& a, const Region& b) { return combine(ClipperLib::ctIntersection, a, b); }
Region subtract(const Region& a, const Region& b) { return combine(ClipperLib::ctDifference, a, b); }

Region offset(const Region& region, double distance_m) {
    ClipperLib::ClipperOffset tool;
    tool.AddPaths(region, ClipperLib::jtMiter, ClipperLib::etClosedPolygon);
    Region result;
    tool.Execute(result, distance_m * nanometres_per_metre);
    return result;
}

double area_m2(const Ring& ring) {
    // Relative to the first corner: the products of nanometre coordinates would lose digits far from the origin.
    double twice = 0.0;
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
        const auto ax = static_cast<double>(ring[i].X - ring[0].X), ay = static_cast<double>(ring[i].Y - ring[0].Y);
        const auto bx = static_cast<double>(ring[i + 1].X - ring[0].X);
        const auto by = static_cast<double>(ring[i + 1].Y - ring[0].Y);
        twice += ax * by - ay * bx;
    }
    return 0.5 * twice / (nanometres_per_metre * nanometres_per_metre);
}

double area_m2(const Region& region) {
    double sum = 0.0;
    for (const Ring& ring : region) sum += area_m2(ring);
    return sum;
}

bool contains(const Region& region, const PlanePoint& point) {
    int winding = 0;
    for (const Ring& ring : region) {
        const int inside = ClipperLib::PointInPolygon(point, ring);  // 0 outside, 1 inside, -1 on the outline
        if (inside < 0) return true;
        if (inside > 0) winding += ClipperLib::Orientation(ring) ? 1 : -1;
    }
    return winding > 0;
}

std::vector<Region> connected_parts(const Region& region) {
    ClipperLib::Clipper clipper;
    clipper.AddPaths(welded(region), ClipperLib::ptSubject, true);
    clipper.StrictlySimple(true);
    ClipperLib::PolyTree tree;
    clipper.Execute(ClipperLib::ctUnion, tree, ClipperLib::pftNonZero, ClipperLib::pftNonZero);
    std::vector<Region> parts;
    for (const ClipperLib::PolyNode* node = tree.GetFirst(); node != nullptr; node = node->GetNext()) {
        if (node->IsHole()) continue;
        Region part{node->Contour};
        for (const ClipperLib::PolyNode* hole : node->Childs) part.push_back(hole->Contour);
        parts.push_back(std::move(part));
    }
    return parts;
}

Ring convex_hull(Ring points) {
    std::sort(points.begin(), points.end(), [](const PlanePoint& a, const PlanePoint& b) {
        return a.X != b.X ? a.X < b.X : a.Y < b.Y;
    });
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (points.size() < 3) return {};
    const auto turns_left = [](const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
        return turn(a, b, c) > 0;
    };
    Ring hull;
    const auto add_chain = [&](auto first, auto last) {
        const std::size_t base = hull.size();
        for (auto p = first; p != last; ++p) {
            while (hull.size() >= base + 2 && !turns_left(hull[hull.size() - 2], hull.back(), *p)) hull.pop_back();
            hull.push_back(*p);
        }
        hull.pop_back();
    };
    add_chain(points.begin(), points.end());
    add_chain(points.rbegin(), points.rend());
    return hull.size() >= 3 ? hull : Ring{};
}

std::vector<Ring> convex_parts(const Region& region) {
    std::vector<Ring> convex;
    for (const Region& part : connected_parts(region)) {
        std::vector<Ring> rings = ConvexDecomposition(part).run();
        double covered_m2 = 0.0;
        for (const Ring& ring : rings) covered_m2 += area_m2(ring);
        if (std::abs(covered_m2 - area_m2(part)) > 1e-12 * covered_m2) rings = trapezoids(part);
        for (Ring& ring : rings)
            if (!is_sliver(ring)) convex.push_back(std::move(ring));
    }
    return convex;
}

Region without_slivers(const Region& region) {
    Region kept;
    for (const Ring& ring : region)
        if (!is_sliver(ring)) kept.push_back(ring);
    return kept;
}

}  // namespace naturel
