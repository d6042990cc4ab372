#pragma once
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

namespace naturel::embree_sampling {

/// Random bits as a function of a counter (Steele, Lea & Flood 2014, splitmix64): no state, so no order.
std::uint64_t mix(std::uint64_t x);

/// Bits of a and b (16 each) interleaved: the aligned 2^k x 2^k blocks of a table are the aligned runs of 4^k
/// numbers.
std::uint32_t morton(std::uint32_t a, std::uint32_t b);

/// Point i of a scrambled Sobol (0,2)-sequence: of every aligned run of 4^k points, one falls into each cell
/// of any division of the unit square into 4^k equal rectangles of power-of-two sides. The key chooses the
/// scrambling.
glm::dvec2 sobol_point(std::uint32_t i, std::uint32_t key);

/// The unit square divided into rows x columns tiles of 4 x 4 cells. A packet of 16 rays has one in each cell
/// of a tile.
struct Tiles {
    int rows = 0, columns = 0;

    int rays() const { return 16 * rows * columns; }
};

/// Tiles for at least so many rays, a multiple of 256, as close to square as that number allows.
Tiles make_tiles(int rays);

/// An orthonormal frame about a normal.
struct HemisphereFrame {
    glm::vec3 x, y, z;

    explicit HemisphereFrame(const glm::dvec3& normal);
};

/// Cosine-weighted directions through the cells of a tile, one at a random place of each.
/// x, y, z: [16], filled; length 1 within rounding to float.
void tile_directions(const HemisphereFrame& frame, const Tiles& tiles, int row, int column, std::uint32_t key,
                     float* x, float* y, float* z);

/// Spreads points of the unit square evenly over a convex polygon, all of them at least margin_m inside its
/// outline (or at its centroid, when it is that small). Refers to the corners: keep them alive.
class PolygonSampler {
public:
    PolygonSampler(std::span<const glm::dvec3> corners_m, const glm::dvec3& centroid_m, double margin_m);

    glm::dvec3 point(const glm::dvec2& square) const;

private:
    std::span<const glm::dvec3> corners_m_;
    glm::dvec3 centroid_m_;
    double shrink_ = 1.0;
    bool parallelogram_ = false;
};

}  // namespace naturel::embree_sampling
