#include "core/umbra.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <set>
#include <span>

#include "core/convex_ring.h"
#include "core/parallel.h"
#include "core/plane_bounds.h"

namespace naturel {

namespace {

using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

// An occluder is cut this share of the height below the point that looks, so that its shadow stays finite. What is cut off
// hides only directions within 1e-6 of the horizontal: the zone gets a millionth narrower there, never wider.
constexpr double below_viewpoint = 1e-6;

// Smaller islands of umbra than a square centimetre are not worth a zone.
constexpr double smallest_zone_m2 = 1e-4;

// The part of a convex polygon with height_of(vertex) in [low, high].
template <class Height>
std::vector<dvec3> slab(std::vector<dvec3> polygon, const Height& height_of, double low, double high) {
    for (const double sign : {1.0, -1.0}) {
        const double limit = sign > 0.0 ? low : -high;
        std::vector<dvec3> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const dvec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
            const double ha = sign * height_of(a) - limit, hb = sign * height_of(b) - limit;
            if (ha >= 0.0) kept.push_back(a);
            if (ha * hb < 0.0) kept.push_back(a + ha / (ha - hb) * (b - a));
        }
        polygon = std::move(kept);
    }
    return polygon;
}

// The two halves of a convex polygon, cut across its longest edge: pieces that are as wide as the whole, as a cut across the
// diagonal leaves them, are rarely hidden by one body.
std::array<std::vector<dvec3>, 2> halves(const std::vector<dvec3>& polygon) {
    dvec3 direction{};
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const dvec3 edge = polygon[(k + 1) % polygon.size()] - polygon[k];
        if (glm::dot(edge, edge) > glm::dot(direction, direction)) direction = edge;
    }
    double low = infinity, high = -infinity;
    const auto position_of = [&](const dvec3& p) { return glm::dot(p - polygon[0], direction); };
    for (const dvec3& p : polygon) low = std::min(low, position_of(p)), high = std::max(high, position_of(p));
    const double middle = 0.5 * (low + high);
    return {slab(polygon, position_of, low, middle), slab(polygon, position_of, middle, high)};
}

double height(const HalfSpace& plane, const dvec3& point_m) { return glm::dot(plane.normal, point_m) - plane.offset_m; }

// The convex hull of a part of a face and a window: only what reaches into it can hide one from the other.
class Shaft {
public:
    Shaft(const std::vector<dvec3>& base_m, const std::vector<dvec3>& window_m, const dvec3& face_normal, const dvec3& window_normal) {
        for (const auto* polygon : {&base_m, &window_m})
            for (const dvec3& p : *polygon) low_m_ = min(low_m_, p), high_m_ = max(high_m_, p);
        planes_.push_back({-face_normal, -glm::dot(face_normal, base_m[0])});
        planes_.push_back({-window_normal, -glm::dot(window_normal, window_m[0])});
        add_planes(base_m, window_m);
        add_planes(window_m, base_m);
    }

    bool holds_part_of(const Occluder& occluder) const {
        for (int k = 0; k < 3; ++k)
            if (occluder.solid.low_m[k] > high_m_[k] || occluder.solid.high_m[k] < low_m_[k]) return false;
        return std::none_of(planes_.begin(), planes_.end(), [&](const HalfSpace& plane) {
            return std::all_of(occluder.corners_m.begin(), occluder.corners_m.end(),
                               [&](const dvec3& v) { return height(plane, v) > -thinnest_m; });
        });
    }

private:
    // The planes through an edge of one polygon and a corner of the other that have both polygons on the same side.
    void add_planes(const std::vector<dvec3>& edges_of, const std::vector<dvec3>& corners_of) {
        for (std::size_t i = 0; i < edges_of.size(); ++i) {
            const dvec3 &a = edges_of[i], &b = edges_of[(i + 1) % edges_of.size()];
            for (const dvec3& corner : corners_of) {
                const dvec3 across = glm::cross(b - a, corner - a);
                const double length = glm::length(across);
                if (length < thinnest_m * thinnest_m) continue;
                for (const dvec3& normal : {across / length, -across / length}) {
                    const HalfSpace plane{normal, glm::dot(normal, a)};
                    const auto inside = [&](const dvec3& p) { return height(plane, p) < thinnest_m; };
                    if (!std::all_of(edges_of.begin(), edges_of.end(), inside) ||
                        !std::all_of(corners_of.begin(), corners_of.end(), inside))
                        continue;
                    planes_.push_back(plane);
                    break;
                }
            }
        }
    }

