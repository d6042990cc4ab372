#include "embree_backend/hit_lookup.h"

#include <bit>
#include <cstring>

#include "core/wide.h"

namespace naturel {
namespace {

using embree_api::packet_size;

using Floats [[gnu::vector_size(32)]] = float;
using Ints [[gnu::vector_size(32)]] = std::int32_t;
static_assert(sizeof(Floats) == packet_size * sizeof(float));

inline __attribute__((always_inline)) Floats load(const float* p) {
    Floats f;
    std::memcpy(&f, p, sizeof(f));
    return f;
}

inline __attribute__((always_inline)) Ints load(const std::uint32_t* p) {
    Ints i;
    std::memcpy(&i, p, sizeof(i));
    return i;
}

inline __attribute__((always_inline)) Floats smaller(Floats a, Floats b) { return a < b ? a : b; }

inline __attribute__((always_inline)) Floats pair(const float* low, const float* high) {
    using Half [[gnu::vector_size(16)]] = float;
    Half a, b;
    std::memcpy(&a, low, sizeof(a));
    std::memcpy(&b, high, sizeof(b));
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// Four neighbouring numbers of each ray's map: field[i][k] = of[k][i].
inline __attribute__((always_inline)) void gather_four(const float* const (&of)[packet_size], Floats (&field)[4]) {
    const Floats a = pair(of[0], of[4]), b = pair(of[1], of[5]), c = pair(of[2], of[6]), d = pair(of[3], of[7]);
    const Floats ab_low = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
    const Floats ab_high = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
    const Floats cd_low = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
    const Floats cd_high = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
    field[0] = __builtin_shufflevector(ab_low, cd_low, 0, 1, 8, 9, 4, 5, 12, 13);
    field[1] = __builtin_shufflevector(ab_low, cd_low, 2, 3, 10, 11, 6, 7, 14, 15);
    field[2] = __builtin_shufflevector(ab_high, cd_high, 0, 1, 8, 9, 4, 5, 12, 13);
    field[3] = __builtin_shufflevector(ab_high, cd_high, 2, 3, 10, 11, 6, 7, 14, 15);
}

}  // namespace

/// Every ray brings the map of the triangle it met, whether its neighbours met the same or not: nothing to foresee.
NATUREL_WIDE void find_cells(const HitMap* maps, const TracedRays& rays, std::uint32_t unclear, std::uint32_t* cells) {
    // There is one geometry: its number is 0, and all ones where nothing was met.
    const Ints nothing = load(rays.geometry);
    const Ints triangle = load(rays.triangle) & ~nothing;
    const float* of_column[packet_size];
    const float* of_row[packet_size];
    const float* of_normal[packet_size];
    for (unsigned k = 0; k < packet_size; ++k) {
        const HitMap& map = maps[triangle[k]];
        of_column[k] = &map.column, of_row[k] = &map.row_u, of_normal[k] = &map.normal_x;
    }
    Floats place[4], more[4], normal[4];
    gather_four(of_column, place);
    gather_four(of_row, more);
    gather_four(of_normal, normal);

    const Floats u = load(rays.u), v = load(rays.v);
    const Floats column = place[0] + u * place[1] + v * place[2];
    const Floats row = place[3] + u * more[0] + v * more[1];
    const Ints columns = std::bit_cast<Ints>(more[3]), first_cell = std::bit_cast<Ints>(normal[3]);
    // Towards zero: what is negative by rounding belongs to the first cell.
    const Ints found = first_cell + __builtin_convertvector(row, Ints) * columns + __builtin_convertvector(column, Ints);
    const Floats cosine = load(rays.dir_x) * normal[0] + load(rays.dir_y) * normal[1] + load(rays.dir_z) * normal[2];
    const Floats inside = smaller(smaller(u, v), 1.0f - u - v);
    const Ints clear = (cosine < 0.0f) & (inside >= more[2]) & ~nothing;
    const Ints cell = (found & clear) | (static_cast<std::int32_t>(unclear) & ~clear);
    std::memcpy(cells, &cell, sizeof(cell));
}

}  // namespace naturel
