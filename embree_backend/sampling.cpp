#include "embree_backend/sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "core/units.h"

namespace naturel::embree_sampling {
namespace {

constexpr std::uint32_t rays_per_packet = 16;

/// Wellons 2018, lowbias32.
std::uint32_t hash(std::uint32_t x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

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
HemisphereFrame::HemisphereFrame(const glm::dvec3& n) : z(n) {
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    x = glm::dvec3(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    y = glm::dvec3(b, sign + n.y * n.y * a, -n.y);
}

/// The square is laid on the disc by the concentric map (Shirley & Chiu 1997), the disc projected up to the
/// hemisphere (Nusselt). In float: a direction off by 1e-7 is as good a sample. One loop without branches,
/// for the vectoriser.
void tile_directions(const HemisphereFrame& frame, const Tiles& tiles, int row, int column, std::uint32_t key,
                     float* x, float* y, float* z) {
    constexpr int rays = static_cast<int>(rays_per_packet);
    const glm::vec3 fx = frame.x, fy = frame.y, fz = frame.z;
    const float cell_width = 0.5f / static_cast<float>(tiles.columns);  // of a square of side 2
    const float cell_height = 0.5f / static_cast<float>(tiles.rows);
    const std::uint32_t first_ray =
        key + rays_per_packet * static_cast<std::uint32_t>(row * tiles.columns + column);
    float directions[3][rays];
    for (int k = 0; k < rays; ++k) {
        const std::uint32_t random = hash(first_ray + static_cast<std::uint32_t>(k));
        const float along =
            (static_cast<float>(static_cast<int>(random & 0xffffu)) + 0.5f) * 0x1p-16f;  // in the cell
        const float across = (static_cast<float>(static_cast<int>(random >> 16)) + 0.5f) * 0x1p-16f;
        const float a = (static_cast<float>(4 * column + (k & 3)) + along) * cell_width - 1.0f;
        const float b = (static_cast<float>(4 * row + (k >> 2)) + across) * cell_height - 1.0f;

        const bool wide = std::abs(a) > std::abs(b);
        const float radius = wide ? a : b;
        const float other = wide ? b : a;
        // Angle from the nearer axis, in [-pi/4, pi/4]; the Taylor series are off by less than 4e-8 there.
        const float angle = static_cast<float>(pi / 4) * other / (radius != 0.0f ? radius : 1.0f);
        const float q = angle * angle;
        const float cosine =
            1.0f + q * (-1.0f / 2 + q * (1.0f / 24 + q * (-1.0f / 720 + q * (1.0f / 40320))));
        const float sine =
            angle * (1.0f + q * (-1.0f / 6 + q * (1.0f / 120 + q * (-1.0f / 5040 + q * (1.0f / 362880)))));
        const float u = radius * (wide ? cosine : sine);
        const float v = radius * (wide ? sine : cosine);
        const float w = std::sqrt(std::max(0.0f, 1.0f - radius * radius));
        directions[0][k] = u * fx.x + v * fy.x + w * fz.x;
        directions[1][k] = u * fx.y + v * fy.y + w * fz.y;
        directions[2][k] = u * fx.z + v * fy.z + w * fz.z;
    }
    std::copy_n(directions[0], rays, x);
    std::copy_n(directions[1], rays, y);
    std::copy_n(directions[2], rays, z);
}

void tile_points(std::uint32_t packet, std::uint32_t key, float* u, float* v) {
    constexpr auto first_points = [] {
        std::array<SobolPoint, rays_per_packet> points;
        for (std::uint32_t k = 0; k < rays_per_packet; ++k)
            points[k] = sobol_point(k);
        return points;
    }();
    // The sequence is linear in the bits of its index: point(16 packet + k) = point(16 packet) ^ point(k). A
    // digital shift by random bits keeps its strata. Which ray gets which point changes from packet to
    // packet, so that no cell of the tiles is bound to one part of the patch.
    const std::uint32_t random = hash(key ^ hash(packet));
    const std::uint32_t turn = random % rays_per_packet;
    const SobolPoint start = sobol_point(rays_per_packet * packet);
    const std::uint32_t start_u = start.u ^ hash(key);
    const std::uint32_t start_v = start.v ^ hash(~key);
    for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
        const SobolPoint& p = first_points[k ^ turn];
        u[k] = static_cast<float>(static_cast<int>((start_u ^ p.u) >> 8)) * 0x1p-24f;
        v[k] = static_cast<float>(static_cast<int>((start_v ^ p.v) >> 8)) * 0x1p-24f;
    }
}

PolygonSampler::PolygonSampler(std::span<const glm::dvec3> corners_m, const glm::dvec3& centroid_m,
                               double margin_m, const glm::dvec3& shift_m)
    : corners_m_(corners_m), centroid_m_(centroid_m), shift_m_(shift_m) {
    double nearest_edge_m = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < corners_m.size(); ++k) {
        const glm::dvec3& from = corners_m[k];
        const glm::dvec3& to = corners_m[(k + 1) % corners_m.size()];
        if (from == to) continue;
        nearest_edge_m =
            std::min(nearest_edge_m, doubled_area(from, to, centroid_m) / glm::length(to - from));
    }
    shrink_ = nearest_edge_m > margin_m ? 1.0 - margin_m / nearest_edge_m : 0.0;
    // Corners are rounded to 1 nm: what is a parallelogram within a few of them is one.
    parallelogram_ = corners_m.size() == 4 &&
                     glm::length(corners_m[0] + corners_m[2] - corners_m[1] - corners_m[3]) < 1e-8;
    if (parallelogram_) {
        origin_m_ = shrunk(corners_m[0]);
        along_m_ = shrink_ * (corners_m[1] - corners_m[0]);
        across_m_ = shrink_ * (corners_m[3] - corners_m[0]);
    } else {
        for (std::size_t k = 1; k + 1 < corners_m.size(); ++k)
            fan_m2_.push_back(doubled_area(corners_m[0], corners_m[k], corners_m[k + 1]));
    }
}

void PolygonSampler::place(const float* u, const float* v, float* x, float* y, float* z) const {
    if (!parallelogram_) {
        for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
            const glm::vec3 p(shrunk(on_fan(u[k], v[k])));
            x[k] = p.x, y[k] = p.y, z[k] = p.z;
        }
        return;
    }
    const glm::vec3 origin = origin_m_, along = along_m_, across = across_m_;
    float positions[3][rays_per_packet];
    for (std::uint32_t k = 0; k < rays_per_packet; ++k) {
        positions[0][k] = origin.x + u[k] * along.x + v[k] * across.x;
        positions[1][k] = origin.y + u[k] * along.y + v[k] * across.y;
        positions[2][k] = origin.z + u[k] * along.z + v[k] * across.z;
    }
    std::copy_n(positions[0], rays_per_packet, x);
    std::copy_n(positions[1], rays_per_packet, y);
    std::copy_n(positions[2], rays_per_packet, z);
}

glm::dvec3 PolygonSampler::shrunk(const glm::dvec3& point_m) const {
    return centroid_m_ + shrink_ * (point_m - centroid_m_) + shift_m_;
}

/// One coordinate picks a triangle of the fan by area and, within it, the distance from the tip.
glm::dvec3 PolygonSampler::on_fan(double u, double v) const {
    double rest = u * std::accumulate(fan_m2_.begin(), fan_m2_.end(), 0.0);
    std::size_t k = 0;
    for (; k + 1 < fan_m2_.size() && rest >= fan_m2_[k]; ++k)
        rest -= fan_m2_[k];
    const double outward = rest > 0.0 ? std::sqrt(std::min(1.0, rest / fan_m2_[k])) : 0.0;
    const glm::dvec3 &tip = corners_m_[0], &first = corners_m_[k + 1], &second = corners_m_[k + 2];
    return tip + outward * (first - tip + v * (second - first));
}

}  // namespace naturel::embree_sampling
