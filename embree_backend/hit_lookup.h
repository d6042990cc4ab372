#pragma once
#include <cstdint>

#include "embree_backend/embree_api.h"

namespace naturel {

/// What turns a hit on a triangle into a cell of its face's grid: both are linear in Embree's coordinates (u, v) of the hit.
struct alignas(64) HitMap {
    float column = 0.0f, column_u = 0.0f, column_v = 0.0f;  ///< column + u column_u + v column_v, in cells
    float row = 0.0f, row_u = 0.0f, row_v = 0.0f;
    float edge = 0.0f;         ///< a hit with u, v or 1 - u - v below is within rounding of an edge
    std::int32_t columns = 0;  ///< cells from one row to the next
    float normal_x = 0.0f, normal_y = 0.0f, normal_z = 0.0f;  ///< of the facet; zero where no hit is clear
    std::uint32_t first_cell = 0;
};

/// Eight neighbouring rays of a traced packet.
struct TracedRays {
    const float *dir_x, *dir_y, *dir_z, *u, *v;
    const std::uint32_t *geometry, *triangle;

    template <unsigned size>
    TracedRays(const embree_api::PacketOf<size>& packet, unsigned first)
        : dir_x(packet.rays.ray.dir_x + first), dir_y(packet.rays.ray.dir_y + first), dir_z(packet.rays.ray.dir_z + first),
          u(packet.rays.hit.u + first), v(packet.rays.hit.v + first), geometry(packet.rays.hit.geomID + first),
          triangle(packet.rays.hit.primID + first) {}
};

/// The cells under the hits of traced rays. `unclear` where the facet was not met from its front and away from its
/// edges, or where nothing was met. A hit on the last edge of a grid may come out one cell beyond by rounding. cells: [8], filled.
void find_cells(const HitMap* maps, const TracedRays& rays, std::uint32_t unclear, std::uint32_t* cells);

}  // namespace naturel
