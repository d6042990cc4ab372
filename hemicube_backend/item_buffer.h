#pragma once
#include <span>
#include <vector>

#include "hemicube_backend/facet_set.h"
#include "hemicube_backend/projection_cells.h"

namespace naturel {

/// How a plane of a projection lies in the world: orthonormal, right x up = forward. x of its cells follows
/// `right`, y follows `up`, and the point (x, y) lies in the direction x right + y up + forward.
struct ProjectionAxes {
    glm::dvec3 right{}, up{}, forward{};
};

/// What each cell of a plane of a projection shows: the facet that is nearest in the direction of the cell's
/// centre. Scratch memory: drawing again allocates nothing once warm.
class ItemBuffer {
public:
    /// Draws rows [row_begin, row_end) of `cells`. Facets may surround the viewpoint; nothing needs to be
    /// clipped. docs/hemicube.md, "Item buffer".
    void draw(const FacetSet& facets, const FacetsAround& around, const ProjectionAxes& axes,
              const ProjectionCells& cells, int row_begin, int row_end);
    void draw(const FacetSet& facets, const FacetsAround& around, const ProjectionAxes& axes,
              const ProjectionCells& cells) {
        draw(facets, around, axes, cells, 0, cells.rows);
    }

    /// [columns], none where a cell shows nothing; row in [row_begin, row_end) of the last draw().
    std::span<const FacetId> row(int row) const {
        return {items_.data() + static_cast<std::size_t>(row - row_begin_) * columns_, columns_};
    }

private:
    void draw_facet(const FacetsAround::Entry& entry, std::span<const glm::dvec3> vertices_m,
                    const glm::dvec3& viewpoint_m, const ProjectionAxes& axes, const ProjectionCells& cells,
                    int row_end);

    int row_begin_ = 0;
    std::size_t columns_ = 0;
    std::vector<FacetId> items_;        ///< [rows x columns]
    std::vector<float> inverse_depth_;  ///< the same; 0 is infinitely far
    std::vector<glm::dvec3> corners_;   ///< of the facet being drawn, along the axes
    std::vector<double> left_, right_;  ///< [rows], ends of the facet being drawn
};

}  // namespace naturel
