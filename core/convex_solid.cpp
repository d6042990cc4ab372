#include "core/convex_solid.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/polyhedra.h"

namespace naturel {

namespace {

using glm::dvec3;

// Bodies, gaps and overlaps thinner than this do not exist: as coincidence of faces in the assembly.
constexpr double thinnest_m = 1e-6;

double height(const HalfSpace& plane, const dvec3& point_m) { return glm::dot(plane.normal, point_m) - plane.offset_m; }

HalfSpace opposite(const HalfSpace& plane) { return {-plane.normal, -plane.offset_m}; }

template <class Visit>
void for_each_vertex(const ConvexSolid& solid, const Visit& visit) {
    for (const ConvexSolid::Side& side : solid.sides)
        for (const dvec3& v : side.vertices_m) visit(v);
}

void measure(ConvexSolid& solid) {
    solid.low_m = dvec3(1e300);
    solid.high_m = dvec3(-1e300);
    for_each_vertex(solid, [&](const dvec3& v) { solid.low_m = min(solid.low_m, v), solid.high_m = max(solid.high_m, v); });
}

bool boxes_touch(const ConvexSolid& a, const ConvexSolid& b) {
    for (int k = 0; k < 3; ++k)
        if (a.low_m[k] > b.high_m[k] + thinnest_m || b.low_m[k] > a.high_m[k] + thinnest_m) return false;
    return true;
}

ConvexSolid make_solid(const Polyhedron& polyhedron) {
    ConvexSolid solid;
    for (const PolyhedronFace& face : polyhedron_faces(polyhedron))
        solid.sides.push_back({{face.outward, glm::dot(face.outward, face.vertices_m[0])}, face.vertices_m});
    measure(solid);
    return solid;
}

ConvexSolid make_box(const dvec3& low_m, const dvec3& high_m) {
    const dvec3 size = high_m - low_m;
    return make_solid({.vertices_m = {low_m, low_m + dvec3(size.x, 0, 0), low_m + dvec3(0, size.y, 0), low_m + dvec3(0, 0, size.z)}});
}

// Larger bodies swallow those inside them.
void add_maximal(std::vector<ConvexSolid>& solids, ConvexSolid solid) {
    if (std::any_of(solids.begin(), solids.end(), [&](const ConvexSolid& other) { return contains(other, solid); })) return;
    std::erase_if(solids, [&](const ConvexSolid& other) { return contains(solid, other); });
    solids.push_back(std::move(solid));
}

std::vector<ConvexSolid> carve(std::vector<ConvexSolid> solids, const ConvexSolid& space) {
    std::vector<ConvexSolid> left;
    std::vector<ConvexSolid> cut;
    for (ConvexSolid& solid : solids) {
        bool overlaps = boxes_touch(solid, space);
        if (overlaps) {
            std::optional<ConvexSolid> common = solid;
            for (const ConvexSolid::Side& side : space.sides)
                if (common) common = clip(*common, side.plane);
            overlaps = common.has_value();
        }
        (overlaps ? cut : left).push_back(std::move(solid));
    }
    for (const ConvexSolid& solid : cut) {
        for (const ConvexSolid::Side& side : space.sides)
            if (auto part = clip(solid, opposite(side.plane))) add_maximal(left, std::move(*part));
    }
    return left;
}

// The largest convex body in the union of p and q that crosses from one to the other through side i of p and side j of q:
// the points inside all other sides of both. It lies in the union when no such point is outside both sides i and j.
std::optional<ConvexSolid> bridge(const ConvexSolid& p, std::size_t i, const ConvexSolid& q, std::size_t j) {
    const HalfSpace &a = p.sides[i].plane, &b = q.sides[j].plane;
    if (glm::dot(a.normal, b.normal) >= 0.0) return std::nullopt;
    // Start from a box around both; sides i and j are the ones left out.
    std::optional<ConvexSolid> body = make_box(min(p.low_m, q.low_m) - 1.0, max(p.high_m, q.high_m) + 1.0);
    for (std::size_t k = 0; k < p.sides.size() && body; ++k)
        if (k != i) body = clip(*body, p.sides[k].plane);
    for (std::size_t k = 0; k < q.sides.size() && body; ++k)
        if (k != j) body = clip(*body, q.sides[k].plane);
    if (!body) return std::nullopt;
    if (const auto outside_a = clip(*body, opposite(a)))
        if (clip(*outside_a, opposite(b))) return std::nullopt;
    return body;
}

// Joins bodies until no pair gives a larger convex body.
std::vector<ConvexSolid> joined(std::vector<ConvexSolid> solids) {
    // Every new body may join with every other one; scenes of a few hundred bodies in contact end long before this.
    const std::size_t most = 20 * solids.size() + 1000;
    for (std::size_t q = 1; q < solids.size() && q < most; ++q) {
        for (std::size_t p = 0; p < q; ++p) {
            if (!boxes_touch(solids[p], solids[q])) continue;
            for (std::size_t i = 0; i < solids[p].sides.size(); ++i) {
                for (std::size_t j = 0; j < solids[q].sides.size(); ++j) {
                    auto body = bridge(solids[p], i, solids[q], j);
                    if (!body) continue;
                    const bool known = std::any_of(solids.begin(), solids.end(),
                                                   [&](const ConvexSolid& other) { return contains(other, *body); });
                    if (!known) solids.push_back(std::move(*body));
                }
            }
        }
    }
    std::vector<ConvexSolid> maximal;
    for (ConvexSolid& solid : solids) add_maximal(maximal, std::move(solid));
    return maximal;
}

}  // namespace

std::optional<ConvexSolid> clip(const ConvexSolid& solid, const HalfSpace& keep) {
    double highest = -1e300, lowest = 1e300;
    for_each_vertex(solid, [&](const dvec3& v) {
        const double h = height(keep, v);
        highest = std::max(highest, h), lowest = std::min(lowest, h);
    });
    if (highest <= thinnest_m) return lowest < -thinnest_m ? std::optional(solid) : std::nullopt;
    if (lowest >= -thinnest_m) return std::nullopt;
    ConvexSolid result;
    std::vector<dvec3> rim;
    for (const ConvexSolid::Side& side : solid.sides) {
        ConvexSolid::Side part{side.plane, {}};
        const std::size_t n = side.vertices_m.size();
        for (std::size_t k = 0; k < n; ++k) {
            const dvec3 &a = side.vertices_m[k], &b = side.vertices_m[(k + 1) % n];
            const double ha = height(keep, a), hb = height(keep, b);
            if (ha <= 0.0) part.vertices_m.push_back(a);
            if ((ha < 0.0) != (hb < 0.0) && ha != 0.0 && hb != 0.0) {
                // The same point for the edge's other side, where it runs the other way.
                const bool forward = ha < hb;
                const dvec3 cut = forward ? a + ha / (ha - hb) * (b - a) : b + hb / (hb - ha) * (a - b);
                part.vertices_m.push_back(cut);
            }
        }
        if (part.vertices_m.size() < 3) continue;
        for (const dvec3& v : part.vertices_m)
            if (std::abs(height(keep, v)) < 1e-3 * thinnest_m) rim.push_back(v);
        result.sides.push_back(std::move(part));
    }
    if (result.sides.empty()) return std::nullopt;
    if (rim.size() >= 3 && !solid.sides.front().vertices_m.empty() && solid.sides.size() > 1) {
        dvec3 centre{};
        for (const dvec3& v : rim) centre += v / static_cast<double>(rim.size());
        const PlaneFrame frame = make_plane_frame(centre, keep.normal);
        const auto angle = [&](const dvec3& v) { return std::atan2(glm::dot(v - centre, frame.y), glm::dot(v - centre, frame.x)); };
        std::sort(rim.begin(), rim.end(), [&](const dvec3& a, const dvec3& b) { return angle(a) < angle(b); });
        ConvexSolid::Side cap{keep, {}};
        for (const dvec3& v : rim)
            if (cap.vertices_m.empty() || glm::distance(cap.vertices_m.back(), v) > 1e-3 * thinnest_m) cap.vertices_m.push_back(v);
        if (cap.vertices_m.size() >= 3) result.sides.push_back(std::move(cap));
    }
    measure(result);
    return result;
}

bool contains(const ConvexSolid& outer, const ConvexSolid& inner) {
    for (int k = 0; k < 3; ++k)
        if (inner.low_m[k] < outer.low_m[k] - thinnest_m || inner.high_m[k] > outer.high_m[k] + thinnest_m) return false;
    for (const ConvexSolid::Side& side : outer.sides) {
        bool inside = true;
        for_each_vertex(inner, [&](const dvec3& v) { inside = inside && height(side.plane, v) <= thinnest_m; });
        if (!inside) return false;
    }
    return true;
}

std::vector<ConvexSolid> convex_occluders(const Scene& scene, const Building& building) {
    std::vector<ConvexSolid> solids;
    // Below the ground all is solid: a slab as wide and deep as what is carved into it.
    ConvexSolid carved;
    carved.low_m = dvec3(1e300), carved.high_m = dvec3(-1e300);
    for (const Polyhedron& polyhedron : scene.polyhedra) {
        if (polyhedron.effect != Effect::carve) continue;
        const ConvexSolid space = make_solid(polyhedron);
        carved.low_m = min(carved.low_m, space.low_m), carved.high_m = max(carved.high_m, space.high_m);
    }
    if (carved.low_m.z < scene.ground.z_m - thinnest_m)
        solids.push_back(make_box(carved.low_m - 1.0, {carved.high_m.x + 1.0, carved.high_m.y + 1.0, scene.ground.z_m}));
    for (const Polyhedron& polyhedron : scene.polyhedra) {
        if (polyhedron.effect == Effect::fill) {
            add_maximal(solids, make_solid(polyhedron));
        } else {
            solids = carve(std::move(solids), make_solid(polyhedron));
        }
    }
    solids = joined(std::move(solids));
    // Polygons without thickness hide as well.
    const std::size_t first_polygon_name = scene.polygons.size();
    if (first_polygon_name > 0) {
        for (const Facet& facet : building.facets) {
            const std::string& name = building.faces[index(facet.face)].name;
            const bool of_polygon = std::any_of(scene.polygons.begin(), scene.polygons.end(),
                                                [&](const SurfacePolygon& polygon) { return polygon.id == name; });
            if (facet.is_aperture || !of_polygon) continue;
            ConvexSolid sheet;
            sheet.sides.push_back({{facet.normal, glm::dot(facet.normal, facet.vertices_m[0])}, facet.vertices_m});
            measure(sheet);
            solids.push_back(std::move(sheet));
        }
    }
    return solids;
}

}  // namespace naturel
