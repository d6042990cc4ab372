// The inner loops of the projection, compiled once for each instruction set; the best one that the processor has is chosen when
// the program runs. No fused multiply-add and no approximate division: every instruction set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hemicube_backend/cell_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "hemicube_backend/cell_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace naturel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::CappedTag<std::int32_t, 16>;

void draw_spans(const Spans& spans, int rows) {
    const Floats f;
    const Ints i;
    const int lanes = static_cast<int>(hn::Lanes(f));
    const auto by_x = hn::Set(f, static_cast<float>(spans.by_x));
    const auto code = hn::Set(i, spans.code);
    const auto numbers = hn::Iota(i, 0);  // once: it is put together in memory
    for (int row = 0; row < rows; ++row) {
        const int first = spans.first[row], last = spans.last[row];
        const float* const x = spans.x + row * spans.x_stride;
        float* const depth = spans.depth + row * spans.stride;
        ItemCode* const items = spans.items + row * spans.stride;
        const auto at_origin = hn::Set(f, static_cast<float>(spans.at_origin[row]));
        // A float's 24 bits place the line where two facets meet to 1e-6 of the distance at which they are seen, or less than
        // a thousandth of a cell; coplanar facets get equal bits.
        for (int k = first; k < last; k += lanes) {
            const auto candidate = hn::Add(at_origin, hn::Mul(by_x, hn::LoadU(f, x + k)));
            const auto old_depth = hn::LoadU(f, depth + k);
            const auto old_item = hn::LoadU(i, items + k);
            const auto mine = hn::Lt(numbers, hn::Set(i, last - k));
            const auto nearer = hn::RebindMask(i, hn::Gt(candidate, old_depth));
            const auto level = hn::RebindMask(i, hn::Eq(candidate, old_depth));
            const auto wins = hn::And(mine, hn::Or(nearer, hn::And(level, hn::Lt(code, old_item))));
            hn::StoreU(hn::IfThenElse(wins, code, old_item), i, items + k);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(f, wins), candidate, old_depth), f, depth + k);
        }
    }
}

void find_grid_cells(const GridLine& line, const float* x, int count, std::int32_t* grid_cells) {
    const Floats f;
    const Ints i;
    const int lanes = static_cast<int>(hn::Lanes(f));
    const auto s_0 = hn::Set(f, line.s_0), s_x = hn::Set(f, line.s_x), t_0 = hn::Set(f, line.t_0), t_x = hn::Set(f, line.t_x),
               w_0 = hn::Set(f, line.w_0), w_x = hn::Set(f, line.w_x), zero = hn::Zero(f);
    const auto last_column = hn::Set(f, line.last_column), last_row = hn::Set(f, line.last_row);
    const auto columns = hn::Set(i, line.columns), first_cell = hn::Set(i, line.first_cell);
    for (int k = 0; k < count; k += lanes) {
        const auto x_k = hn::LoadU(f, x + k);
        const auto w = hn::Add(w_0, hn::Mul(w_x, x_k));
        // Rounding acts like a shift of the cell's centre by some 1e-7 of the plane. Lanes past `count` may hold anything.
        const auto s = hn::Min(hn::Max(hn::Div(hn::Add(s_0, hn::Mul(s_x, x_k)), w), zero), last_column);
        const auto t = hn::Min(hn::Max(hn::Div(hn::Add(t_0, hn::Mul(t_x, x_k)), w), zero), last_row);
        const auto cell = hn::Add(hn::Add(first_cell, hn::ConvertTo(i, s)), hn::Mul(columns, hn::ConvertTo(i, t)));
        hn::StoreU(cell, i, grid_cells + k);
    }
}

int find_run_ends(const std::int32_t* values, int count, std::int32_t* ends) {
    const Ints i;
    const int lanes = static_cast<int>(hn::Lanes(i));
    int runs = 0;
    for (int k = 0; k < count; k += lanes) {
        const auto differs = hn::Ne(hn::LoadU(i, values + k), hn::LoadU(i, values + k + 1));
        alignas(8) std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(i, differs, bytes);
        unsigned bits = bytes[0] | static_cast<unsigned>(bytes[1]) << 8;
        if (k + lanes >= count) {  // the last cell ends a run whatever follows it
            bits &= (2u << (count - 1 - k)) - 1;
            bits |= 1u << (count - 1 - k);
        }
        for (; bits != 0; bits &= bits - 1) ends[runs++] = k + __builtin_ctz(bits) + 1;
    }
    return runs;
}

float smallest_depth(const float* depth, int rows, std::ptrdiff_t stride) {
    const Floats f;
    auto smallest = hn::LoadU(f, depth);
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < kernel_lanes; k += static_cast<int>(hn::Lanes(f)))
            smallest = hn::Min(smallest, hn::LoadU(f, depth + row * stride + k));
    return hn::GetLane(hn::MinOfLanes(f, smallest));
}

void raise_left(double* left, const double* y, int count, double at_zero, double slope) {
    for (int k = 0; k < count; ++k) {
        const double x = at_zero + slope * y[k];
        left[k] = x > left[k] ? x : left[k];
    }
}

void lower_right(double* right, const double* y, int count, double at_zero, double slope) {
    for (int k = 0; k < count; ++k) {
        const double x = at_zero + slope * y[k];
        right[k] = x < right[k] ? x : right[k];
    }
}

void count_columns_before(const double* x, int count, double x_begin, double columns_per_unit, int columns, int* before) {
    for (int k = 0; k < count; ++k) {
        double position = (x[k] - x_begin) * columns_per_unit - 0.5;
        position = position > 0 ? position : 0;
        position = position < columns ? position : columns;
        const int whole = static_cast<int>(position);
        before[k] = whole + (position > whole ? 1 : 0);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace naturel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace naturel {

HWY_EXPORT(draw_spans);
HWY_EXPORT(find_grid_cells);
HWY_EXPORT(find_run_ends);
HWY_EXPORT(smallest_depth);
HWY_EXPORT(raise_left);
HWY_EXPORT(lower_right);
HWY_EXPORT(count_columns_before);

void draw_spans(const Spans& spans, int rows) {
    HWY_DYNAMIC_DISPATCH(draw_spans)(spans, rows);
}
void find_grid_cells(const GridLine& line, const float* x, int count, std::int32_t* grid_cells) {
    HWY_DYNAMIC_DISPATCH(find_grid_cells)(line, x, count, grid_cells);
}
int find_run_ends(const std::int32_t* values, int count, std::int32_t* ends) {
    return HWY_DYNAMIC_DISPATCH(find_run_ends)(values, count, ends);
}
float smallest_depth(const float* depth, int rows, std::ptrdiff_t stride) {
    return HWY_DYNAMIC_DISPATCH(smallest_depth)(depth, rows, stride);
}
void raise_left(double* left, const double* y, int count, double at_zero, double slope) {
    HWY_DYNAMIC_DISPATCH(raise_left)(left, y, count, at_zero, slope);
}
void lower_right(double* right, const double* y, int count, double at_zero, double slope) {
    HWY_DYNAMIC_DISPATCH(lower_right)(right, y, count, at_zero, slope);
}
void count_columns_before(const double* x, int count, double x_begin, double columns_per_unit, int columns, int* before) {
    HWY_DYNAMIC_DISPATCH(count_columns_before)(x, count, x_begin, columns_per_unit, columns, before);
}

}  // namespace naturel
#endif
