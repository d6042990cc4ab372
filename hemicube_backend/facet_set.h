#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/building.h"

namespace naturel {

/// A facet nearer to the plane of the viewpoint than this, in metres, is seen edge-on, i.e. not at all. It is
/// 100 times the 1 nm to which geometry is rounded, and 100 times less than the 10 micrometres by which
/// points are lifted off surfaces.
inline constexpr double edge_on_m = 1e-7;

/// A copy of a building's facets, ready to be drawn.
class FacetSet {
public:
    struct Item {
        glm::dvec3 plane_normal{};  ///< dot(plane_normal, p) = plane_offset_m in the plane; the same bits for
                                    ///< coplanar facets
        double plane_offset_m = 0.0;
        double side = 1.0;  ///< 1 if the facet faces along plane_normal, else -1
        glm::dvec3 centre_m{};
        double radius_m = 0.0;  ///< of a sphere around the facet
        FaceId face{};
        bool is_aperture = false;
        bool faces_a_twin = false;     ///< lies on the back of an equal facet: one half of an inner aperture
        bool closes_solid = false;     ///< opaque, with a solid behind it: from air its back is hidden by the rest of the solid
        bool exchanges_light = false;  ///< its patches have form factors: indoor facets and apertures
        std::uint32_t first_vertex = 0, vertex_count = 0;
    };

    explicit FacetSet(const Building& building);

    const Item& operator[](FacetId facet) const { return items_[index(facet)]; }
    std::size_t size() const { return items_.size(); }
    std::span<const glm::dvec3> vertices_of(const Item& item) const {
        return {vertices_m_.data() + item.first_vertex, item.vertex_count};
    }

    /// A node of the tree of facets: a box around its facets, and two children or, in a leaf, the facets.
    struct Node {
        glm::dvec3 centre_m{}, half_size_m{};
        std::uint32_t first = 0;  ///< leaf: facets leaf_facets()[first, first + count); else children first, first + 1
        std::uint32_t count = 0;  ///< 0: not a leaf
        bool has_opaque = false, has_apertures = false;
    };
    /// The root is the first; empty without facets.
    const std::vector<Node>& tree() const { return tree_; }
    const std::vector<FacetId>& leaf_facets() const { return leaf_facets_; }

private:
    void merge_coplanar();
    void build_tree();
    void split(std::size_t node, std::uint32_t begin, std::uint32_t end);

    std::vector<Item> items_;
    std::vector<glm::dvec3> vertices_m_;
    std::vector<Node> tree_;
    std::vector<FacetId> leaf_facets_;
};

/// Which facets are drawn.
enum class FacetKind {
    opaque,     ///< all but apertures: what is seen first, pictures
    apertures,  ///< on top of the opaque ones: form factors
    all,
    all_from_air,  ///< all but backs of solids, which cannot be seen if the viewpoint is known to be in air
};

}  // namespace naturel