    dvec3 low_m_{infinity}, high_m_{-infinity};
    std::vector<HalfSpace> planes_;
};

// Where outlines run along each other within nanometres, booleans leave strands between them, and the next booleans cut
// the strands into more. Corners and rings that are this thin are dropped.
constexpr double strand_nm = 20.0;

// Without strands, holes and islands smaller than smallest_m2 each.
Region without_crumbs(Region region, double smallest_m2) {
    std::erase_if(region, [&](const Ring& ring) { return std::abs(area_m2(ring)) < smallest_m2; });
    ClipperLib::CleanPolygons(region, strand_nm);
    std::erase_if(region, [](const Ring& ring) { return ring.size() < 3; });
    return region;
}

// Without strands, nor islands smaller than smallest_m2; keeps the holes of what is left.
Region tidied(Region region, double smallest_m2) {
    bool holes = false, dropped = false;
    ClipperLib::CleanPolygons(region, strand_nm);
    std::erase_if(region, [&](const Ring& ring) {
        if (ring.size() < 3) return true;
        const double area = area_m2(ring);
        if (area < 0.0) {
            double outline = 0.0;
            for (std::size_t i = 0; i < ring.size(); ++i) {
                const PlanePoint &a = ring[i], &b = ring[(i + 1) % ring.size()];
                outline += std::hypot(static_cast<double>(b.X - a.X), static_cast<double>(b.Y - a.Y)) / nanometres_per_metre;
            }
            if (-area < 0.5 * strand_nm / nanometres_per_metre * outline) return true;
            holes = true;
            return false;
        }
        dropped = dropped || area < smallest_m2;
        return area < smallest_m2;
    });
    // A hole whose island is gone would count as an island itself.
    if (holes && dropped) ClipperLib::SimplifyPolygons(region, ClipperLib::pftPositive);
    return region;
}

struct Shadow {
    enum class Cover { none, part, all } cover = Cover::none;  // of the place that was asked for
    const Ring* outline = nullptr;                             // convex; where cover is `part`
};

Shadow cover(const Ring& convex, const PlaneBounds& place) {
    if (convex.empty()) return {};
    const std::array<PlanePoint, 4> corners{PlanePoint{place.left, place.bottom}, {place.right, place.bottom},
                                            {place.right, place.top}, {place.left, place.top}};
    bool all = true;
    for (std::size_t i = 0; i < convex.size(); ++i) {
        const PlanePoint &a = convex[i], &b = convex[(i + 1) % convex.size()];
        const double x = static_cast<double>(b.X - a.X), y = static_cast<double>(b.Y - a.Y);
        bool all_outside = true;
        for (const PlanePoint& p : corners) {
            const bool inside = x * static_cast<double>(p.Y - a.Y) - y * static_cast<double>(p.X - a.X) > 0.0;
            all = all && inside;
            all_outside = all_outside && !inside;
        }
        if (all_outside) return {};
    }
    return all ? Shadow{Shadow::Cover::all} : Shadow{Shadow::Cover::part, &convex};
}

// What convex rings cover of a region.
Region common(const Region& region, const Region& rings) {
    if (rings.empty() || region.empty()) return {};
    if (rings.size() > 1 || region.size() > 1 || !is_convex(region[0])) return intersect(region, rings);
    Ring ring = intersect_convex(region[0], rings[0]);
    return ring.empty() ? Region{} : Region{std::move(ring)};
}

// What occluders hide from the plane of one face.
class FaceView {
public:
    explicit FaceView(const Face& face) : face_(face) {
        for (const dvec3& corner : rectangle(PlaneBounds(face.region))) low_m_ = min(low_m_, corner), high_m_ = max(high_m_, corner);
    }

    const dvec3& normal() const { return face_.normal; }
    double height_of(const dvec3& point_m) const { return glm::dot(point_m - face_.plane.origin_m, face_.normal); }

    std::vector<dvec3> rectangle(const PlaneBounds& bounds) const {
        return {face_.plane.to_world({bounds.left, bounds.bottom}), face_.plane.to_world({bounds.right, bounds.bottom}),
                face_.plane.to_world({bounds.right, bounds.top}), face_.plane.to_world({bounds.left, bounds.top})};
    }

