#include "core/umbra.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace naturel {

namespace {

using glm::dvec3;

// What is lower than this over the plane of a face lies in it: such parts of an aperture light nothing on the face, and
// such occluders hide nothing.
constexpr double lowest_m = 1e-6;

// An occluder is cut this share of the height below the point that looks, so that its shadow stays finite. What is cut off
// hides only directions within 1e-6 of the horizontal: the zone gets a millionth narrower there, never wider.
constexpr double below_viewpoint = 1e-6;

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
            if ((ha < 0.0) != (hb < 0.0) && ha != 0.0 && hb != 0.0) kept.push_back(a + ha / (ha - hb) * (b - a));
        }
        polygon = std::move(kept);
    }
    return polygon;
}

// Seen from one face.
class FaceView {
public:
    explicit FaceView(const Face& face) : face_(face) {}

    double height(const dvec3& point_m) const { return glm::dot(point_m - face_.plane.origin_m, face_.normal); }

    // The points of the plane that an occluder hides from a viewpoint; convex, empty when there are none.
    Ring shadow(const ConvexSolid& occluder, const dvec3& viewpoint_m) const {
        const double top = height(viewpoint_m);
        const auto height_of = [&](const dvec3& p) { return height(p); };
        Ring corners;
        if (!reaches_above(occluder)) return corners;
        for (const ConvexSolid::Side& side : occluder.sides) {
            for (const dvec3& p : slab(side.vertices_m, height_of, 0.0, (1.0 - below_viewpoint) * top)) {
                const double t = top / (top - height(p));
                corners.push_back(face_.plane.to_plane(viewpoint_m + t * (p - viewpoint_m)));
            }
        }
        return convex_hull(std::move(corners));
    }

    // False for what lies behind the face or ends in its plane, as the wall that the face is the surface of.
    bool reaches_above(const ConvexSolid& occluder) const {
        return std::any_of(occluder.sides.begin(), occluder.sides.end(), [&](const ConvexSolid::Side& side) {
            return std::any_of(side.vertices_m.begin(), side.vertices_m.end(),
                               [&](const dvec3& v) { return height(v) > lowest_m; });
        });
    }

    // The part of the face that lies on or behind a plane.
    Region behind(const dvec3& normal, double offset_m) const {
        Region result;
        double extent_m = 1.0;
        for (const Ring& ring : face_.region)
            for (const PlanePoint& p : ring) extent_m = std::max(extent_m, glm::distance(face_.plane.to_world(p), face_.plane.origin_m));
        // A square around the face, cut by the plane.
        const dvec3 x = 2.0 * extent_m * face_.plane.x, y = 2.0 * extent_m * face_.plane.y, o = face_.plane.origin_m;
        const auto depth_of = [&](const dvec3& p) { return offset_m - glm::dot(normal, p); };
        const auto part = slab({o - x - y, o + x - y, o + x + y, o - x + y}, depth_of, -1e-9, 1e300);
        Ring ring;
        for (const dvec3& p : part) ring.push_back(face_.plane.to_plane(p));
        return ring.size() < 3 ? Region{} : intersect(face_.region, {ring});
    }

private:
    const Face& face_;
};

struct Box {
    dvec3 low_m{1e300}, high_m{-1e300};

    void add(const dvec3& p) { low_m = min(low_m, p), high_m = max(high_m, p); }
    bool touches(const ConvexSolid& solid) const {
        for (int k = 0; k < 3; ++k)
            if (solid.low_m[k] > high_m[k] || solid.high_m[k] < low_m[k]) return false;
        return true;
    }
};

}  // namespace

UmbraFinder::UmbraFinder(const Building& building, std::vector<ConvexSolid> occluders)
    : building_(building), occluders_(std::move(occluders)) {
    for (const Aperture& aperture : building.apertures) {
        if (aperture.inner) continue;
        for (const FacetId part : aperture.facets) windows_.push_back({building.facets[index(part)].vertices_m, aperture.normal});
    }
}

Region UmbraFinder::on_face(FaceId id) const {
    const Face& face = building_.faces[index(id)];
    if (face.environment == Environment::outdoor || face.aperture) return {};
    const FaceView view(face);
    Box face_box;
    for (const Ring& ring : face.region)
        for (const PlanePoint& p : ring) face_box.add(face.plane.to_world(p));

    Region umbra = face.region;  // of the windows so far
    for (const Window& window : windows_) {
        if (umbra.empty()) break;
        const auto height_of = [&](const dvec3& p) { return view.height(p); };
        const std::vector<dvec3> visible = slab(window.vertices_m, height_of, lowest_m, 1e300);
        if (visible.size() < 3) continue;  // the face looks away from it

        Region hidden = view.behind(window.normal, glm::dot(window.normal, window.vertices_m[0]));
        Box shaft = face_box;
        for (const dvec3& v : visible) shaft.add(v);
        for (const ConvexSolid& occluder : occluders_) {
            if (!shaft.touches(occluder)) continue;
            Region zone = umbra;
            for (const dvec3& corner : visible) {
                const Ring shadow = view.shadow(occluder, corner);
                zone = shadow.empty() ? Region{} : intersect(zone, {shadow});
                if (zone.empty()) break;
            }
            hidden.insert(hidden.end(), zone.begin(), zone.end());
        }
        umbra = intersect(umbra, hidden);
    }
    return without_slivers(umbra);
}

}  // namespace naturel
