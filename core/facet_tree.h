#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/box_index.h"
#include "core/building.h"

namespace naturel {

/// The opaque facets of a building in a tree of boxes: finds those that reach into the view from a point through a polygon.
/// It says what may stand there; what is seen there only a Visibility says.
class FacetTree {
public:
    explicit FacetTree(const Building& building);

    /// A facet that may be seen. Its vertices are those of FacetTree::vertices_of().
    struct Found {
        std::uint32_t facet = 0;  ///< in the tree
        double distance_m = 0.0;  ///< of its nearest point
        double height_m = 0.0;    ///< of the observer over its plane, on the side of its normal; negative: seen from behind
    };

    /// Facets that a pyramid with its apex in a point meets, nearest first. Left out: those that turn their backs, unless they are
    /// sheets, which have no other side there; those within 1 nm of edge-on; those that only touch the pyramid.
    /// inwards: unit normals of the planes through the point that bound the pyramid, towards its inside. found: overwritten.
    void find(const glm::dvec3& from_m, std::span<const glm::dvec3> inwards, std::vector<Found>& found) const;

    /// Counter-clockwise seen from the air.
    std::span<const glm::dvec3> vertices_of(std::uint32_t facet) const {
        const Leaf& leaf = leaves_[facet];
        return {vertices_m_.data() + leaf.first_vertex, leaf.vertex_count};
    }
    const glm::dvec3& normal_of(std::uint32_t facet) const { return leaves_[facet].normal; }

private:
    struct Leaf {
        glm::dvec3 normal{};
        double offset_m = 0.0;
        std::uint32_t first_vertex = 0, vertex_count = 0;
        bool sheet = false;
    };
    void look_at(std::uint32_t leaf, const glm::dvec3& from_m, std::span<const glm::dvec3> inwards, std::vector<Found>& found) const;

    std::vector<Leaf> leaves_;
    std::vector<glm::dvec3> vertices_m_;
    BoxIndex boxes_;  ///< of the leaves
};

}  // namespace naturel
