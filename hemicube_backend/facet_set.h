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
        bool exchanges_light = false;  ///< its patches have form factors: indoor facets and apertures
        std::uint32_t first_vertex = 0, vertex_count = 0;
    };

    explicit FacetSet(const Building& building);

    const Item& operator[](FacetId facet) const { return items_[index(facet)]; }
    std::size_t size() const { return items_.size(); }
    std::span<const glm::dvec3> vertices_of(const Item& item) const {
        return {vertices_m_.data() + item.first_vertex, item.vertex_count};
    }

private:
    void merge_coplanar();

    std::vector<Item> items_;
    std::vector<glm::dvec3> vertices_m_;
};

enum class ApertureDrawing {
    surfaces,     ///< apertures hide what is behind them: form factors
    transparent,  ///< apertures are left out: first seen facet, pictures
};

/// The facets that may be seen from a point, in drawing order. Where two lie at the same depth the first
/// drawn stays: those that face the viewpoint come before those seen from behind (the two sides of a
/// two-sided polygon are coplanar), then the smaller FacetId.
struct FacetsAround {
    struct Entry {
        FacetId facet{};
        bool from_behind = false;
        double winding = 1.0;  ///< 1 if the vertices go clockwise as seen from the viewpoint, else -1
        glm::dvec3
            inverse_depth{};  ///< the ray viewpoint + t d meets the plane at 1 / t = dot(inverse_depth, d)
    };
    glm::dvec3 viewpoint_m{};
    std::vector<Entry> entries;
    /// From FacetId to position in entries; only those of `entries` are valid.
    std::vector<std::uint32_t> entry_of;
    std::vector<Entry> behind;  ///< scratch of collect()

    const Entry& operator[](FacetId facet) const { return entries[entry_of[index(facet)]]; }

    /// horizon_normal: only what is above the plane through the viewpoint is seen; zero: no horizon.
    void collect(const FacetSet& facets, const glm::dvec3& viewpoint_m, const glm::dvec3& horizon_normal,
                 ApertureDrawing apertures);
};

}  // namespace naturel
