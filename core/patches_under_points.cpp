#include "core/patches_under_points.h"

#include <glm/geometric.hpp>

namespace naturel {
namespace {

using glm::dvec3;

constexpr double touching_m = 1e-3;

std::vector<Box> boxes(const Building& building) {
    std::vector<Box> list;
    for (const Facet& facet : building.facets) list.push_back(box_around(facet.vertices_m, 2.0 * touching_m));
    return list;
}

}  // namespace

PatchesUnderPoints::PatchesUnderPoints(const Building& building, const PatchGrid& grid)
    : building_(building), grid_(grid), facets_(boxes(building)) {}

PatchId PatchesUnderPoints::patch_under(const GatherPoint& point, std::vector<std::uint32_t>& near) const {
    facets_.containing(point.position_m, near);
    for (const std::uint32_t f : near) {
        const Facet& facet = building_.facets[f];
        if (facet.environment != Environment::indoor || facet.is_aperture) continue;
        const double height = glm::dot(point.position_m - facet.vertices_m[0], facet.normal);
        if (height < 0.0 || height > touching_m || glm::dot(point.normal, facet.normal) < 1.0 - 1e-6) continue;
        bool inside = true;
        for (std::size_t i = 0; i < facet.vertices_m.size(); ++i) {
            const dvec3 edge = facet.vertices_m[(i + 1) % facet.vertices_m.size()] - facet.vertices_m[i];
            inside = inside && glm::dot(glm::cross(facet.normal, edge), point.position_m - facet.vertices_m[i]) >= 0.0;
        }
        if (inside) return grid_.patch_at(facet.face, point.position_m);
    }
    return PatchId::none;
}

}  // namespace naturel
