#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace naturel {

// Polygons of directions, as a point sees a plane polygon: the vertices are vectors from the point, of any length, and
// the edges are great circles. Counter-clockwise as the point sees them, and inside one hemisphere.

/// Integral of the unit direction over the polygon, sr. Its dot product with a surface normal is the projected solid
/// angle, so that a uniform luminance L gives the illuminance L x dot(normal, vector_solid_angle) exactly.
/// Source: Lambert 1760, half the sum over the edges of their angle times the unit normal of their plane;
/// docs/method.md, "Direct illuminance".
glm::dvec3 vector_solid_angle(std::span<const glm::dvec3> polygon);

/// Solid angle of a convex polygon, sr. Source: Van Oosterom & Strackee 1983, over a fan of triangles.
double solid_angle(std::span<const glm::dvec3> polygon);

/// The part of a convex polygon where dot(normal, direction) >= 0; empty when less than a triangle is left.
/// kept: overwritten; not the storage of `polygon`.
void keep_half_space(std::span<const glm::dvec3> polygon, const glm::dvec3& normal, std::vector<glm::dvec3>& kept);

}  // namespace naturel
