#pragma once
#include <cstdint>
#include <vector>

#include "embree_backend/embree_api.h"

namespace naturel {

/// What turns a hit on a triangle into a cell of its face's grid: both are linear in Embree's coordinates (u, v) of the hit.
struct alignas(64) HitMap {
    float column = 0.0f, column_u = 0.0f, column_v = 0.0f;  ///< column + u column_u + v column_v, in cells
    float row = 0.0f, row_u = 0.0f, row_v = 0.0f;
    float last_column = 0.0f, last_row = 0.0f;
    float normal_x = 0.0f, normal_y = 0.0f, normal_z = 0.0f;  ///< of the facet; zero where no hit is clear
    float edge = 0.0f;  ///< a hit with u, v or 1 - u - v below is within rounding of an edge
    std::uint32_t first_cell = 0;
    std::int32_t columns = 0;
    std::uint32_t facet = 0;
};

/// The cells under the hits of a traced packet. `unclear` where the facet was not met from its front and away from its
/// edges, or where nothing was met. cells: [8], filled.
void find_cells(const HitMap* maps, const embree_api::Packet& packet, std::uint32_t unclear, std::uint32_t* cells);

}  // namespace naturel
