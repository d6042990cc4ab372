#include "embree_backend/hit_lookup.h"

#include <algorithm>

#include "core/wide.h"

namespace naturel {

using embree_api::no_hit;
using embree_api::packet_size;

namespace {

/// Finds the cells of the lanes that met one triangle, without branches; leaves the others.
inline __attribute__((always_inline)) void find_on(const HitMap* maps, std::uint32_t triangle, const std::uint32_t* met,
                                                   const embree_api::Packet& packet, std::uint32_t* cell) {
    const RTCRay8& ray = packet.rays.ray;
    const RTCHit8& hit = packet.rays.hit;
    const HitMap& map = maps[triangle == no_hit ? 0 : triangle];
    const std::uint32_t wanted = triangle == no_hit ? no_hit - 1 : triangle;
    for (unsigned k = 0; k < packet_size; ++k) {
        const float u = hit.u[k], v = hit.v[k];
        const float column = std::min(std::max(map.column + u * map.column_u + v * map.column_v, 0.0f), map.last_column);
        const float row = std::min(std::max(map.row + u * map.row_u + v * map.row_v, 0.0f), map.last_row);
        const std::uint32_t found =
            map.first_cell + static_cast<std::uint32_t>(static_cast<int>(row) * map.columns + static_cast<int>(column));
        const float cosine = ray.dir_x[k] * map.normal_x + ray.dir_y[k] * map.normal_y + ray.dir_z[k] * map.normal_z;
        const float inside = std::min(std::min(u, v), 1.0f - u - v);
        const bool clear = (cosine < 0.0f) & (inside >= map.edge) & (met[k] == wanted);
        cell[k] = clear ? found : cell[k];
    }
}

}  // namespace

/// Neighbouring rays meet few triangles. The first and the last ray's are taken without asking whether they differ: that is
/// all for most packets.
NATUREL_WIDE void find_cells(const HitMap* maps, const embree_api::Packet& packet, std::uint32_t unclear, std::uint32_t* cells) {
    std::uint32_t met[packet_size], cell[packet_size];
    // There is one geometry: its number is 0, and all ones where nothing was met.
    for (unsigned k = 0; k < packet_size; ++k) met[k] = packet.rays.hit.primID[k] | packet.rays.hit.geomID[k];
    for (unsigned k = 0; k < packet_size; ++k) cell[k] = unclear;
    const std::uint32_t first = met[0], last = met[packet_size - 1];
    find_on(maps, first, met, packet, cell);
    find_on(maps, last, met, packet, cell);
    std::uint32_t others = 0;
    for (unsigned k = 0; k < packet_size; ++k) others |= (met[k] ^ first) != 0 && (met[k] ^ last) != 0 ? 1u : 0u;
    if (others != 0) {
        std::uint32_t done = first;
        for (unsigned k = 1; k + 1 < packet_size; ++k) {
            if (met[k] == first || met[k] == last || met[k] == done) continue;
            done = met[k];
            find_on(maps, done, met, packet, cell);
        }
    }
    std::copy_n(cell, packet_size, cells);
}

}  // namespace naturel
