#pragma once
#include <cstdint>

namespace naturel {

/// Cells that a kernel may touch beyond the end of a row: it works on up to this many at a time. Rows of buffers are padded by
/// as many.
inline constexpr int kernel_lanes = 16;

/// What covers a cell, as a number that decides between equal depths: the smaller one stays. Facets that face the viewpoint
/// are negative and so come before those seen from behind (the two sides of a two-sided polygon are coplanar).
using ItemCode = std::int32_t;
inline constexpr ItemCode empty_item = 0x7fff'ffff;

/// One facet's part of some rows of an item buffer.
struct Spans {
    const int* first = nullptr;         ///< [rows] cells [first, last) of each row
    const int* last = nullptr;          ///< [rows]
    const double* at_origin = nullptr;  ///< [rows] depth at x = 0
    double by_x = 0.0;                  ///< change of the depth with x
    const float* x = nullptr;           ///< centres of the columns of the first row
    std::ptrdiff_t x_stride = 0;        ///< to those of the next row; 0 where all rows have the same
    float* depth = nullptr;             ///< first cell of the first row
    ItemCode* items = nullptr;          ///< the same
    std::ptrdiff_t stride = 0;          ///< to the next row
    ItemCode code = empty_item;
};

/// Keeps the larger depth in each cell; of two equal ones, the smaller code.
void draw_spans(const Spans& spans, int rows);

/// Where a line of directions, x to the right, meets the grid of a face: column s / w, row t / w, each s, t, w = at_0 + by_x x.
struct GridLine {
    float s_0, s_x, t_0, t_x, w_0, w_x;
    float last_column, last_row;  ///< points beyond the grid count to its outermost cells
    float columns;
    std::int32_t first_cell;
};

/// Number of the grid cell under each of `count` cells with centres x.
void find_grid_cells(const GridLine& line, const float* x, int count, std::int32_t* grid_cells);

/// Ends of the runs of equal values among values[0, count); returns their number. kernel_lanes more may be read and
/// written behind both.
int find_run_ends(const std::int32_t* values, int count, std::int32_t* ends);

/// The smallest of rows x kernel_lanes depths.
float smallest_depth(const float* depth, int rows, std::ptrdiff_t stride);

/// left[k] = max(left[k], at_zero + slope y[k]); or right[k] = min(right[k], ...).
void raise_left(double* left, const double* y, int count, double at_zero, double slope);
void lower_right(double* right, const double* y, int count, double at_zero, double slope);

/// before[k]: number of columns of equal width whose centre is left of x[k]; kernel_lanes more may be read and written. docs/hemicube.md, "Item buffer".
void count_columns_before(const double* x, int count, double x_begin, double columns_per_unit, int columns, int* before);

}  // namespace naturel
