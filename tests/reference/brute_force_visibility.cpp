#include "tests/reference/brute_force_visibility.h"

#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

namespace naturel::tests {
namespace {

/// A surface nearer than this is the one the point lies on.
constexpr double own_surface_m = 1e-6;

bool covers(const Facet& facet, const glm::dvec3& point_m) {
    const std::size_t count = facet.vertices_m.size();
    for (std::size_t k = 0; k < count; ++k) {
        const glm::dvec3& a = facet.vertices_m[k];
        const glm::dvec3& b = facet.vertices_m[(k + 1) % count];
        if (glm::dot(glm::cross(b - a, point_m - a), facet.normal) < 0.0) return false;
    }
    return true;
}

}  // namespace

void BruteForceVisibility::first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                                      std::span<FacetId> seen) const {
    for (std::size_t i = 0; i < directions.size(); ++i) {
        seen[i] = FacetId::none;
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t f = 0; f < facets_.size(); ++f) {
            const Facet& facet = facets_[f];
            const double slope = glm::dot(facet.normal, directions[i]);
            if (facet.is_aperture || slope == 0.0) continue;
            const double distance = glm::dot(facet.normal, facet.vertices_m[0] - from.position_m) / slope;
            if (distance <= own_surface_m || distance >= nearest) continue;
            if (!covers(facet, from.position_m + distance * directions[i])) continue;
            nearest = distance;
            seen[i] = make_id<FacetId>(f);
        }
    }
}

void BruteForceVisibility::form_factor_row(PatchId, FormFactorRow&) const {
    throw std::logic_error("brute force visibility has no form factors");
}

void BruteForceVisibility::gather_row(const GatherPoint&, FormFactorRow&) const {
    throw std::logic_error("brute force visibility has no form factors");
}

void BruteForceVisibility::view_facets(const Camera&, int, int, std::span<FacetId>) const {
    throw std::logic_error("brute force visibility draws no pictures");
}

}  // namespace naturel::tests
