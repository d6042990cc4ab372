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
    explicit PatchSums(std::size_t patch_count)
        : sums_((patch_count + block) / block * block, 0.0), touched_(sums_.size() / block, 0), patch_count_(patch_count) {}

    /// patch: its number, or the number of patches for what is lost.
    void add(std::size_t patch, double weight) {
        sums_[patch] += weight;
        touched_[patch / block] = 1;
    }
    /// Appends scale times the sums that are not 0, in patch order, adds what was lost, and clears all.
    void move_to(FormFactorRow& row, double scale);

private:
    static constexpr std::size_t block = 64;
    std::vector<double> sums_;
    std::vector<std::uint8_t> touched_;  ///< for each block of patches: a store costs less than setting a bit
    std::size_t patch_count_;
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

    /// Adds the weights of all cells of a plane to the patches that they show; cells that show nothing, a back or a facet that
    /// exchanges no light are lost.
    void add_cells(const ItemBuffer& buffer, const ProjectionCells& cells, PatchSums& sums, Scratch& scratch) const;

private:
    /// Distance inside an edge of a patch, m: s times the column of the grid + t times its row + one.
    struct Edge {
        double s = 0.0, t = 0.0, one = 0.0;
    };
    /// What a patch has of a cell of the grid: all that lies inside those of its edges that cut the cell.
    struct Part {
        std::size_t patch;
        std::uint32_t first_edge, edge_count;
    };
    /// A cell of the grid that several patches share; without parts: its corner was cut off and no patch is in it.
    struct CutCell {
        std::uint32_t first_part, part_count;
    };
    /// A run of cells that show one cell of the grid.
    struct CutRun {
        CutCell cell;
        FacetId facet;  ///< under the first one
        int begin, end;
        double y;
        const float* x;
        const double* running_weight;
    };
    void cut(std::size_t cell);
    void find_lines(const ItemBuffer::Entry& entry, const Projection& projection, Scratch::FacetLines& lines) const;
    void add_cut_run(const CutRun& run, const Scratch::FacetLines& lines, const Projection& projection, PatchSums& sums) const;

    const FacetSet& facets_;
    const PatchGrid& grid_;
    /// [cells of the grid, and one more for what is lost]: number of the patch, or -1 - k for cut_cells_[k]
    std::vector<std::int32_t> patch_of_cell_;
    std::vector<CutCell> cut_cells_;
    std::vector<Part> parts_;
    std::vector<Edge> edges_;
};

}  // namespace naturel
