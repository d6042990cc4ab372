#pragma once
#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/view.h"
#include "hemicube_backend/hemicube_visibility.h"

namespace naturel {

/// Blocks of cells for which an item buffer knows the farthest depth. As wide as what a kernel works on.
inline constexpr int tile_rows = 8, tile_columns = 16;

/// How one plane of a projection is divided into cells. The plane lies at distance 1 before the viewpoint;
/// rows follow its coordinate y and columns its coordinate x, both increasing.
struct ProjectionCells {
    int columns = 0, rows = 0;
    double columns_per_unit = 0.0;      ///< of uniform columns
    bool uniform = true;                ///< every row has the same, equally wide columns
    std::vector<double> row_lines;      ///< [rows + 1]
    std::vector<double> row_centres;    ///< [rows]
    std::vector<double> column_lines;   ///< [columns + 1]; unless uniform, for each row
    std::vector<float> column_centres;  ///< [columns]; unless uniform, for each row; then some that may be read
    struct Tile {
        double x_begin = 0.0, x_end = 0.0;  ///< what its rows reach at most
    };
    std::vector<Tile> tiles;  ///< [ceil(rows / tile_rows) x tiles_per_row]
    std::size_t tiles_per_row = 0;
    /// Form factors of the cells [0, k) of each row from the viewpoint, plus a constant of the row; [rows x
    /// (columns + 1)]. Empty where cells are only looked at (pictures).
    std::vector<double> running_weight;

    std::span<const double> lines_of(int row) const {
        const auto count = static_cast<std::size_t>(columns) + 1;
        return {column_lines.data() + (uniform ? 0 : static_cast<std::size_t>(row) * count), count};
    }
    /// Lines before the first and after the last column.
    std::pair<double, double> x_extent() const { return {column_lines.front(), column_lines.back()}; }
    /// The larger distance of a line from an axis.
    double reach() const {
        return std::max({-column_lines.front(), column_lines.back(), -row_lines.front(), row_lines.back()});
    }

    std::span<const float> centres_of(int row) const {
        const auto count = static_cast<std::size_t>(columns);
        return {column_centres.data() + (uniform ? 0 : static_cast<std::size_t>(row) * count), count};
    }

    /// Number of columns of a row whose centre is left of x. guess: where to look first, in [0, columns]; the
    /// answer does not depend on it.
    int columns_before(int row, double x, int guess) const {
        if (!uniform) {
            const float* const centres = centres_of(row).data();
            while (guess < columns && centres[guess] < x)
                ++guess;
            while (guess > 0 && !(centres[guess - 1] < x))
                --guess;
            return guess;
        }
        const double position = (x - column_lines.front()) * columns_per_unit - 0.5;
        if (!(position > 0)) return 0;
        if (position >= columns) return columns;
        const int whole = static_cast<int>(position);
        return whole + (position > whole ? 1 : 0);
    }

    /// The cell that contains a point; one outside the plane's cells by rounding counts to the outermost.
    int row_of(double y) const;
    int column_of(int row, double x) const;

    /// Form factor of the cells [begin, end) of a row; exact (docs/hemicube.md, eq. 3 and 4).
    double weight(int row, int begin, int end) const { return running_weight_of(row)[end] - running_weight_of(row)[begin]; }
    const double* running_weight_of(int row) const {
        return running_weight.data() + static_cast<std::size_t>(row) * (static_cast<std::size_t>(columns) + 1);
    }
};

/// Top of a half cube of half side 1: resolution x resolution cells.
ProjectionCells hemicube_top_cells(int resolution);

/// One of its four sides: x horizontal in [-1, 1], y in [0, 1] along the normal; resolution x resolution / 2
/// cells (rounded up).
ProjectionCells hemicube_side_cells(int resolution);

/// A square of half side `half_side` at distance 1: resolution x resolution cells.
ProjectionCells single_plane_cells(int resolution, double half_side, CellSpacing spacing);

/// What a single plane leaves open on one side, between its rim and the horizon: x in [-1, 1], y in [0, 1 /
/// half_side].
ProjectionCells rim_cells(int resolution, double half_side);

/// The pixels of a camera: x to the right, y downwards.
ProjectionCells picture_cells(const Camera& camera);

/// The widest angle that a cell is seen under from the viewpoint, along a row or across, rad: the finest detail that the plane
/// can show everywhere.
double widest_cell_rad(const ProjectionCells& cells);

}  // namespace naturel
