#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "core/patch_grid.h"
#include "core/visibility.h"
#include "hemicube_backend/cell_kernels.h"
#include "hemicube_backend/item_buffer.h"

namespace naturel {

/// Form factors summed per patch. Sparse: clearing costs little more than what was touched.
class PatchSums {
public:
    explicit PatchSums(std::size_t patch_count) : sums_(patch_count, 0.0), touched_((patch_count + 63) / 64, 0) {}

    void add(PatchId patch, double weight) {
        sums_[index(patch)] += weight;
        touched_[index(patch) / 64] |= std::uint64_t{1} << index(patch) % 64;
    }
    /// Appends scale times the sums, in patch order, and clears them.
    void move_to(FormFactorRow& row, double scale);

private:
    std::vector<double> sums_;
    std::vector<std::uint64_t> touched_;  ///< a bit per patch
};

/// From the facets in an item buffer to the patches of the grid (docs/hemicube.md, "From facets to patches").
class PatchLookup {
public:
    PatchLookup(const FacetSet& facets, const PatchGrid& grid);

    struct Scratch {
        /// What the rows of a plane need to know of a facet; all are linear in x and y.
        struct FacetLines {
            glm::dvec3 s{}, t{}, w{};  ///< column, row and 1 of the grid times w: the parts of x, y and 1
            const PatchGrid::FaceGrid* grid = nullptr;
            bool known = false;
        };
        std::vector<FacetLines> lines;  ///< [entries of the item buffer]
        std::vector<std::int32_t> grid_cells, facet_ends, cell_ends;
    };

    /// Adds the weights of all cells of a plane to the patches that they show; returns the share of those that show nothing, a
    /// back or a facet that exchanges no light.
    double add_cells(const ItemBuffer& buffer, const ProjectionCells& cells, PatchSums& sums, Scratch& scratch) const;

private:
    struct Edge {
        glm::dvec3 inward{};  ///< unit length; dot(inward, p) >= offset_m on the side of the patch
        double offset_m = 0.0;
    };
    void find_lines(const ItemBuffer::Entry& entry, const Projection& projection, Scratch::FacetLines& lines) const;
    PatchId patch_at(std::size_t cell, FaceId face, const glm::dvec3& point_m) const;
    double exit(PatchId patch, const ItemBuffer::Entry& entry, const Projection& projection, double y) const;

    const FacetSet& facets_;
    const PatchGrid& grid_;
    std::vector<PatchId> only_patch_;  ///< [cells of the grid]; none: several, or no patch at all
    std::vector<Edge> edges_;
    std::vector<std::uint32_t> first_edge_;  ///< edges of patch i: [first_edge_[i], first_edge_[i + 1])
};

}  // namespace naturel
