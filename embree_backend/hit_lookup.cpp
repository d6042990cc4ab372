#include "embree_backend/hit_lookup.h"

#include <algorithm>
#include <bit>

#include "embree_backend/wide.h"

namespace naturel {

using embree_api::no_hit;
using embree_api::packet_size;

/// Neighbouring rays meet few triangles: all lanes are computed for each of these, without branches.
NATUREL_WIDE void find_cells(const HitMap* maps, const embree_api::Packet& packet, std::uint32_t unclear, std::uint32_t* cells) {
    const RTCRay8& ray = packet.rays.ray;
    const RTCHit8& hit = packet.rays.hit;
    std::uint32_t met[packet_size], cell[packet_size];
    // There is one geometry: its number is 0, and all ones where nothing was met.
    for (unsigned k = 0; k < packet_size; ++k) met[k] = hit.primID[k] | hit.geomID[k];
    for (unsigned k = 0; k < packet_size; ++k) cell[k] = unclear;
    std::uint32_t left = (1u << packet_size) - 1;
    while (left != 0) {
        const std::uint32_t triangle = met[std::countr_zero(left)];
        std::uint32_t same = 0;
        for (unsigned k = 0; k < packet_size; ++k) same |= static_cast<std::uint32_t>(met[k] == triangle) << k;
        left &= ~same;
        if (triangle == no_hit) continue;
        const HitMap& map = maps[triangle];
        const float last_column = map.last_column, last_row = map.last_row, edge = map.edge;
        for (unsigned k = 0; k < packet_size; ++k) {
            const float u = hit.u[k], v = hit.v[k];
            const float column = std::min(std::max(map.column + u * map.column_u + v * map.column_v, 0.0f), last_column);
            const float row = std::min(std::max(map.row + u * map.row_u + v * map.row_v, 0.0f), last_row);
            const std::uint32_t found = map.first_cell + static_cast<std::uint32_t>(static_cast<int>(row) * map.columns + static_cast<int>(column));
            const float cosine = ray.dir_x[k] * map.normal_x + ray.dir_y[k] * map.normal_y + ray.dir_z[k] * map.normal_z;
            const float inside = std::min(std::min(u, v), 1.0f - u - v);
            const bool clear = (cosine < 0.0f) & (inside >= edge);
            cell[k] = met[k] == triangle ? (clear ? found : unclear) : cell[k];
        }
    }
    std::copy_n(cell, packet_size, cells);
}

}  // namespace naturel
