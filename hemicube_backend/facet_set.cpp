#include "hemicube_backend/facet_set.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
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
        item.closes_solid = !facet.is_aperture && !building.faces[index(facet.face)].sheet;
        item.exchanges_light = facet.is_aperture || facet.environment == Environment::indoor;
        item.first_vertex = static_cast<std::uint32_t>(vertices_m_.size());
        item.vertex_count = static_cast<std::uint32_t>(facet.vertices_m.size());
        vertices_m_.insert(vertices_m_.end(), facet.vertices_m.begin(), facet.vertices_m.end());
        items_.push_back(item);
    }
    merge_coplanar();
    build_tree();
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

void FacetSet::build_tree() {
    for (std::size_t i = 0; i < items_.size(); ++i) leaf_facets_.push_back(make_id<FacetId>(i));
    if (items_.empty()) return;
    tree_.emplace_back();
    split(0, 0, static_cast<std::uint32_t>(items_.size()));
}

/// Halves the facets at the median of their centres along the longest side of the box of the centres.
void FacetSet::split(std::size_t node, std::uint32_t begin, std::uint32_t end) {
    constexpr std::uint32_t leaf_size = 4;
    constexpr double everything = std::numeric_limits<double>::max();
    glm::dvec3 low_m(everything), high_m(-everything), low_centre_m(everything), high_centre_m(-everything);
    Node box;
    for (std::uint32_t k = begin; k < end; ++k) {
        const Item& item = (*this)[leaf_facets_[k]];
        for (const glm::dvec3& vertex_m : vertices_of(item)) {
            low_m = glm::min(low_m, vertex_m);
            high_m = glm::max(high_m, vertex_m);
        }
        low_centre_m = glm::min(low_centre_m, item.centre_m);
        high_centre_m = glm::max(high_centre_m, item.centre_m);
        (item.is_aperture ? box.has_apertures : box.has_opaque) = true;
    }
    box.centre_m = 0.5 * (low_m + high_m);
    box.half_size_m = 0.5 * (high_m - low_m);
    if (end - begin <= leaf_size) {
        box.first = begin;
        box.count = end - begin;
        tree_[node] = box;
        return;
    }
    const glm::dvec3 size_m = high_centre_m - low_centre_m;
    const int axis = size_m.x >= size_m.y ? (size_m.x >= size_m.z ? 0 : 2) : (size_m.y >= size_m.z ? 1 : 2);
    const std::uint32_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::uint32_t k) { return leaf_facets_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end), [&](FacetId a, FacetId b) {
        const double p = (*this)[a].centre_m[axis], q = (*this)[b].centre_m[axis];
        return p < q || (p == q && a < b);
    });
    box.first = static_cast<std::uint32_t>(tree_.size());
    tree_[node] = box;
    tree_.resize(tree_.size() + 2);
    split(box.first, begin, middle);
    split(box.first + 1, middle, end);
}

}  // namespace naturel