    // What an occluder hides of the plane of the face from a viewpoint, convex: corners of its outline, and others.
    Ring shadow(const Occluder& occluder, const dvec3& viewpoint_m) const {
        const std::vector<ConvexSolid::Side>& sides = occluder.solid.sides;
        const auto height_over = [&](const ConvexSolid::Side& side) { return height(side.plane, viewpoint_m); };
        if (sides.size() == 1) {
            if (std::abs(height_over(sides[0])) < thinnest_m) return {};  // a sheet seen edge-on
        } else if (std::all_of(sides.begin(), sides.end(), [&](const auto& side) { return height_over(side) <= thinnest_m; })) {
            // From a point of the body itself all is hidden that lies on the inner side of the faces at this point.
            std::vector<HalfSpace> touched;
            for (const ConvexSolid::Side& side : sides)
                if (height_over(side) >= -thinnest_m) touched.push_back(side.plane);
            return inside(touched);
        }
        const double top = height_of(viewpoint_m), highest = (1.0 - below_viewpoint) * top;
        // The corners of the part of the occluder with heights in [0, highest].
        std::vector<double> heights_m;
        heights_m.reserve(occluder.corners_m.size());
        Ring corners;
        corners.reserve(2 * occluder.corners_m.size());
        bool cut = false;
        for (const dvec3& p : occluder.corners_m) {
            heights_m.push_back(height_of(p));
            if (heights_m.back() >= 0.0 && heights_m.back() <= highest) {
                corners.push_back(project(viewpoint_m, top, p, heights_m.back()));
            } else {
                cut = true;
            }
        }
        if (!cut) return corners;
        for (const auto& [a, b] : occluder.edges) {
            for (const double limit : {0.0, highest}) {
                const double h_a = heights_m[a] - limit, h_b = heights_m[b] - limit;
                if (h_a * h_b >= 0.0) continue;
                const dvec3& from = occluder.corners_m[a];
                corners.push_back(project(viewpoint_m, top, from + h_a / (h_a - h_b) * (occluder.corners_m[b] - from), limit));
            }
        }
        return corners;
    }

    // The part of a square around the face inside half-spaces; convex.
    Ring inside(std::span<const HalfSpace> half_spaces) const {
        const dvec3 middle = 0.5 * (low_m_ + high_m_);
        const double reach_m = glm::distance(low_m_, high_m_);
        const dvec3 x = reach_m * face_.plane.x, y = reach_m * face_.plane.y;
        std::vector<dvec3> part{middle - x - y, middle + x - y, middle + x + y, middle - x + y};
        for (const HalfSpace& half_space : half_spaces)
            part = slab(std::move(part), [&](const dvec3& p) { return height(half_space, p); }, -infinity, 0.0);
        Ring ring;
        for (const dvec3& p : part) ring.push_back(face_.plane.to_plane(p));
        return convex_hull(std::move(ring));
    }

private:
    PlanePoint project(const dvec3& viewpoint_m, double top, const dvec3& p, double h) const {
        return face_.plane.to_plane(viewpoint_m + top / (top - h) * (p - viewpoint_m));
    }

    const Face& face_;
    dvec3 low_m_{infinity}, high_m_{-infinity};
};

// A window, or the part of it that is over the plane of a face.
struct FacedWindow {
    std::vector<dvec3> vertices_m;
    dvec3 normal;  // into the room
    dvec3 middle_m;
    Ring behind;   // from where only its back could be seen; convex
};

dvec3 middle_of(const std::vector<dvec3>& polygon) {
    dvec3 middle{};
    for (const dvec3& corner : polygon) middle += corner / static_cast<double>(polygon.size());
    return middle;
}

// The parts of a square of a face from which a window is hidden.
class HiddenPart {
public:
    HiddenPart(const FaceView& view, const FacedWindow& window, const std::vector<const Occluder*>& all_occluders,
               const PlaneBounds& square, const UmbraOptions& options)
        : view_(view), window_(window), options_(options) {
        const Shaft shaft(view_.rectangle(square), window_.vertices_m, view_.normal(), window_.normal);
        for (const Occluder* occluder : all_occluders)
            if (shaft.holds_part_of(*occluder)) occluders_.push_back(occluder);
        for (std::size_t k = 0; k < occluders_.size(); ++k) all_.push_back(k);
    }

