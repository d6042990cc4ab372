#include "embree_backend/sampling.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/units.h"

namespace naturel::embree_sampling {
namespace {

/// Wellons 2018, lowbias32.
std::uint32_t hash(std::uint32_t x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

std::uint32_t reversed_bits(std::uint32_t x) {
    x = ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    return (x << 16) | (x >> 16);
}

/// Owen's scrambling of a binary fraction given with its bits reversed, by hashing (Laine & Karras 2011,
/// constants of Burley 2020); in [0, 1).
double scrambled(std::uint32_t reversed, std::uint32_t key) {
    reversed += key;
    reversed ^= reversed * 0x6c50b47cu;
    reversed ^= reversed * 0xb82f1e52u;
    reversed ^= reversed * 0xc7afe638u;
    reversed ^= reversed * 0x8d22f6e6u;
    return reversed_bits(reversed) * 0x1p-32;
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

glm::dvec2 sobol_point(std::uint32_t i, std::uint32_t key) {
    // First coordinate: the bits of i mirrored. Second: the binary Pascal matrix times them.
    std::uint32_t second = 0;
    std::uint32_t column = 1u << 31;
    for (std::uint32_t bits = i; bits != 0; bits >>= 1, column ^= column >> 1)
        if (bits & 1u) second ^= column;
    return {scrambled(i, hash(key)), scrambled(reversed_bits(second), hash(~key))};
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
    constexpr int rays = 16;
    const glm::vec3 fx = frame.x, fy = frame.y, fz = frame.z;
    const float cell_width = 0.5f / static_cast<float>(tiles.columns);  // of a square of side 2
    const float cell_height = 0.5f / static_cast<float>(tiles.rows);
    const std::uint32_t first_ray = key + rays * static_cast<std::uint32_t>(row * tiles.columns + column);
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

PolygonSampler::PolygonSampler(std::span<const glm::dvec3> corners_m, const glm::dvec3& centroid_m,
                               double margin_m)
    : corners_m_(corners_m), centroid_m_(centroid_m) {
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
}

glm::dvec3 PolygonSampler::point(const glm::dvec2& square) const {
    glm::dvec3 p;
    if (parallelogram_) {
        p = corners_m_[0] + square.x * (corners_m_[1] - corners_m_[0]) +
            square.y * (corners_m_[3] - corners_m_[0]);
    } else {
        // A fan: one coordinate picks a triangle by area and, within it, the distance from the tip.
        const auto triangle = [&](std::size_t k) {
            return doubled_area(corners_m_[0], corners_m_[k], corners_m_[k + 1]);
        };
        double rest = 0.0;
        for (std::size_t k = 1; k + 1 < corners_m_.size(); ++k)
            rest += square.x * triangle(k);
        std::size_t k = 1;
        for (; k + 2 < corners_m_.size() && rest >= triangle(k); ++k)
            rest -= triangle(k);
        const double outward = rest > 0.0 ? std::sqrt(std::min(1.0, rest / triangle(k))) : 0.0;
        p = corners_m_[0] +
            outward * (corners_m_[k] - corners_m_[0] + square.y * (corners_m_[k + 1] - corners_m_[k]));
    }
    return centroid_m_ + shrink_ * (p - centroid_m_);
}

}  // namespace naturel::embree_sampling
