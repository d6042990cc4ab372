#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace naturel::embree_sampling {

/// Random bits as a function of a counter (Steele, Lea & Flood 2014, splitmix64): no state, so no order.
std::uint64_t mix(std::uint64_t x);

/// Bits of a and b (16 each) interleaved: the aligned 2^k x 2^k blocks of a table are the aligned runs of 4^k
/// numbers.
std::uint32_t morton(std::uint32_t a, std::uint32_t b);

/// The unit square divided into rows x columns tiles of 4 x 4 cells.
struct Tiles {
    int rows = 0, columns = 0;

    int rays() const { return 16 * rows * columns; }
};

/// Tiles for at least so many rays, a multiple of 256, as close to square as that number allows.
Tiles make_tiles(int rays);

/// An orthonormal frame about a normal, one of the eight that the symmetries of the square make of one another.
struct HemisphereFrame {
    glm::vec3 x, y, z;

    explicit HemisphereFrame(const glm::dvec3& normal, std::uint32_t symmetry = 0);
};

/// Rays that neighbour each other in a packet: half a tile.
inline constexpr std::uint32_t rays_per_packet = 8;

/// The rays of a hemisphere are eight samples in one: the k-th rays of all packets. Each is stratified like the whole, with one
/// ray in every half tile. How much they differ tells how well all of them together know a form factor.
inline constexpr std::uint32_t sub_samples = rays_per_packet;

/// Cosine-weighted directions about the z axis, one at a random place in each cell of the tiles. By packets; the two of
/// a tile follow each other. Lane k of any packet belongs to sub-sample k.
struct RayTable {
    std::vector<float> x{}, y{}, z{};  ///< [rays], length 1 within rounding to float

    int rays() const { return static_cast<int>(x.size()); }
};

RayTable make_ray_table(const Tiles& tiles, std::uint64_t key);

/// Where on the patch each ray of a table starts: points of the unit square, as binary fractions of 32 bits.
/// The 8 k points of k packets, k a power of two, that make up a square or two of tiles lie one in each cell of any division of the
/// unit square into 8 k equal rectangles with sides of powers of two; so do the k points of each sub-sample.
struct StartTable {
    std::vector<std::uint32_t> u{}, v{};  ///< [rays]
};

StartTable make_start_table(const Tiles& tiles);

/// A number of tables of one size, each made when it is first asked for. Safe to use from many threads.
class RayTables {
public:
    RayTables(const Tiles& tiles, std::size_t count, std::uint64_t seed);
    const RayTable& table(std::uint64_t random) const;
    const StartTable& starts() const { return starts_; }
    int rays() const { return tiles_.rays(); }

private:
    struct Slot {
        std::once_flag made;
        RayTable table;
    };
    Tiles tiles_;
    StartTable starts_;
    std::uint64_t seed_;
    std::size_t count_;
    std::unique_ptr<Slot[]> slots_;
};

/// The directions of a packet, from ray `first` of the table on. x, y, z: [8], filled.
void place_directions(const HemisphereFrame& frame, const RayTable& table, std::size_t first, float* x, float* y,
                      float* z);

/// A random digital shift of points of the unit square: keeps their strata.
struct DigitalShift {
    std::uint32_t u = 0, v = 0;
};

/// What a packet needs of its rays: [8] each.
struct RayLanes {
    float *start_x, *start_y, *start_z, *x, *y, *z;
};

/// Directions and starts of a packet at once, from ray `first` of the tables on; starts on a parallelogram: origin and two sides.
void place_rays(const HemisphereFrame& frame, const RayTable& table, const float* parallelogram_m, const StartTable& starts,
                const DigitalShift& shift, std::size_t first, const RayLanes& rays);

/// One triangle of the fan from the first corner of a polygon: tip + outward (first + v second), in metres.
struct FanTriangle {
    float begin = 0.0f, share = 1.0f;  ///< of the area of the polygon: u in [begin, begin + share) is in here
    std::array<float, 3> tip{}, first{}, second{};
};

/// Spreads points of the unit square evenly over a convex polygon, all of them at least margin_m inside its
/// outline (or at its centroid, when it is that small).
class PolygonSampler {
public:
    /// Positions come out moved by `shift_m`: near the origin, where floats are fine.
    PolygonSampler(std::span<const glm::dvec3> corners_m, const glm::dvec3& centroid_m, double margin_m,
                   const glm::dvec3& shift_m);

    /// The starts of a packet, from ray `first` of the table on. x, y, z: [8], filled.
    void place(const StartTable& table, std::size_t first, const DigitalShift& shift, float* x, float* y, float* z) const;

    /// Origin and two sides of the polygon moved and kept off its outline, if it is a parallelogram; else null.
    const float* parallelogram_m() const { return parallelogram_ ? parallelogram_m_.data() : nullptr; }

private:
    glm::dvec3 shrunk(const glm::dvec3& point_m) const;

    std::vector<glm::dvec3> corners_m_;  ///< without those in the middle of an edge
    glm::dvec3 centroid_m_, shift_m_;
    double shrink_ = 1.0;
    bool parallelogram_ = false;
    std::array<float, 9> parallelogram_m_{};  ///< origin and two sides, shrunk and moved
    std::vector<FanTriangle> fan_;  ///< of any other polygon
};

}  // namespace naturel::embree_sampling