    // Where the middle of the window is hidden; the window itself is hidden nowhere else.
    Region shaded(const Region& rest) {
        const PlaneBounds where(rest);
        Region shadows;
        switch (const Shadow behind = cover(window_.behind, where); behind.cover) {
            case Shadow::Cover::all: return rest;
            case Shadow::Cover::part: shadows.push_back(*behind.outline); break;
            case Shadow::Cover::none: break;
        }
        return shaded(all_, number_of(window_.middle_m), rest, where, std::move(shadows));
    }

    // Where all of the window is hidden.
    Region of(const Region& rest) {
        switch (cover(window_.behind, PlaneBounds(rest)).cover) {
            case Shadow::Cover::all: return rest;
            case Shadow::Cover::none: return of(window_.vertices_m, all_, rest, options_.halvings);
            case Shadow::Cover::part: break;
        }
        Region hidden = common(rest, {window_.behind});
        const Region more = of(window_.vertices_m, all_, subtract(rest, {window_.behind}), options_.halvings);
        hidden.insert(hidden.end(), more.begin(), more.end());
        return unite(hidden, {});
    }

private:
    using Numbers = std::vector<std::size_t>;  // positions in occluders_

    // Within `rest`, of a part of the window.
    Region of(const std::vector<dvec3>& window_m, const Numbers& candidates, const Region& rest, int halvings_left) {
        if (rest.empty() || window_m.size() < 3) return {};
        const PlaneBounds where(rest);
        Numbers corners;
        for (const dvec3& corner : window_m) corners.push_back(number_of(corner));
        Numbers occluders;  // that hide something of the window somewhere
        Region zones;
        for (const std::size_t occluder : candidates) {
            bool hides_some = false;
            const std::optional<Ring> zone = umbra(occluder, corners, where, hides_some);
            if (!zone) return rest;
            if (!zone->empty()) zones.push_back(*zone);
            if (hides_some) occluders.push_back(occluder);
        }
        Region hidden = common(rest, zones);
        if (halvings_left == 0 || occluders.size() < 2) return hidden;
        // Where no point of the window can be seen of those that are easily tried. This only says where to look: it may be
        // too large, and what it leaves out is not found.
        Region doubtful = hidden.empty() ? rest : subtract(rest, hidden);
        corners.push_back(number_of(middle_of(window_m)));
        for (const std::size_t point : corners) {
            if (area_m2(doubtful) < options_.smallest_m2) return hidden;
            doubtful = shaded(candidates, point, doubtful, PlaneBounds(doubtful), {});
        }
        doubtful = without_crumbs(std::move(doubtful), options_.smallest_m2);
        for (const std::vector<dvec3>& half : halves(window_m)) {
            if (doubtful.empty()) return hidden;
            doubtful = tidied(of(half, candidates, doubtful, halvings_left - 1), options_.smallest_m2);
        }
        return unite(hidden, doubtful);
    }

    // Where one occluder hides all corners, in `where` and beside it; nothing if that is all of `where`.
    std::optional<Ring> umbra(std::size_t occluder, const Numbers& corners, PlaneBounds where, bool& hides_some) {
        std::vector<const Ring*> outlines;
        bool none = false;
        const PlaneBounds whole = where;
        for (const std::size_t corner : corners) {
            // Once it is known to hide not all, it only matters whether it hides any.
            const Shadow shadow = shadow_of(occluder, corner, none ? whole : where);
            hides_some = hides_some || shadow.cover != Shadow::Cover::none;
            if (none && hides_some) return Ring{};
            if (shadow.cover == Shadow::Cover::none) none = true;
            if (shadow.cover != Shadow::Cover::part || none) continue;
            where.cut(PlaneBounds(*shadow.outline));
            outlines.push_back(shadow.outline);
        }
        if (none) return Ring{};
        if (outlines.empty()) return std::nullopt;
        Ring zone = *outlines[0];
        for (std::size_t k = 1; k < outlines.size() && !zone.empty(); ++k) zone = intersect_convex(zone, *outlines[k]);
        return zone;
    }

    // Where some occluder hides a point, or something else that is given does.
    Region shaded(const Numbers& candidates, std::size_t point, const Region& rest, const PlaneBounds& where, Region shadows) {
        for (const std::size_t occluder : candidates) {
            const Shadow shadow = shadow_of(occluder, point, where);
            if (shadow.cover == Shadow::Cover::all) return rest;
            if (shadow.cover == Shadow::Cover::part) shadows.push_back(*shadow.outline);
        }
        return common(rest, shadows);
    }

