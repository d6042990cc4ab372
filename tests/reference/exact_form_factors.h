#pragma once
#include <glm/vec3.hpp>
#include <span>

namespace naturel::reference {

/// A rectangle with edges along two axes of its plane.
struct Interval {
    double low = 0.0, high = 0.0;
};

/// Form factor between parallel rectangles x1 x y1 and x2 x y2 at a distance, sides parallel, in general
/// position. Source: Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", C-13.
double parallel_rectangles(Interval x1, Interval y1, Interval x2, Interval y2, double distance);

/// Form factor from the rectangle x1 x y1 of the plane z = 0 to the rectangle y2 x z2 of the plane x = 0, in
/// general position (x1, z2 >= 0). Source: Howell, C-17.
double perpendicular_rectangles(Interval x1, Interval y1, Interval y2, Interval z2);

/// Between two faces of a cube. Sources: the two above; a row of a cube is one opposed and four adjacent
/// faces.
inline constexpr double cube_opposed = 0.199824896;
inline constexpr double cube_adjacent = 0.200043776;

/// Form factor from one polygon to another that see all of each other, by the contour integral
/// F = 1 / (2 pi A_1) closed integral over both outlines of ln r dr_1 . dr_2: over the second in closed form,
/// over the first by tanh-sinh quadrature, which bears polygons that share a corner or an edge. Good to 1e-9.
/// Vertices counter-clockwise seen from the front.
double polygon_to_polygon(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to);

/// Form factor from a point with a unit normal to a polygon that is all above its horizon (Lambert 1760).
double point_to_polygon(const glm::dvec3& point, const glm::dvec3& normal,
                        std::span<const glm::dvec3> polygon);

}  // namespace naturel::reference
