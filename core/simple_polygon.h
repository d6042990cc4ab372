#pragma once
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

namespace naturel {

/// m2, of a plane ring; holes do not count.
double polygon_area_m2(const std::vector<glm::dvec3>& vertices_m);

/// Why a polygon with holes cannot be used.
struct PolygonFault {
    std::optional<std::size_t> hole;  ///< the ring at fault; empty: the outline
    std::string text;                 ///< what is wrong (what would be right)
};

/// Most vertices of a polygon, holes included: crossing edges are looked for among all pairs.
inline constexpr std::size_t max_polygon_vertices = 2000;

/// Checks that outline and holes are plane (within 1 micrometre, or a millionth of the size if that is more),
/// that no two edges cross or touch but at a common corner, and that the holes lie inside the outline and
/// outside each other.
std::optional<PolygonFault> find_polygon_fault(const std::vector<glm::dvec3>& vertices_m,
                                               const std::vector<std::vector<glm::dvec3>>& holes_m);

}  // namespace naturel