    // Points of the window are met again and again: halves share corners with the whole and with each other.
    std::size_t number_of(const dvec3& point_m) {
        const auto found = std::find(points_m_.begin(), points_m_.end(), point_m);
        if (found != points_m_.end()) return static_cast<std::size_t>(found - points_m_.begin());
        points_m_.push_back(point_m);
        outlines_.emplace_back(occluders_.size());
        return points_m_.size() - 1;
    }

    Shadow shadow_of(std::size_t occluder, std::size_t point, const PlaneBounds& where) {
        Outline& outline = outlines_[point][occluder];
        if (!outline.known) {
            outline.known = true;
            outline.ring = view_.shadow(*occluders_[occluder], points_m_[point]);
            outline.bounds = PlaneBounds(outline.ring);
        }
        if (!outline.bounds.touches(where)) return {};
        if (!outline.convex) {
            outline.convex = true;
            outline.ring = convex_hull(std::move(outline.ring));
        }
        return cover(outline.ring, where);
    }

    struct Outline {
        bool known = false, convex = false;
        Ring ring{};
        PlaneBounds bounds{};
    };

    const FaceView& view_;
    const FacedWindow& window_;
    const UmbraOptions& options_;
    std::vector<const Occluder*> occluders_;
    Numbers all_;
    std::vector<dvec3> points_m_;                 // of the window
    std::vector<std::vector<Outline>> outlines_;  // [point][occluder]
};

// The islands of a region.
std::vector<Region> islands(const Region& region) {
    if (std::any_of(region.begin(), region.end(), [](const Ring& ring) { return area_m2(ring) < 0.0; })) return connected_parts(region);
    std::vector<Region> rings;
    for (const Ring& ring : region) rings.push_back({ring});
    return rings;
}

// The parts of a square of a face that see none of the windows.
Region umbra_in(const Region& square, const FaceView& view, const std::vector<FacedWindow>& windows,
                const std::vector<const Occluder*>& occluders, const UmbraOptions& options) {
    // Near windows first: they are the likeliest to be seen. From most places one is, and the search ends there.
    const PlaneBounds bounds(square);
    const std::vector<dvec3> rectangle = view.rectangle(bounds);
    const dvec3 middle_m = middle_of(rectangle);
    std::vector<const FacedWindow*> by_distance;
    for (const FacedWindow& window : windows) by_distance.push_back(&window);
    std::stable_sort(by_distance.begin(), by_distance.end(), [&](const FacedWindow* a, const FacedWindow* b) {
        return glm::distance(a->middle_m, middle_m) < glm::distance(b->middle_m, middle_m);
    });
    Region rest = square;
    std::vector<HiddenPart> finders;
    finders.reserve(by_distance.size());
    for (const FacedWindow* window : by_distance) {
        finders.emplace_back(view, *window, occluders, bounds, options);
        rest = finders.back().shaded(rest);
        if (rest.empty()) return {};
    }
    Region umbra;
    for (Region& island : islands(rest)) {
        for (HiddenPart& finder : finders) {
            if (island.empty()) break;
            island = finder.of(island);
        }
        umbra.insert(umbra.end(), island.begin(), island.end());
    }
    return umbra;
}

// A region in squares of some metres: the occluders near a square are few, and Clipper's cost grows faster than in
// proportion to what it is given at once.
std::vector<Region> tiles(const Region& region) {
    constexpr double tile_nm = 4.0 * nanometres_per_metre;
    if (region.empty()) return {};
    ClipperLib::cInt left = region[0][0].X, right = left, bottom = region[0][0].Y, top = bottom;
    for (const Ring& ring : region) {
        for (const PlanePoint& p : ring) {
            left = std::min(left, p.X), right = std::max(right, p.X);
            bottom = std::min(bottom, p.Y), top = std::max(top, p.Y);
        }
    }
    // At most 40 x 40 of them, whatever the size of the face.
    const auto step = [&](ClipperLib::cInt extent) {
        return static_cast<ClipperLib::cInt>(std::max(tile_nm, std::ceil(static_cast<double>(extent) / 40.0)));
    };
    const ClipperLib::cInt tile_width = step(right - left), tile_height = step(top - bottom);
    std::vector<Region> result;
    for (ClipperLib::cInt y = bottom; y < top; y += tile_height) {
        const ClipperLib::cInt y1 = std::min(y + tile_height, top);
        const Region row = intersect(region, {{{left, y}, {right, y}, {right, y1}, {left, y1}}});
        if (row.empty()) continue;
        for (ClipperLib::cInt x = left; x < right; x += tile_width) {
            const ClipperLib::cInt x1 = std::min(x + tile_width, right);
            Region tile = intersect(row, {{{x, y}, {x1, y}, {x1, y1}, {x, y1}}});
            if (!tile.empty()) result.push_back(std::move(tile));
        }
    }
    return result;
}

}  // namespace

