#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace naturel {

/// A_a F_ab = A_b F_ba of two plane convex polygons that nothing stands between, m2, good to 1e-9 of the smaller square of a
/// side. The polygons may touch, share an edge, be cut by each other's plane (what lies behind it does not count) and be of any
/// size and distance. Vertices counter-clockwise seen from the front; a normal is of unit length and points there.
/// Source: contour integral (docs/method.md, "Pairs of patches").
double unoccluded_exchange_m2(std::span<const glm::dvec3> a, const glm::dvec3& normal_a, std::span<const glm::dvec3> b,
                              const glm::dvec3& normal_b);

/// The part of a convex polygon in front of a plane, where dot(normal, p) >= plane_m; empty when less than a triangle is left.
/// A vertex within `on_plane_m` of the plane is on it, and kept.
void keep_front(std::span<const glm::dvec3> polygon, const glm::dvec3& normal, double plane_m, double on_plane_m,
                std::vector<glm::dvec3>& kept);

}  // namespace naturel
