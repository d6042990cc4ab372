#include "core/facet_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace naturel {
namespace {

/// Facets are made on coordinates of 1 nm (core/planar_region.h): what reaches less far into a view only touches it.
constexpr double touch_m = 2e-9;
constexpr double edge_on_m = 1e-9;
constexpr std::uint32_t most_in_a_leaf = 4;

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

}  // namespace

FacetTree::FacetTree(const Building& building) {
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture) continue;
        glm::dvec3 low = facet.vertices_m.front(), high = low;
        for (const glm::dvec3& vertex : facet.vertices_m) low = glm::min(low, vertex), high = glm::max(high, vertex);
        leaves_.push_back({.normal = facet.normal,
                           .offset_m = glm::dot(facet.normal, facet.vertices_m.front()),
                           .first_vertex = static_cast<std::uint32_t>(vertices_m_.size()),
                           .vertex_count = static_cast<std::uint32_t>(facet.vertices_m.size()),
                           .sheet = building.faces[index(facet.face)].sheet,
                           .box = {0.5 * (low + high), 0.5 * (high - low)}});
        vertices_m_.insert(vertices_m_.end(), facet.vertices_m.begin(), facet.vertices_m.end());
    }
    if (!leaves_.empty()) grow(0, static_cast<std::uint32_t>(leaves_.size()));
}

std::uint32_t FacetTree::grow(std::uint32_t first, std::uint32_t end) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low, low_centre = low, high_centre = high;
    for (std::uint32_t i = first; i < end; ++i) {
        const Box& box = leaves_[i].box;
        low = glm::min(low, box.centre_m - box.half_m), high = glm::max(high, box.centre_m + box.half_m);
        low_centre = glm::min(low_centre, box.centre_m), high_centre = glm::max(high_centre, box.centre_m);
    }
    const auto branch = static_cast<std::uint32_t>(branches_.size());
    branches_.push_back({.box = {0.5 * (low + high), 0.5 * (high - low)}, .first = first, .end = end});
    if (end - first <= most_in_a_leaf) return branch;
    const glm::dvec3 spread = high_centre - low_centre;
    const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
    const std::uint32_t middle = first + (end - first) / 2;
    std::nth_element(leaves_.begin() + first, leaves_.begin() + middle, leaves_.begin() + end, [&](const Leaf& a, const Leaf& b) {
        const double x = a.box.centre_m[axis], y = b.box.centre_m[axis];
        return x != y ? x < y : a.first_vertex < b.first_vertex;
    });
    grow(first, middle);
    branches_[branch].right = grow(middle, end);
    return branch;
}

void FacetTree::find(const glm::dvec3& from_m, std::span<const glm::dvec3> inwards, std::vector<Found>& found) const {
    found.clear();
    if (branches_.empty()) return;
    const auto outside = [&](const Box& box) {
        const glm::dvec3 centre = box.centre_m - from_m;
        for (const glm::dvec3& inward : inwards) {
            const double reach = std::abs(inward.x) * box.half_m.x + std::abs(inward.y) * box.half_m.y + std::abs(inward.z) * box.half_m.z;
            if (glm::dot(inward, centre) + reach <= touch_m) return true;
        }
        return false;
    };
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const std::uint32_t id = stack[--depth];
        const Branch& branch = branches_[id];
        if (outside(branch.box)) continue;
        if (branch.right != 0) {
            stack[depth++] = branch.right;
            stack[depth++] = id + 1;
            continue;
        }
        for (std::uint32_t leaf = branch.first; leaf < branch.end; ++leaf) look_at(leaf, from_m, inwards, found);
    }
    std::sort(found.begin(), found.end(), [&](const Found& a, const Found& b) {
        return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : leaves_[a.facet].first_vertex < leaves_[b.facet].first_vertex;
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
