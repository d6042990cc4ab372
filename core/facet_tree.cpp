#include "core/facet_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace naturel {
namespace {

/// Facets are made on coordinates of 1 nm (core/planar_region.h): what reaches less far into a view only touches it.
constexpr double touch_m = 2e-9;
constexpr double edge_on_m = 1e-9;

/// Distance from the origin to a convex polygon whose plane is `height_m` away.
double distance_m(std::span<const glm::dvec3> polygon, const glm::dvec3& from_m, const glm::dvec3& normal, double height_m) {
    bool over = true;  // the foot of the perpendicular is in the polygon
    double nearest_squared = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const glm::dvec3 a = polygon[k] - from_m;
        const glm::dvec3 edge = polygon[k + 1 < polygon.size() ? k + 1 : 0] - polygon[k];
        if (glm::dot(glm::cross(normal, edge), a) > 0.0) over = false;
        const double share = std::clamp(-glm::dot(a, edge) / glm::dot(edge, edge), 0.0, 1.0);
        const glm::dvec3 nearest = a + share * edge;
        nearest_squared = std::min(nearest_squared, glm::dot(nearest, nearest));
    }
    return over ? std::abs(height_m) : std::sqrt(nearest_squared);
}

std::vector<Box> boxes_of_opaque(const Building& building) {
    std::vector<Box> boxes;
    for (const Facet& facet : building.facets)
        if (!facet.is_aperture) boxes.push_back(box_around(facet.vertices_m, 0.0));
    return boxes;
}

}  // namespace

FacetTree::FacetTree(const Building& building) : boxes_(boxes_of_opaque(building)) {
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture) continue;
        leaves_.push_back({.normal = facet.normal,
                           .offset_m = glm::dot(facet.normal, facet.vertices_m.front()),
                           .first_vertex = static_cast<std::uint32_t>(vertices_m_.size()),
                           .vertex_count = static_cast<std::uint32_t>(facet.vertices_m.size()),
                           .sheet = building.faces[index(facet.face)].sheet});
        vertices_m_.insert(vertices_m_.end(), facet.vertices_m.begin(), facet.vertices_m.end());
    }
}

void FacetTree::find(const glm::dvec3& from_m, std::span<const glm::dvec3> inwards, std::vector<Found>& found) const {
    found.clear();
    const auto reaches_in = [&](const Box& box) {
        for (const glm::dvec3& inward : inwards) {
            const glm::dvec3 farthest{inward.x > 0.0 ? box.high_m.x : box.low_m.x, inward.y > 0.0 ? box.high_m.y : box.low_m.y,
                                      inward.z > 0.0 ? box.high_m.z : box.low_m.z};
            if (glm::dot(inward, farthest - from_m) <= touch_m) return false;
        }
        return true;
    };
    boxes_.for_each(reaches_in, [&](std::uint32_t leaf) { look_at(leaf, from_m, inwards, found); });
    std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
        return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.facet < b.facet;
    });
}

void FacetTree::look_at(std::uint32_t id, const glm::dvec3& from_m, std::span<const glm::dvec3> inwards, std::vector<Found>& found) const {
    const Leaf& leaf = leaves_[id];
    const double height_m = glm::dot(leaf.normal, from_m) - leaf.offset_m;
    if (height_m < edge_on_m && (!leaf.sheet || height_m > -edge_on_m)) return;
    const std::span<const glm::dvec3> polygon = vertices_of(id);
    for (const glm::dvec3& inward : inwards) {
        bool meets = false;
        for (const glm::dvec3& vertex : polygon) meets = meets || glm::dot(inward, vertex - from_m) > touch_m;
        if (!meets) return;
    }
    found.push_back({id, distance_m(polygon, from_m, leaf.normal, height_m), height_m});
}

}  // namespace naturel
