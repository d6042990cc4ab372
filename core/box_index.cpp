#include "core/box_index.h"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>

#include "core/errors.h"

namespace naturel {
namespace {

using glm::dvec3;

bool holds(const Box& box, const dvec3& p) {
    return p.x >= box.low_m.x && p.x <= box.high_m.x && p.y >= box.low_m.y && p.y <= box.high_m.y && p.z >= box.low_m.z &&
           p.z <= box.high_m.z;
}

}  // namespace

Box box_around(std::span<const dvec3> points_m, double margin_m) {
    NATUREL_EXPECT(!points_m.empty());
    Box box{points_m[0], points_m[0]};
    for (const dvec3& p : points_m) box = {glm::min(box.low_m, p), glm::max(box.high_m, p)};
    return {box.low_m - margin_m, box.high_m + margin_m};
}

BoxIndex::BoxIndex(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!boxes_.empty()) build(0, static_cast<std::uint32_t>(boxes_.size()));
}

void BoxIndex::build(std::uint32_t first, std::uint32_t count) {
    constexpr std::uint32_t most_in_leaf = 4;
    const std::size_t self = nodes_.size();
    Box all = boxes_[order_[first]];
    dvec3 low = all.low_m + all.high_m, high = low;  // of twice the centres
    for (std::uint32_t k = first; k < first + count; ++k) {
        const Box& box = boxes_[order_[k]];
        all = {glm::min(all.low_m, box.low_m), glm::max(all.high_m, box.high_m)};
        low = glm::min(low, box.low_m + box.high_m);
        high = glm::max(high, box.low_m + box.high_m);
    }
    nodes_.push_back({all, first, count, 0});
    if (count <= most_in_leaf) return;

    const dvec3 extent = high - low;
    int axis = extent.y > extent.x ? 1 : 0;
    if (extent.z > extent[axis]) axis = 2;
    const std::uint32_t half = count / 2;
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
        const double at_a = boxes_[a].low_m[axis] + boxes_[a].high_m[axis];
        const double at_b = boxes_[b].low_m[axis] + boxes_[b].high_m[axis];
        return at_a < at_b || (at_a == at_b && a < b);
    });
    nodes_[self].count = 0;
    build(first, half);
    nodes_[self].right = static_cast<std::uint32_t>(nodes_.size());
    build(first + half, count - half);
}

void BoxIndex::containing(const dvec3& point_m, std::vector<std::uint32_t>& found) const {
    found.clear();
    for_each([&](const Box& box) { return holds(box, point_m); }, [&](std::uint32_t number) { found.push_back(number); });
    std::sort(found.begin(), found.end());
}

}  // namespace naturel
