// The inner loops of the projection, compiled once for each instruction set; the best one that the processor has is chosen when
// the program runs. No fused multiply-add and no approximate division: every instruction set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hemicube_backend/cell_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "hemicube_backend/cell_kernels.h"

#ifndef NATUREL_BITS_SET
#define NATUREL_BITS_SET
namespace naturel {

/// Numbers of the bits that are set in each byte.
struct BitsSet {
    std::uint8_t positions[256 * 8] = {};

    constexpr BitsSet() {
        for (unsigned byte = 0; byte < 256; ++byte)
            for (unsigned bit = 0, found = 0; bit < 8; ++bit)
                if ((byte >> bit & 1u) != 0) positions[8 * byte + found++] = static_cast<std::uint8_t>(bit);
    }
};
inline constexpr BitsSet bits_set;

}  // namespace naturel
#endif

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
               w_0 = hn::Set(f, line.w_0), w_x = hn::Set(f, line.w_x), zero = hn::Zero(f), one = hn::Set(f, 1);
    const auto last_column = hn::Set(f, line.last_column), last_row = hn::Set(f, line.last_row);
    const auto columns = hn::Set(f, line.columns);
    const auto first_cell = hn::Set(i, line.first_cell);
    for (int k = 0; k < count; k += lanes) {
        const auto x_k = hn::LoadU(f, x + k);
        // Rounding acts like a shift of the cell's centre by some 1e-7 of the plane. Lanes past `count` may hold anything.
        const auto distance = hn::Div(one, hn::Add(w_0, hn::Mul(w_x, x_k)));
        const auto s = hn::Min(hn::Max(hn::Mul(hn::Add(s_0, hn::Mul(s_x, x_k)), distance), zero), last_column);
        const auto t = hn::Min(hn::Max(hn::Mul(hn::Add(t_0, hn::Mul(t_x, x_k)), distance), zero), last_row);
        // A grid has at most ten million cells: their numbers are exact as floats.
        const auto cell = hn::ConvertTo(i, hn::Add(hn::Floor(s), hn::Mul(columns, hn::Floor(t))));
        hn::StoreU(hn::Add(first_cell, cell), i, grid_cells + k);
    }
}

int find_run_ends(const std::int32_t* values, int count, std::int32_t* ends) {
    const hn::CappedTag<std::int32_t, 8> i;
    const hn::Rebind<std::uint8_t, decltype(i)> bytes;
    const int lanes = static_cast<int>(hn::Lanes(i));
    int runs = 0;
    for (int k = 0; k < count; k += lanes) {
        alignas(8) std::uint8_t mask[8];
        hn::StoreMaskBits(i, hn::Ne(hn::LoadU(i, values + k), hn::LoadU(i, values + k + 1)), mask);
        unsigned bits = mask[0];
        if (k + lanes >= count) {  // the last cell ends a run whatever follows it
            bits &= (2u << (count - 1 - k)) - 1;
            bits |= 1u << (count - 1 - k);
        }
        // All lanes are written, and the next ones go over those that were not ends: no branch that is hard to foresee.
        const auto numbers = hn::PromoteTo(i, hn::LoadU(bytes, bits_set.positions + 8 * bits));
        hn::StoreU(hn::Add(numbers, hn::Set(i, k + 1)), i, ends + runs);
        runs += __builtin_popcount(bits);
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
    const hn::CappedTag<double, 8> d;
    const hn::Rebind<std::int32_t, decltype(d)> i;
    const auto begin = hn::Set(d, x_begin), scale = hn::Set(d, columns_per_unit), half = hn::Set(d, 0.5), zero = hn::Zero(d),
               all = hn::Set(d, columns);
    for (int k = 0; k < count; k += static_cast<int>(hn::Lanes(d))) {
        auto position = hn::Sub(hn::Mul(hn::Sub(hn::LoadU(d, x + k), begin), scale), half);
        position = hn::IfThenElse(hn::Gt(position, zero), position, zero);
        position = hn::IfThenElse(hn::Lt(position, all), position, all);
        hn::StoreU(hn::DemoteTo(i, hn::Ceil(position)), i, before + k);
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
