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

/// Finds boxes by where they are, in a time that grows with the logarithm of their number where few overlap: a binary tree, cut at the
/// median of the centres.
class BoxIndex {
public:
    explicit BoxIndex(std::vector<Box> boxes);

    /// found: cleared, then filled with the numbers of the boxes that hold the point, in increasing order.
    void containing(const glm::dvec3& point_m, std::vector<std::uint32_t>& found) const;

    /// Calls use(number) for every box for which wanted(box) holds, in no particular order. wanted: true for a box if it is for any box
    /// inside it.
    template <class Wanted, class Use>
    void for_each(const Wanted& wanted, const Use& use) const {
        if (nodes_.empty()) return;
        // The depth is the logarithm of the number of boxes: below 32.
        std::uint32_t waiting[64];
        std::size_t count = 0;
        waiting[count++] = 0;
        while (count > 0) {
            const std::uint32_t at = waiting[--count];
            const Node& node = nodes_[at];
            if (!wanted(node.box)) continue;
            if (node.count == 0) {
                waiting[count++] = at + 1;
                waiting[count++] = node.right;
                continue;
            }
            for (std::uint32_t k = node.first; k < node.first + node.count; ++k)
                if (wanted(boxes_[order_[k]])) use(order_[k]);
        }
    }

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
