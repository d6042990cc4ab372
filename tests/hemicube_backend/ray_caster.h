#pragma once
#include <glm/geometric.hpp>
#include <limits>

#include "core/building.h"
#include "core/view.h"

namespace naturel::tests {

/// What one ray meets, by trying every facet: slow and plain.
struct RayHit {
    FacetId facet = FacetId::none;
    double distance = std::numeric_limits<double>::infinity();
    /// Distance, as an angle, from the ray to the nearest edge that could have changed the answer, and
    /// relative distance to the next surface behind: where either is small, rounding may decide.
    double edge_margin_rad = std::numeric_limits<double>::infinity();
    double depth_margin = std::numeric_limits<double>::infinity();
};

/// direction: unit length. Apertures let rays pass unless with_apertures. Only what is in reach is met, if it is not seen
/// through.
inline RayHit cast_ray(const Building& building, const glm::dvec3& origin_m, const glm::dvec3& direction,
                       bool with_apertures = false,
                       const Camera::Reach& reach = {0.0, std::numeric_limits<double>::infinity(), false},
                       SeeThrough see_through = SeeThrough::nothing) {
    RayHit hit;
    for (std::size_t i = 0; i < building.facets.size(); ++i) {
        const Facet& facet = building.facets[i];
        if (facet.is_aperture && !with_apertures) continue;
        const double height_m = glm::dot(facet.normal, origin_m - facet.vertices_m[0]);
        const double approach = -glm::dot(facet.normal, direction);
        if (std::abs(height_m) < 1e-7 || approach * height_m <= 0) continue;
        if (see_through != SeeThrough::nothing && approach < 0) continue;
        if (see_through == SeeThrough::walls && facet.environment == Environment::outdoor) continue;
        const double distance = height_m / approach;
        if (distance < reach.begin_m || distance > reach.end_m) continue;
        const glm::dvec3 point_m = origin_m + distance * direction;
        double inside_rad = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < facet.vertices_m.size(); ++k) {
            const glm::dvec3& a = facet.vertices_m[k];
            const glm::dvec3& b = facet.vertices_m[(k + 1) % facet.vertices_m.size()];
            const double across_m = glm::dot(glm::normalize(glm::cross(facet.normal, b - a)), point_m - a);
            inside_rad = std::min(inside_rad, across_m / distance * std::abs(approach));
        }
        if (std::abs(inside_rad) < hit.edge_margin_rad) hit.edge_margin_rad = std::abs(inside_rad);
        if (inside_rad < 0) continue;
        hit.depth_margin = std::min(hit.depth_margin, std::abs(distance / hit.distance - 1));
        if (distance < hit.distance) {
            hit.distance = distance;
            hit.facet = make_id<FacetId>(i);
        }
    }
    return hit;
}

}  // namespace naturel::tests
