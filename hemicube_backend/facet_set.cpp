#include "hemicube_backend/facet_set.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace naturel {
namespace {

/// Normals of planes that are taken for one differ by less than this; their points by less than edge_on_m.
constexpr double same_direction = 1e-7;

/// Any direction that no wall has: tells the two normals of a plane apart, and planes from each other.
constexpr glm::dvec3 odd_direction{0.5411961, 0.7071823, 0.4549875};

}  // namespace

FacetSet::FacetSet(const Building& building) {
    items_.reserve(building.facets.size());
    for (const Facet& facet : building.facets) {
        Item item;
        item.side = glm::dot(facet.normal, odd_direction) > 0 ? 1.0 : -1.0;
        item.plane_normal = item.side * facet.normal;
        for (const glm::dvec3& vertex_m : facet.vertices_m) {
            item.centre_m += vertex_m / static_cast<double>(facet.vertices_m.size());
        }
        for (const glm::dvec3& vertex_m : facet.vertices_m) {
            item.radius_m = std::max(item.radius_m, glm::distance(item.centre_m, vertex_m));
        }
        item.plane_offset_m = glm::dot(item.plane_normal, item.centre_m);
        item.face = facet.face;
        item.is_aperture = facet.is_aperture;
        item.faces_a_twin = facet.is_aperture && building.faces[index(facet.face)].other_side.has_value();
        item.exchanges_light = facet.is_aperture || facet.environment == Environment::indoor;
        item.first_vertex = static_cast<std::uint32_t>(vertices_m_.size());
        item.vertex_count = static_cast<std::uint32_t>(facet.vertices_m.size());
        vertices_m_.insert(vertices_m_.end(), facet.vertices_m.begin(), facet.vertices_m.end());
        items_.push_back(item);
    }
    merge_coplanar();
}

/// Gives coplanar facets the same plane to the last bit, so that their depths tie exactly where they meet or
/// overlap.
void FacetSet::merge_coplanar() {
    const auto key = [&](std::size_t i) {  // nearly equal planes have nearly equal keys
        return glm::dot(items_[i].plane_normal, odd_direction) + 0.1234567 * items_[i].plane_offset_m;
    };
    std::vector<std::size_t> order(items_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    std::vector<double> keys;
    for (const std::size_t i : order)
        keys.push_back(key(i));

    for (std::size_t k = 0; k < order.size(); ++k) {
        Item& item = items_[order[k]];
        const std::span<const glm::dvec3> vertices_m = vertices_of(item);
        const double reach_m = 1 + glm::length(item.centre_m);
        const double key_tolerance = 2 * (same_direction * reach_m + edge_on_m);
        for (std::size_t before = k; before-- > 0 && keys[k] - keys[before] < key_tolerance;) {
            const Item& other = items_[order[before]];
            const bool coplanar =
                glm::distance(item.plane_normal, other.plane_normal) < same_direction &&
                std::all_of(vertices_m.begin(), vertices_m.end(), [&](const glm::dvec3& vertex_m) {
                    return std::abs(glm::dot(other.plane_normal, vertex_m) - other.plane_offset_m) <
                           edge_on_m;
                });
            if (!coplanar) continue;
            item.plane_normal = other.plane_normal;
            item.plane_offset_m = other.plane_offset_m;
            break;
        }
    }
}

void FacetsAround::collect(const FacetSet& facets, const glm::dvec3& point_m,
                           const glm::dvec3& horizon_normal, ApertureDrawing apertures) {
    viewpoint_m = point_m;
    entries.clear();
    behind.clear();
    entry_of.resize(facets.size());
    for (std::size_t i = 0; i < facets.size(); ++i) {
        const FacetSet::Item& item = facets[make_id<FacetId>(i)];
        if (item.is_aperture && apertures == ApertureDrawing::transparent) continue;
        if (glm::dot(item.centre_m - point_m, horizon_normal) < -item.radius_m) continue;
        const double distance_m = item.plane_offset_m - glm::dot(item.plane_normal, point_m);
        if (std::abs(distance_m) <= edge_on_m) continue;
        const double along = item.side * distance_m;  // > 0: the facet looks away
        if (item.faces_a_twin && along > 0) continue;
        const bool from_behind = along > 0;
        (from_behind ? behind : entries)
            .push_back({make_id<FacetId>(i), from_behind, from_behind ? 1.0 : -1.0,
                        (1 / distance_m) * item.plane_normal});
    }
    entries.insert(entries.end(), behind.begin(), behind.end());
    for (std::size_t k = 0; k < entries.size(); ++k)
        entry_of[index(entries[k].facet)] = static_cast<std::uint32_t>(k);
}

}  // namespace naturel
