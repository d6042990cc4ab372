#include "core/convex_solid.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "core/polyhedra.h"

namespace naturel {

namespace {

using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

// A vertex this near to a plane lies in it: where three planes meet, coordinates of 100 m are good to 1e-13 m, a hundred times
// worse where they meet under sharp angles.
constexpr double in_plane_m = 1e-10;

double height(const HalfSpace& plane, const dvec3& point_m) { return glm::dot(plane.normal, point_m) - plane.offset_m; }

HalfSpace opposite(const HalfSpace& plane) { return {-plane.normal, -plane.offset_m}; }

template <class Visit>
void for_each_vertex(const ConvexSolid& solid, const Visit& visit) {
    for (const ConvexSolid::Side& side : solid.sides)
        for (const dvec3& v : side.vertices_m) visit(v);
}

double highest_vertex(const ConvexSolid& solid, const HalfSpace& plane) {
    double highest = -infinity;
    for_each_vertex(solid, [&](const dvec3& v) { highest = std::max(highest, height(plane, v)); });
    return highest;
}

void measure(ConvexSolid& solid) {
    solid.low_m = dvec3(infinity);
    solid.high_m = dvec3(-infinity);
    for_each_vertex(solid, [&](const dvec3& v) { solid.low_m = min(solid.low_m, v), solid.high_m = max(solid.high_m, v); });
}

bool boxes_touch(const ConvexSolid& a, const ConvexSolid& b) {
    for (int k = 0; k < 3; ++k)
        if (a.low_m[k] > b.high_m[k] + thinnest_m || b.low_m[k] > a.high_m[k] + thinnest_m) return false;
    return true;
}

ConvexSolid convex_solid_of(const Polyhedron& polyhedron) {
    ConvexSolid solid;
    for (const PolyhedronFace& face : polyhedron_faces(polyhedron))
        solid.sides.push_back({{face.outward, glm::dot(face.outward, face.vertices_m[0])}, face.vertices_m});
    measure(solid);
    return solid;
}

ConvexSolid make_box(const dvec3& low_m, const dvec3& high_m) {
    const dvec3 size = high_m - low_m;
    return convex_solid_of({.vertices_m = {low_m, low_m + dvec3(size.x, 0, 0), low_m + dvec3(0, size.y, 0), low_m + dvec3(0, 0, size.z)}});
}

// Larger bodies swallow those inside them.
void add_maximal(std::vector<ConvexSolid>& solids, ConvexSolid solid) {
    if (std::any_of(solids.begin(), solids.end(), [&](const ConvexSolid& other) { return contains(other, solid); })) return;
    std::erase_if(solids, [&](const ConvexSolid& other) { return contains(solid, other); });
    solids.push_back(std::move(solid));
}

bool overlap(ConvexSolid a, const ConvexSolid& b) {
    return boxes_touch(a, b) &&
           std::all_of(b.sides.begin(), b.sides.end(), [&](const ConvexSolid::Side& side) { return clip(a, side.plane); });
}

// Of a body that is cut, the parts beyond each side of the space remain; they overlap.
std::vector<ConvexSolid> carve(std::vector<ConvexSolid> solids, const ConvexSolid& space) {
    std::vector<ConvexSolid> left, cut;
    for (ConvexSolid& solid : solids) (overlap(solid, space) ? cut : left).push_back(std::move(solid));
    for (const ConvexSolid& solid : cut) {
        for (const ConvexSolid::Side& side : space.sides) {
            ConvexSolid part = solid;
            if (clip(part, opposite(side.plane))) add_maximal(left, std::move(part));
        }
    }
    return left;
}

// Cuts `solid` down to the sides of another body but one. False when nothing is left.
bool clip_to_others(ConvexSolid& solid, const ConvexSolid& other, std::size_t left_out) {
    for (std::size_t k = 0; k < other.sides.size(); ++k)
        if (k != left_out && !clip(solid, other.sides[k].plane)) return false;
    return true;
}

// True when a segment from a vertex of p to a vertex of q passes where both planes are exceeded.
bool crosses_both(const ConvexSolid& p, const ConvexSolid& q, const HalfSpace& a, const HalfSpace& b) {
    bool crosses = false;
    for_each_vertex(q, [&](const dvec3& x) {
        const double a_x = height(a, x), b_x = height(b, x);
        if (a_x <= thinnest_m || crosses) return;
        for_each_vertex(p, [&](const dvec3& y) {
            const double a_y = height(a, y), b_y = height(b, y);
            if (b_y <= thinnest_m) return;
            // The smaller of the two heights is largest where they are equal.
            const double t = std::clamp((a_x - b_x) / ((a_x - b_x) + (b_y - a_y)), 0.0, 1.0);
            crosses = crosses || std::min(a_x + t * (a_y - a_x), b_x + t * (b_y - b_x)) > thinnest_m;
        });
    });
    return crosses;
}

// The largest convex body in the union of p and q that crosses from one to the other through side i of p and side j of q:
// the points inside all other sides of both. It lies in the union when no such point is outside both sides i and j.
// (The consensus of two products in a sum of products, Quine 1955, with half-spaces for literals.)
std::optional<ConvexSolid> bridge(const ConvexSolid& p, std::size_t i, const ConvexSolid& q, std::size_t j) {
    const HalfSpace &a = p.sides[i].plane, &b = q.sides[j].plane;
    // Its part inside a, in p, and its part inside b, in q: each must reach beyond the other plane, or all of it is in one.
    ConvexSolid in_p = p, in_q = q;
    if (!clip_to_others(in_p, q, j) || highest_vertex(in_p, b) <= thinnest_m) return std::nullopt;
    if (!clip_to_others(in_q, p, i) || highest_vertex(in_q, a) <= thinnest_m) return std::nullopt;
    if (crosses_both(in_p, in_q, a, b)) return std::nullopt;
    // Outside both there may be more than segments between vertices show: look at the whole.
    ConvexSolid body = make_box(min(p.low_m, q.low_m) - 1.0, max(p.high_m, q.high_m) + 1.0);
    if (!clip_to_others(body, p, i) || !clip_to_others(body, q, j)) return std::nullopt;
    ConvexSolid outside = body;
    if (clip(outside, opposite(a)) && clip(outside, opposite(b))) return std::nullopt;
    return body;
}

// Joins bodies until no pair gives a larger convex body.
std::vector<ConvexSolid> joined(std::vector<ConvexSolid> solids) {
    // Hundreds of bodies that overlap at random have thousands of maximal parts, each of little worth. Leaving some out is only
    // cautious; those that take the place of others always count.
    const std::size_t most = 2 * solids.size() + 200;
    std::vector<bool> swallowed(solids.size(), false);
    for (std::size_t q = 1; q < solids.size(); ++q) {
        for (std::size_t p = 0; p < q && !swallowed[q]; ++p) {
            if (swallowed[p] || !boxes_touch(solids[p], solids[q])) continue;
            // Sides that the other body reaches beyond.
            std::vector<std::size_t> sides_p, sides_q;
            for (std::size_t i = 0; i < solids[p].sides.size(); ++i)
                if (highest_vertex(solids[q], solids[p].sides[i].plane) > thinnest_m) sides_p.push_back(i);
            for (std::size_t j = 0; j < solids[q].sides.size(); ++j)
                if (highest_vertex(solids[p], solids[q].sides[j].plane) > thinnest_m) sides_q.push_back(j);
            for (const std::size_t i : sides_p) {
                for (const std::size_t j : sides_q) {
                    auto body = bridge(solids[p], i, solids[q], j);
                    if (!body) continue;
                    bool known = false;
                    for (std::size_t k = 0; k < solids.size() && !known; ++k) known = !swallowed[k] && contains(solids[k], *body);
                    if (known) continue;
                    bool swallows = false;
                    for (std::size_t k = 0; k < solids.size(); ++k) {
                        if (swallowed[k] || !contains(*body, solids[k])) continue;
                        swallowed[k] = swallows = true;
                    }
                    if (!swallows && solids.size() >= most) continue;
                    solids.push_back(std::move(*body));
                    swallowed.push_back(false);
                }
            }
        }
    }
    std::vector<ConvexSolid> maximal;
    for (std::size_t k = 0; k < solids.size(); ++k)
        if (!swallowed[k]) maximal.push_back(std::move(solids[k]));
    return maximal;
}

// The polygons of the scene, as convex sheets. The two sides of a polygon, and polygons of one plane, are one.
std::vector<ConvexSolid> sheets(const Building& building) {
    struct Plane {
        PlaneFrame frame;
        Region region;
    };
    std::vector<Plane> planes;
    for (const Face& face : building.faces) {
        if (!face.sheet) continue;
        const auto corners_of = [&](const Ring& ring) {
            std::vector<dvec3> corners_m;
            for (const PlanePoint& p : ring) corners_m.push_back(face.plane.to_world(p));
            return corners_m;
        };
        const auto holds_face = [&](const Plane& plane) {
            return std::all_of(face.region.begin(), face.region.end(), [&](const Ring& ring) {
                const auto corners_m = corners_of(ring);
                return std::all_of(corners_m.begin(), corners_m.end(), [&](const dvec3& v) {
                    return std::abs(glm::dot(v - plane.frame.origin_m, plane.frame.normal)) < thinnest_m;
                });
            });
        };
        auto plane = std::find_if(planes.begin(), planes.end(), holds_face);
        if (plane == planes.end()) plane = planes.insert(planes.end(), {face.plane, {}});
        Region region;
        for (const Ring& ring : face.region) {
            Ring moved;
            for (const dvec3& v : corners_of(ring)) moved.push_back(plane->frame.to_plane(v));
            // Seen from behind, all rings of the face run the other way.
            if (glm::dot(plane->frame.normal, face.normal) < 0.0) ClipperLib::ReversePath(moved);
            region.push_back(std::move(moved));
        }
        plane->region = unite(plane->region, region);
    }
    std::vector<ConvexSolid> sheets;
    for (const Plane& plane : planes) {
        for (const Ring& ring : convex_parts(plane.region)) {
            ConvexSolid::Side side{{plane.frame.normal, glm::dot(plane.frame.normal, plane.frame.origin_m)}, {}};
            for (const PlanePoint& p : ring) side.vertices_m.push_back(plane.frame.to_world(p));
            sheets.push_back({.sides = {std::move(side)}});
            measure(sheets.back());
        }
    }
    return sheets;
}

}  // namespace

bool clip(ConvexSolid& solid, const HalfSpace& keep) {
    // The bounding box settles most cases.
    const dvec3 middle = 0.5 * (solid.low_m + solid.high_m), half = 0.5 * (solid.high_m - solid.low_m);
    if (height(keep, middle) + glm::dot(glm::abs(keep.normal), half) <= in_plane_m) return true;
    double highest = -infinity, lowest = infinity;
    for_each_vertex(solid, [&](const dvec3& v) {
        const double h = height(keep, v);
        highest = std::max(highest, h), lowest = std::min(lowest, h);
    });
    if (lowest >= -thinnest_m) return false;
    if (highest <= thinnest_m) return true;
    const auto snapped_height = [&](const dvec3& v) {
        const double h = height(keep, v);
        return std::abs(h) < in_plane_m ? 0.0 : h;
    };
    std::vector<ConvexSolid::Side> sides;
    std::vector<dvec3> rim;
    for (ConvexSolid::Side& side : solid.sides) {
        ConvexSolid::Side part{side.plane, {}};
        const std::size_t n = side.vertices_m.size();
        for (std::size_t k = 0; k < n; ++k) {
            const dvec3 &a = side.vertices_m[k], &b = side.vertices_m[(k + 1) % n];
            const double h_a = snapped_height(a), h_b = snapped_height(b);
            if (h_a <= 0.0) part.vertices_m.push_back(a);
            if (h_a == 0.0) rim.push_back(a);
            if (h_a * h_b < 0.0) {
                // The same point, to the bit, for the other side at this edge, where it runs the other way.
                const dvec3 cut = h_a < h_b ? a + h_a / (h_a - h_b) * (b - a) : b + h_b / (h_b - h_a) * (a - b);
                part.vertices_m.push_back(cut);
                rim.push_back(cut);
            }
        }
        if (part.vertices_m.size() >= 3) sides.push_back(std::move(part));
    }
    dvec3 centre{};
    for (const dvec3& v : rim) centre += v / static_cast<double>(rim.size());
    const PlaneFrame frame = make_plane_frame(centre, keep.normal);
    const auto angle = [&](const dvec3& v) { return std::atan2(glm::dot(v - centre, frame.y), glm::dot(v - centre, frame.x)); };
    std::sort(rim.begin(), rim.end(), [&](const dvec3& a, const dvec3& b) { return angle(a) < angle(b); });
    ConvexSolid::Side cap{keep, {}};
    for (const dvec3& v : rim)
        if (cap.vertices_m.empty() || glm::distance(cap.vertices_m.back(), v) > in_plane_m) cap.vertices_m.push_back(v);
    if (cap.vertices_m.size() > 1 && glm::distance(cap.vertices_m.back(), cap.vertices_m.front()) <= in_plane_m)
        cap.vertices_m.pop_back();
    sides.push_back(std::move(cap));
    solid.sides = std::move(sides);
    measure(solid);
    return true;
}

bool contains(const ConvexSolid& outer, const ConvexSolid& inner) {
    for (int k = 0; k < 3; ++k)
        if (inner.low_m[k] < outer.low_m[k] - thinnest_m || inner.high_m[k] > outer.high_m[k] + thinnest_m) return false;
    return std::all_of(outer.sides.begin(), outer.sides.end(), [&](const ConvexSolid::Side& side) {
        return highest_vertex(inner, side.plane) <= thinnest_m;
    });
}

double volume_m3(const ConvexSolid& solid) {
    // Pyramids from a point inside to the triangles of the sides.
    const dvec3 apex = 0.5 * (solid.low_m + solid.high_m);
    double six_volumes = 0.0;
    for (const ConvexSolid::Side& side : solid.sides) {
        for (std::size_t k = 1; k + 1 < side.vertices_m.size(); ++k)
            six_volumes += glm::dot(side.vertices_m[0] - apex,
                                    glm::cross(side.vertices_m[k] - apex, side.vertices_m[k + 1] - apex));
    }
    return six_volumes / 6.0;
}

std::vector<ConvexSolid> convex_occluders(const Scene& scene, const Building& building) {
    std::vector<ConvexSolid> solids;
    // Below the ground all is solid: a slab as wide and deep as what is carved into it.
    dvec3 low_m(infinity), high_m(-infinity);
    for (const Polyhedron& polyhedron : scene.polyhedra) {
        if (polyhedron.effect != Effect::carve) continue;
        const ConvexSolid space = convex_solid_of(polyhedron);
        low_m = min(low_m, space.low_m), high_m = max(high_m, space.high_m);
    }
    if (low_m.z < scene.ground.z_m - thinnest_m)
        solids.push_back(make_box(low_m - 1.0, {high_m.x + 1.0, high_m.y + 1.0, scene.ground.z_m}));
    for (const Polyhedron& polyhedron : scene.polyhedra) {
        if (polyhedron.effect == Effect::fill) {
            add_maximal(solids, convex_solid_of(polyhedron));
        } else {
            solids = carve(std::move(solids), convex_solid_of(polyhedron));
        }
    }
    solids = joined(std::move(solids));
    for (ConvexSolid& sheet : sheets(building)) solids.push_back(std::move(sheet));
    return solids;
}

}  // namespace naturel
