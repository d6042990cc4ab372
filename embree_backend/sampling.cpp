#include "embree_backend/sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "core/units.h"
#include "core/wide.h"

namespace naturel::embree_sampling {
namespace {

/// Point of the Sobol (0,2)-sequence, its coordinates as binary fractions of 32 bits. First coordinate: the
/// bits of i mirrored. Second: the binary Pascal matrix times them.
struct SobolPoint {
    std::uint32_t u = 0, v = 0;
};

constexpr SobolPoint sobol_point(std::uint32_t i) {
    SobolPoint p;
    std::uint32_t unit = 1u << 31;
    std::uint32_t column = 1u << 31;
    for (std::uint32_t bits = i; bits != 0; bits >>= 1, unit >>= 1, column ^= column >> 1)
        if (bits & 1u) {
            p.u ^= unit;
            p.v ^= column;
        }
    return p;
}

double doubled_area(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return glm::length(glm::cross(b - a, c - a));
}

}  // namespace

std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

std::uint32_t morton(std::uint32_t a, std::uint32_t b) {
    const auto spread = [](std::uint32_t x) {
        x = (x | (x << 8)) & 0x00ff00ffu;
        x = (x | (x << 4)) & 0x0f0f0f0fu;
        x = (x | (x << 2)) & 0x33333333u;
        return (x | (x << 1)) & 0x55555555u;
    };
    return spread(a) | (spread(b) << 1);
}

Tiles make_tiles(int rays) {
    const int packets = 16 * std::max(1, (rays + 255) / 256);
    int rows = static_cast<int>(std::sqrt(packets));
    while (packets % rows != 0)
        --rows;
    return {rows, packets / rows};
}

/// Duff et al. 2017.
HemisphereFrame::HemisphereFrame(const glm::dvec3& n, std::uint32_t symmetry) : z(n) {
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    x = glm::dvec3(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    y = glm::dvec3(b, sign + n.y * n.y * a, -n.y);
    if (symmetry & 1u) std::swap(x, y);
    if (symmetry & 2u) x = -x;
    if (symmetry & 4u) y = -y;
}

namespace {

/// The square of side 2 is laid on the disc by the concentric map (Shirley & Chiu 1997), the disc projected up to the
/// hemisphere (Nusselt).
glm::dvec3 hemisphere_direction(double a, double b) {
    const bool wide = std::abs(a) > std::abs(b);
    const double radius = wide ? a : b;
    const double other = wide ? b : a;
    const double angle = radius != 0.0 ? pi / 4 * other / radius : 0.0;  // from the nearer axis
    const double cosine = std::cos(angle), sine = std::sin(angle);
    return {radius * (wide ? cosine : sine), radius * (wide ? sine : cosine),
            std::sqrt(std::max(0.0, 1.0 - radius * radius))};
}

/// Which of the eight Sobol points 8 n, ..., 8 n + 7 ray 0 of packet n takes; ray k takes the k-th from there (exclusive or).
/// Linear in the bits of n, with the one choice of columns (up to symmetry) for which each ray number's own
/// points are nets, too: any aligned run of 2^m packets gives it one point in each cell of any division of the square into 2^m
/// equal rectangles with sides of powers of two. Found by search over all columns; holds for runs of up to 2^12 packets.
std::uint32_t first_point(std::uint32_t packet) {
    constexpr std::uint32_t columns[] = {3, 6, 7, 5, 1, 2, 4};
    std::uint32_t number = 0;
    for (std::uint32_t bit = 0; packet >> bit != 0; ++bit)
        if (packet >> bit & 1u) number ^= columns[bit % 7];
    return number;
}

}  // namespace

RayTable make_ray_table(const Tiles& tiles, std::uint64_t key) {
    const auto rays = static_cast<std::size_t>(tiles.rays());
    RayTable table{std::vector<float>(rays), std::vector<float>(rays), std::vector<float>(rays)};
    const double cell_width = 0.5 / tiles.columns, cell_height = 0.5 / tiles.rows;  // of a square of side 2
    std::size_t ray = 0;
    for (int row = 0; row < tiles.rows; ++row)
        for (int column = 0; column < tiles.columns; ++column)
            for (std::uint32_t half = 0; half < 2; ++half) {
                // The cells of a half tile in random order (Fisher & Yates): each may go to any sub-sample, and so to any
                // part of the patch.
                std::array<int, rays_per_packet> cells;
                std::iota(cells.begin(), cells.end(), 0);
                std::uint64_t random = mix(key ^ mix(ray));
                for (std::uint64_t left = rays_per_packet; left > 1; --left) {
                    std::swap(cells[left - 1], cells[random % left]);
                    random /= left;
                }
                for (std::uint32_t k = 0; k < rays_per_packet; ++k, ++ray) {
                    const std::uint64_t place = mix(key + (ray + 1) * 0xd1342543de82ef95u);
                    const double along = static_cast<double>(place & 0xffffffffu) * 0x1p-32;
                    const double across = static_cast<double>(place >> 32) * 0x1p-32;
                    const glm::dvec3 d = hemisphere_direction(
                        (4 * column + cells[k] % 4 + along) * cell_width - 1.0,
                        (4 * row + 2 * static_cast<int>(half) + cells[k] / 4 + across) * cell_height - 1.0);
                    table.x[ray] = static_cast<float>(d.x);
                    table.y[ray] = static_cast<float>(d.y);
                    table.z[ray] = static_cast<float>(d.z);
                }
            }
    return table;
}

StartTable make_start_table(const Tiles& tiles) {
    StartTable table;
    for (int row = 0; row < tiles.rows; ++row)
        for (int column = 0; column < tiles.columns; ++column)
            for (std::uint32_t half = 0; half < 2; ++half) {
                const std::uint32_t packet =
                    2 * morton(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row)) + half;
                const std::uint32_t point = rays_per_packet * packet + first_point(packet);
                for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
                    const SobolPoint start = sobol_point(point ^ k);
                    table.u.push_back(start.u);
                    table.v.push_back(start.v);
                }
            }
    return table;
}