UmbraFinder::UmbraFinder(const Building& building, std::vector<ConvexSolid> solids, const UmbraOptions& options)
    : building_(building), options_(options) {
    for (ConvexSolid& solid : solids) {
        Occluder occluder{std::move(solid), {}, {}};
        const auto corner_number = [&](const dvec3& v) {
            const auto same = [&](const dvec3& other) { return glm::distance(v, other) < 1e-3 * thinnest_m; };
            const auto found = std::find_if(occluder.corners_m.begin(), occluder.corners_m.end(), same);
            if (found != occluder.corners_m.end()) return static_cast<std::size_t>(found - occluder.corners_m.begin());
            occluder.corners_m.push_back(v);
            return occluder.corners_m.size() - 1;
        };
        std::set<std::array<std::size_t, 2>> edges;
        for (const ConvexSolid::Side& side : occluder.solid.sides) {
            for (std::size_t k = 0; k < side.vertices_m.size(); ++k) {
                const std::size_t a = corner_number(side.vertices_m[k]);
                const std::size_t b = corner_number(side.vertices_m[(k + 1) % side.vertices_m.size()]);
                edges.insert({std::min(a, b), std::max(a, b)});
            }
        }
        occluder.edges.assign(edges.begin(), edges.end());
        occluders_.push_back(std::move(occluder));
    }
    // Large ones first: they are the likeliest to hide all, and the search ends there.
    std::stable_sort(occluders_.begin(), occluders_.end(), [](const Occluder& a, const Occluder& b) {
        return glm::distance(a.solid.low_m, a.solid.high_m) > glm::distance(b.solid.low_m, b.solid.high_m);
    });
    for (const Aperture& aperture : building.apertures) {
        if (aperture.inner) continue;
        for (const FacetId part : aperture.facets) windows_.push_back({building.facets[index(part)].vertices_m, aperture.normal});
    }
}

Region UmbraFinder::on_face(FaceId id) const {
    const Face& face = building_.faces[index(id)];
    if (face.environment == Environment::outdoor || face.aperture || face.region.empty()) return {};
    const FaceView view(face);
    const auto height_of = [&](const dvec3& p) { return view.height_of(p); };

    std::vector<FacedWindow> windows;
    for (const Window& window : windows_) {
        // What is lower than a micrometre over the plane of the face lies in it, and lights nothing on the face.
        std::vector<dvec3> visible = slab(window.vertices_m, height_of, thinnest_m, infinity);
        if (visible.size() < 3) continue;  // the face looks away from it
        const HalfSpace behind{window.normal, glm::dot(window.normal, window.vertices_m[0])};
        const dvec3 middle_m = middle_of(visible);
        windows.push_back({std::move(visible), window.normal, middle_m, view.inside({&behind, 1})});
    }
    Region umbra = face.region;
    if (!windows.empty()) {
        std::vector<const Occluder*> occluders;
        for (const Occluder& occluder : occluders_)
            if (std::any_of(occluder.corners_m.begin(), occluder.corners_m.end(), [&](const dvec3& p) { return height_of(p) > thinnest_m; }))
                occluders.push_back(&occluder);
        const std::vector<Region> squares = tiles(face.region);
        std::vector<Region> found(squares.size());
        parallel_for(squares.size(), 1, [&](std::size_t k) { found[k] = umbra_in(squares[k], view, windows, occluders, options_); });
        umbra.clear();
        for (const Region& part : found) umbra.insert(umbra.end(), part.begin(), part.end());
        umbra = unite(umbra, {});
    }
    return tidied(std::move(umbra), smallest_zone_m2);
}

}  // namespace naturel
