#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace naturel::embree_sampling {

/// Random bits as a function of a counter (Steele, Lea & Flood 2014, splitmix64): no state, so no order.
std::uint64_t mix(std::uint64_t x);

/// Bits of a and b (16 each) interleaved: the aligned 2^k x 2^k blocks of a table are the aligned runs of 4^k
/// numbers.
std::uint32_t morton(std::uint32_t a, std::uint32_t b);

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

/// One point of the unit square for each ray of a packet. Every aligned run of 4^k packets (numbers from
/// morton()) holds one point in each cell of any division of the square into 4^(k + 2) equal rectangles with
/// sides of powers of two. u, v: [16], filled; in [0, 1).
void tile_points(std::uint32_t packet, std::uint32_t key, float* u, float* v);

/// Spreads points of the unit square evenly over a convex polygon, all of them at least margin_m inside its
/// outline (or at its centroid, when it is that small). Refers to the corners: keep them alive.
class PolygonSampler {
public:
    /// Positions come out moved by `shift_m`: near the origin, where floats are fine.
    PolygonSampler(std::span<const glm::dvec3> corners_m, const glm::dvec3& centroid_m, double margin_m,
                   const glm::dvec3& shift_m);

    /// u, v: [16], in [0, 1); x, y, z: [16], filled.
    void place(const float* u, const float* v, float* x, float* y, float* z) const;

private:
    glm::dvec3 shrunk(const glm::dvec3& point_m) const;
    glm::dvec3 on_fan(double u, double v) const;

    std::span<const glm::dvec3> corners_m_;
    glm::dvec3 centroid_m_, shift_m_;
    double shrink_ = 1.0;
    bool parallelogram_ = false;
    glm::vec3 origin_m_{}, along_m_{}, across_m_{};  ///< of the shrunk and moved parallelogram
    std::vector<double> fan_m2_;                     ///< of any other polygon: doubled areas of its triangles
};

}  // namespace naturel::embree_sampling