RayTables::RayTables(const Tiles& tiles, std::size_t count, std::uint64_t seed)
    : tiles_(tiles), starts_(make_start_table(tiles)), seed_(seed), count_(count), slots_(std::make_unique<Slot[]>(count)) {}

const RayTable& RayTables::table(std::uint64_t random) const {
    const std::size_t number = random % count_;
    Slot& slot = slots_[number];
    std::call_once(slot.made, [&] { slot.table = make_ray_table(tiles_, mix(seed_ ^ mix(number + 1))); });
    return slot.table;
}

namespace {

inline __attribute__((always_inline)) void turn(const HemisphereFrame& frame, const RayTable& table, std::size_t first,
                                                float* __restrict x, float* __restrict y, float* __restrict z) {
    const float* const u = table.x.data() + first;
    const float* const v = table.y.data() + first;
    const float* const w = table.z.data() + first;
    for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
        x[k] = u[k] * frame.x.x + v[k] * frame.y.x + w[k] * frame.z.x;
        y[k] = u[k] * frame.x.y + v[k] * frame.y.y + w[k] * frame.z.y;
        z[k] = u[k] * frame.x.z + v[k] * frame.y.z + w[k] * frame.z.z;
    }
}

inline __attribute__((always_inline)) void spread(const float* p, const StartTable& table, const DigitalShift& shift, std::size_t first,
                                                  float* __restrict x, float* __restrict y, float* __restrict z) {
    const std::uint32_t* const u = table.u.data() + first;
    const std::uint32_t* const v = table.v.data() + first;
    for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
        const float s = static_cast<float>(static_cast<int>((u[k] ^ shift.u) >> 8)) * 0x1p-24f;
        const float t = static_cast<float>(static_cast<int>((v[k] ^ shift.v) >> 8)) * 0x1p-24f;
        x[k] = p[0] + s * p[3] + t * p[6];
        y[k] = p[1] + s * p[4] + t * p[7];
        z[k] = p[2] + s * p[5] + t * p[8];
    }
}

/// One coordinate picks a triangle of the fan by area and, within it, the distance from the tip. Every triangle is tried for every
/// ray; the last one that begins before a ray's coordinate stays.
NATUREL_WIDE void place_on_fan(const FanTriangle* fan, std::size_t count, const StartTable& table, const DigitalShift& shift,
                               std::size_t first, float* __restrict x, float* __restrict y, float* __restrict z) {
    const std::uint32_t* const u = table.u.data() + first;
    const std::uint32_t* const v = table.v.data() + first;
    float px[rays_per_packet]{}, py[rays_per_packet]{}, pz[rays_per_packet]{};
    for (std::size_t n = 0; n < count; ++n) {
        const FanTriangle& f = fan[n];
        for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
            const float s = static_cast<float>(static_cast<int>((u[k] ^ shift.u) >> 8)) * 0x1p-24f;
            const float t = static_cast<float>(static_cast<int>((v[k] ^ shift.v) >> 8)) * 0x1p-24f;
            const float outward = std::sqrt(std::min(1.0f, std::max(0.0f, (s - f.begin) / f.share)));
            const bool here = (n == 0) | (s >= f.begin);
            const float qx = f.tip[0] + outward * (f.first[0] + t * f.second[0]);
            const float qy = f.tip[1] + outward * (f.first[1] + t * f.second[1]);
            const float qz = f.tip[2] + outward * (f.first[2] + t * f.second[2]);
            px[k] = here ? qx : px[k];
            py[k] = here ? qy : py[k];
            pz[k] = here ? qz : pz[k];
        }
    }
    std::copy_n(px, rays_per_packet, x);
    std::copy_n(py, rays_per_packet, y);
    std::copy_n(pz, rays_per_packet, z);
}

}  // namespace

