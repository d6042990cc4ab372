#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace naturel::pairwise {

/// Geometry is rounded to 1 nm: what is nearer to a plane than this lies in it.
inline constexpr double in_plane_m = 1e-7;

/// Four numbers that the compiler keeps in as few registers as the machine allows. Sums and products of a lane do not
/// depend on how many that are.
using Four [[gnu::vector_size(32)]] = double;

/// A convex polygon in space. Vertices counter-clockwise seen from the front.
struct Polygon {
    std::span<const glm::dvec3> vertices_m{};
    glm::dvec3 normal{};
    double plane_m = 0.0;  ///< dot(normal, p) of its points
};

/// A polygon that light meets from its front. At most 16 vertices: larger facets come in parts.
struct Occluder {
    glm::dvec3 normal{};
    double plane_m = 0.0;
    glm::dvec3 low_m{}, high_m{};  ///< box
    std::uint32_t first_vertex = 0, vertex_count = 0;
};
inline constexpr std::size_t most_vertices = 16;

/// A vertex list in groups of four, the last one filled up with its last vertex.
struct VertexQuad {
    Four x, y, z;
};

/// What one polygon P asks of an occluder, for many polygons Q: whether the lines from P to Q pass by each of its edges. Which
/// side of an edge (a, b) a line p q passes is the sign of
///     s(p, q) = ((b - a) . (q x p) + (a x b) . (p - q)) / |b - a|       > 0: inside
/// that is linear in p and in q, so that vertices decide for all points.
struct EdgeForm {
    double gx, gy, gz, g0;  ///< s = gx qx + gy qy + gz qz + g0 for one vertex p and one edge
};

struct Obstacle {
    std::uint32_t occluder = 0;
    std::uint32_t first_form = 0;  ///< [edges x vertices of P]
    std::uint32_t edges = 0;
    bool all_in_front = false;  ///< no vertex of P is behind the occluder's plane
    double nx = 0, ny = 0, nz = 0, plane_m = 0;
};

enum class Passage : std::uint8_t { clear, partial, blocked };

}  // namespace naturel::pairwise
