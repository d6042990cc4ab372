#include "core/planar_region.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {

namespace {

using ClipperLib::cInt;
using ClipperLib::ClipType;

// Corners that dent an outline by less than this are rounding of cuts at 1 nm, not reflex corners; rings thinner than
// this are rounding too. A vertex of a cut is off by up to 0.71 nm, and a ring sees cuts on both of its ends.
constexpr double rounding_nm = 4.0;

Region combine(ClipType operation, const Region& a, const Region& b) {
    ClipperLib::Clipper clipper;
    clipper.AddPaths(a, ClipperLib::ptSubject, true);
    clipper.AddPaths(b, ClipperLib::ptClip, true);
    Region result;
    clipper.Execute(operation, result, ClipperLib::pftNonZero, ClipperLib::pftNonZero);
    return result;
}

struct Box {
    cInt left, right, bottom, top;
};

Box bounding_box(const Region& region) {
    Box box{region[0][0].X, region[0][0].X, region[0][0].Y, region[0][0].Y};
    for (const Ring& ring : region) {
        for (const PlanePoint& p : ring) {
            box.left = std::min(box.left, p.X), box.right = std::max(box.right, p.X);
            box.bottom = std::min(box.bottom, p.Y), box.top = std::max(box.top, p.Y);
        }
    }
    return box;
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

// A big rectangle left of the line from a to b that reaches beyond `box`.
Ring half_plane(const PlanePoint& a, const PlanePoint& b, const Box& box) {
    const double reach = 2.0 * (static_cast<double>(box.right - box.left) + static_cast<double>(box.top - box.bottom));
    const double length = distance(a, b);
    const double dx = static_cast<double>(b.X - a.X) / length * reach;
    const double dy = static_cast<double>(b.Y - a.Y) / length * reach;
    const auto at = [&](double along, double left) {
        return PlanePoint(a.X + std::llround(along * dx - left * dy), a.Y + std::llround(along * dy + left * dx));
    };
    return {at(-1, 0), at(1, 0), at(1, 1), at(-1, 1)};
}

struct Cut {
    PlanePoint from, to;
};

// The reflex corners of a connected part, each with the two cuts that would remove it.
std::vector<std::array<Cut, 2>> reflex_cuts(const Region& part) {
    std::vector<std::array<Cut, 2>> cuts;
    for (const Ring& ring : part) {
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const PlanePoint& before = ring[(i + ring.size() - 1) % ring.size()];
            const PlanePoint& after = ring[(i + 1) % ring.size()];
            if (corner_height(before, ring[i], after) < -rounding_nm)
                cuts.push_back({Cut{before, ring[i]}, Cut{ring[i], after}});
        }
    }
    return cuts;
}

void append_convex_parts(const Region& part, std::vector<Ring>& convex) {
    const auto cuts = reflex_cuts(part);
    // The corner in the middle of the list halves big outlines; which one is taken does not matter otherwise.
    for (std::size_t k = 0; k < cuts.size(); ++k) {
        for (const Cut& cut : cuts[(cuts.size() / 2 + k) % cuts.size()]) {
            const Region left_side{half_plane(cut.from, cut.to, bounding_box(part))};
            const Region left = without_slivers(intersect(part, left_side));
            const Region right = without_slivers(subtract(part, left_side));
            if (left.empty() || right.empty()) continue;
            for (const Region& half : {left, right}) {
                for (const Region& piece : connected_parts(half)) append_convex_parts(piece, convex);
            }
            return;
        }
    }
    // Convex, or so close to it that no cut separates anything at 1 nm.
    convex.push_back(part.front());
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
    clipper.AddPaths(region, ClipperLib::ptSubject, true);
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

std::vector<Ring> convex_parts(const Region& region) {
    std::vector<Ring> convex;
    for (const Region& part : connected_parts(without_slivers(region))) append_convex_parts(part, convex);
    return convex;
}

Region without_slivers(const Region& region) {
    Region kept;
    for (const Ring& ring : region) {
        Ring clean;
        ClipperLib::CleanPolygon(ring, clean);
        if (clean.size() < 3) continue;
        double outline = 0.0;
        for (std::size_t i = 0; i < clean.size(); ++i) outline += distance(clean[i], clean[(i + 1) % clean.size()]);
        const double area_nm2 = std::abs(area_m2(clean)) * nanometres_per_metre * nanometres_per_metre;
        if (area_nm2 > 0.5 * rounding_nm * outline) kept.push_back(std::move(clean));
    }
    return kept;
}

}  // namespace naturel
