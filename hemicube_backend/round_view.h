#pragma once
#include <span>
#include <vector>

#include "core/ids.h"
#include "core/view.h"
#include "hemicube_backend/facet_set.h"
#include "hemicube_backend/item_buffer.h"
#include "hemicube_backend/projection_cells.h"

namespace naturel {

/// Draws views that are no projection on a plane, fisheyes and panoramas: a few rows and columns of pixels after the other as a
/// perspective drawing of its own (docs/hemicube.md, "Pictures"). Scratch memory; one for each thread.
class RoundView {
public:
    /// As Visibility::view_facets().
    void draw(const FacetSet& facets, const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen);

private:
    /// Pixels of a picture.
    struct Block {
        int row_begin, row_end, column_begin, column_end;
    };
    void draw_block(const FacetSet& facets, const Camera& camera, const Block& block, int first_row, std::span<FacetId> seen);
    FacetId seen_along(const FacetSet& facets, const Camera& camera, const glm::dvec3& direction, const ProjectionCells& cells) const;

    ItemBuffer buffer_;
    std::vector<glm::dvec3> directions_;  ///< of the pixels of a block; zero outside the circle
};

}  // namespace naturel
