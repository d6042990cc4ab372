#pragma once
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <polyclipping/clipper.hpp>
#include <vector>

namespace naturel {

/// Polygons in a plane, on integer coordinates of 1 nm, as Clipper takes them: outer rings counter-clockwise, holes
/// clockwise. Every polygon boolean of the program goes through the functions below.
using PlanePoint = ClipperLib::IntPoint;
using Ring = ClipperLib::Path;
using Region = ClipperLib::Paths;

inline constexpr double nanometres_per_metre = 1e9;

/// An orthonormal frame of a plane; x cross y = normal.
struct PlaneFrame {
    glm::dvec3 origin_m{};
    glm::dvec3 x{1, 0, 0};
    glm::dvec3 y{0, 1, 0};
    glm::dvec3 normal{0, 0, 1};

    PlanePoint to_plane(const glm::dvec3& point_m) const;  ///< nearest point of the plane, rounded to 1 nm
    glm::dvec3 to_world(const PlanePoint& point) const;    ///< m
};

/// A frame with its origin and normal given; the axes follow a fixed rule.
PlaneFrame make_plane_frame(const glm::dvec3& origin_m, const glm::dvec3& normal);

Region unite(const Region& a, const Region& b);
Region intersect(const Region& a, const Region& b);
Region subtract(const Region& a, const Region& b);

/// The region grown (distance > 0) or shrunk (distance < 0) by a distance, with mitred corners.
Region offset(const Region& region, double distance_m);

/// m2; holes count negative.
double area_m2(const Region& region);
double area_m2(const Ring& ring);

/// True inside or on the outline.
bool contains(const Region& region, const PlanePoint& point);

/// The connected parts of a region, each an outer ring followed by its holes.
std::vector<Region> connected_parts(const Region& region);

/// The convex hull of points, counter-clockwise, without corners on its edges; empty if they lie on a line.
Ring convex_hull(Ring points);

/// Cuts a region into convex rings, counter-clockwise, whose corners are corners of the region where possible. They cover it without
/// overlap; parts narrower than 2 nm are dropped.
std::vector<Ring> convex_parts(const Region& region);

/// Without rings that are narrower than 2 nm: rounding leaves such slivers behind.
Region without_slivers(const Region& region);

}  // namespace naturel
