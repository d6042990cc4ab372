#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace naturel {

/// An axis-parallel box, its faces included.
struct Box {
    glm::dvec3 low_m{}, high_m{};
};

/// The smallest box around points, grown by `margin_m` on every side. At least one point.
Box box_around(std::span<const glm::dvec3> points_m, double margin_m);

/// Finds the boxes that hold a point, in a time that grows with the logarithm of their number where few overlap: a binary tree,
/// cut at the median of the centres.
class BoxIndex {
public:
    explicit BoxIndex(std::vector<Box> boxes);

    /// found: cleared, then filled with the numbers of the boxes that hold the point, in increasing order.
    void containing(const glm::dvec3& point_m, std::vector<std::uint32_t>& found) const;

private:
    struct Node {
        Box box{};
        std::uint32_t first = 0, count = 0;  ///< leaf: of order_
        std::uint32_t right = 0;             ///< else: the second child; the first one follows its parent
    };
    void build(std::uint32_t first, std::uint32_t count);

    std::vector<Box> boxes_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace naturel