NATUREL_WIDE void place_directions(const HemisphereFrame& frame, const RayTable& table, std::size_t first, float* x, float* y,
                                   float* z) {
    turn(frame, table, first, x, y, z);
}

NATUREL_WIDE void place_rays(const HemisphereFrame& frame, const RayTable& table, const float* parallelogram_m,
                             const StartTable& starts, const DigitalShift& shift, std::size_t first, const RayLanes& rays) {
    turn(frame, table, first, rays.x, rays.y, rays.z);
    spread(parallelogram_m, starts, shift, first, rays.start_x, rays.start_y, rays.start_z);
}

PolygonSampler::PolygonSampler(std::span<const glm::dvec3> corners_m, const glm::dvec3& centroid_m,
                               double margin_m, const glm::dvec3& shift_m)
    : centroid_m_(centroid_m), shift_m_(shift_m) {
    // Corners are rounded to 1 nm: what is straight, or a parallelogram, within a few of them is one.
    constexpr double rounding_m = 1e-8;
    for (std::size_t k = 0; k < corners_m.size(); ++k) {
        const glm::dvec3& before = corners_m[(k + corners_m.size() - 1) % corners_m.size()];
        const glm::dvec3& after = corners_m[(k + 1) % corners_m.size()];
        if (doubled_area(before, corners_m[k], after) > rounding_m * glm::length(after - before))
            corners_m_.push_back(corners_m[k]);
    }
    if (corners_m_.size() < 3) corners_m_.assign(corners_m.begin(), corners_m.end());
    double nearest_edge_m = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < corners_m_.size(); ++k) {
        const glm::dvec3& from = corners_m_[k];
        const glm::dvec3& to = corners_m_[(k + 1) % corners_m_.size()];
        if (from == to) continue;
        nearest_edge_m =
            std::min(nearest_edge_m, doubled_area(from, to, centroid_m) / glm::length(to - from));
    }
    shrink_ = nearest_edge_m > margin_m ? 1.0 - margin_m / nearest_edge_m : 0.0;
    parallelogram_ = corners_m_.size() == 4 &&
                     glm::length(corners_m_[0] + corners_m_[2] - corners_m_[1] - corners_m_[3]) < rounding_m;
    if (parallelogram_) {
        const glm::vec3 origin = shrunk(corners_m_[0]);
        const glm::vec3 along = shrink_ * (corners_m_[1] - corners_m_[0]);
        const glm::vec3 across = shrink_ * (corners_m_[3] - corners_m_[0]);
        parallelogram_m_ = {origin.x, origin.y, origin.z, along.x, along.y, along.z, across.x, across.y, across.z};
    } else {
        double total = 0.0, begin = 0.0;
        for (std::size_t k = 1; k + 1 < corners_m_.size(); ++k)
            total += doubled_area(corners_m_[0], corners_m_[k], corners_m_[k + 1]);
        const auto floats = [](const glm::dvec3& v) {
            return std::array{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
        };
        for (std::size_t k = 1; k + 1 < corners_m_.size(); ++k) {
            const double share = doubled_area(corners_m_[0], corners_m_[k], corners_m_[k + 1]) / total;
            if (!(share > 0.0)) continue;
            fan_.push_back({static_cast<float>(begin), static_cast<float>(share), floats(shrunk(corners_m_[0])),
                            floats(shrink_ * (corners_m_[k] - corners_m_[0])), floats(shrink_ * (corners_m_[k + 1] - corners_m_[k]))});
            begin += share;
        }
        if (fan_.empty()) fan_.push_back({0.0f, 1.0f, floats(shrunk(centroid_m)), {}, {}});  // no area
    }
}

void PolygonSampler::place(const StartTable& table, std::size_t first, const DigitalShift& shift, float* x, float* y,
                           float* z) const {
    if (parallelogram_) return spread(parallelogram_m_.data(), table, shift, first, x, y, z);
    place_on_fan(fan_.data(), fan_.size(), table, shift, first, x, y, z);
}

glm::dvec3 PolygonSampler::shrunk(const glm::dvec3& point_m) const {
    return centroid_m_ + shrink_ * (point_m - centroid_m_) + shift_m_;
}

}  // namespace naturel::embree_sampling
