#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "embree_backend/pair_geometry.h"

namespace naturel::pairwise {

struct ExchangeEstimate {
    double value_m2 = 0.0;
    double error_m2 = 0.0;  ///< estimate (docs/method.md, "Pairs of patches")
};

/// Which side of the occluders the points are on: of a solid, the faces that lines enter by or those that they leave by.
enum class Side { front, back };

/// Form factors past occluders: from points of one polygon, the shadows that occluders cast on the plane of another one are cut
/// out of it exactly, and what is left is integrated in closed form (Lambert). Scratch memory; one for each thread.
class Shadows {
public:
    /// Share of `unoccluded_m2`, the exchange of `from` and `to` (both cut by each other's horizon) that gets past the
    /// occluders. Cells of `from` are divided until the error is below `tolerance_m2`.
    ExchangeEstimate exchange(const Polygon& from, const Polygon& to, double unoccluded_m2, double tolerance_m2,
                              std::span<const Occluder> occluders, std::span<const glm::dvec3> occluder_vertices_m,
                              std::span<const std::uint32_t> chosen, Side side);

    /// Form factor from a point to the part of `to` that it sees above its horizon.
    double from_point(const glm::dvec3& point_m, const glm::dvec3& normal, const Polygon& to,
                      std::span<const Occluder> occluders, std::span<const glm::dvec3> occluder_vertices_m,
                      std::span<const std::uint32_t> chosen);

private:
    static constexpr int most_corners = 48;
    /// A polygon in the plane of the target. Copies what is used of it.
    struct Flat {
        int count = 0;
        double x[most_corners], y[most_corners];
        Flat() {}  // leaves the corners as they are: filling them would cost more than the cuts
        Flat(const Flat& other) { *this = other; }
        Flat& operator=(const Flat& other) {
            count = other.count;
            std::copy_n(other.x, count, x);
            std::copy_n(other.y, count, y);
            return *this;
        }
    };
    /// A convex shadow: what has a x + b y + c >= 0 for all its edges.
    struct Shade {
        int edges = 0;
        double a[2 * most_vertices], b[2 * most_vertices], c[2 * most_vertices];
    };
    /// A parallelogram origin + s u + t v, or its half where s + t <= 1.
    struct Cell {
        glm::dvec3 origin_m{}, u_m{}, v_m{};
        bool triangle = false;
        double visible = 0.0, all = 0.0;  ///< form factor times area, with and without occluders
        double error = 0.0;
        int depth = 0;
    };
    void aim(const Polygon& to, const glm::dvec3& normal, std::span<const Occluder> occluders,
             std::span<const glm::dvec3> occluder_vertices_m, std::span<const std::uint32_t> chosen, Side side);
    double seen_from(const glm::dvec3& point_m, double& all);
    void evaluate(Cell& cell);
    void subtract(const Shade& shade);
    static void keep(const Flat& p, const double* height, double sign, Flat& kept);
    double lambert(const Flat& piece, double px, double py, double pz) const;

    // The target in its own plane: x along u, y along v, height along the normal.
    glm::dvec3 origin_m_{}, u_{}, v_{}, n_{};
    Flat target_;
    double nx_ = 0, ny_ = 0, nz_ = 0;  // normal of the receiving side in that frame
    struct Flattened {
        int count = 0;
        double x[most_vertices], y[most_vertices], z[most_vertices];
        double nx = 0, ny = 0, nz = 0, plane = 0;
    };
    std::vector<Flattened> blockers_;
    std::vector<Flat> pieces_, next_;
    std::vector<Cell> cells_;
    double tolerance_m2_ = 0.0;
    double range_ = 0.0;  ///< of the shares seen from the points of the undivided cells
};

}  // namespace naturel::pairwise
