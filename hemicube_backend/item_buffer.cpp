#include "hemicube_backend/item_buffer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>

namespace naturel {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Facets are drawn wider by this, so that no cell is lost between facets that share an edge, even where only
/// a part of it is an edge of the other (a T-junction). Geometry is rounded to 1 nm, so that cracks are a few
/// nm wide. A cell drawn by both keeps the nearer one. Facets seen from behind are drawn narrower instead:
/// the back of a solid must not show along its outline.
constexpr double crack_m = 1e-8;

/// A pointed facet gets no spikes by being drawn wider: it ends at this distance from its bounds, as a share
/// of the extent.
constexpr double spike = 1e-6;

struct Interval {
    double begin = infinity, end = -infinity;

    void include(double value) {
        begin = std::min(begin, value);
        end = std::max(end, value);
    }
    /// The edge from a point before the viewpoint to one behind it leaves the picture to infinity in
    /// direction `slope`.
    void include_infinity(double slope) {
        if (slope >= 0) end = infinity;
        if (slope <= 0) begin = -infinity;
    }
};

/// What the facet covers of the plane at most. corners: along the axes.
struct Bounds {
    Interval x, y;

    explicit Bounds(std::span<const glm::dvec3> corners) {
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const glm::dvec3& a = corners[k];
            const glm::dvec3& b = corners[k + 1 < corners.size() ? k + 1 : 0];
            if (a.z > 0) {
                x.include(a.x / a.z);
                y.include(a.y / a.z);
            }
            if ((a.z > 0) != (b.z > 0)) {
                const double side = a.z > 0 ? 1 : -1;
                x.include_infinity(side * (b.x * a.z - a.x * b.z));
                y.include_infinity(side * (b.y * a.z - a.y * b.z));
            }
        }
    }
};

/// The inner loop: 2 floats in, 2 out, per cell. A float's 24 bits place the line where two facets meet to
/// 1e-6 of the distance at which they are seen, or less than a thousandth of a cell; coplanar facets get
/// equal bits and tie.
void fill(float* __restrict inverse_depth, FacetId* __restrict items, const float* __restrict x, int count,
          float at_origin, float by_x, FacetId facet) {
    const auto id = static_cast<std::uint32_t>(facet);
    for (int k = 0; k < count; ++k) {
        const float candidate = at_origin + by_x * x[k];
        // A mask, because gcc makes branches of two conditional stores and then vectorises neither.
        const std::uint32_t nearer = candidate > inverse_depth[k] ? ~0u : 0u;
        items[k] = static_cast<FacetId>((static_cast<std::uint32_t>(items[k]) & ~nearer) | (id & nearer));
        inverse_depth[k] = std::max(candidate, inverse_depth[k]);
    }
}

}  // namespace

void ItemBuffer::draw(const FacetSet& facets, const FacetsAround& around, const ProjectionAxes& axes,
                      const ProjectionCells& cells, int row_begin, int row_end) {
    row_begin_ = row_begin;
    columns_ = static_cast<std::size_t>(cells.columns);
    const std::size_t count = static_cast<std::size_t>(row_end - row_begin) * columns_;
    items_.assign(count, FacetId::none);
    inverse_depth_.assign(count, 0.0f);
    left_.resize(static_cast<std::size_t>(cells.rows));
    right_.resize(static_cast<std::size_t>(cells.rows));
    for (const FacetsAround::Entry& entry : around.entries) {
        draw_facet(entry, facets.vertices_of(facets[entry.facet]), around.viewpoint_m, axes, cells, row_end);
    }
}

void ItemBuffer::draw_facet(const FacetsAround::Entry& entry, std::span<const glm::dvec3> vertices_m,
                            const glm::dvec3& viewpoint_m, const ProjectionAxes& axes,
                            const ProjectionCells& cells, int row_end) {
    corners_.clear();
    for (const glm::dvec3& vertex_m : vertices_m) {
        const glm::dvec3 from_viewpoint = vertex_m - viewpoint_m;
        corners_.emplace_back(glm::dot(from_viewpoint, axes.right), glm::dot(from_viewpoint, axes.up),
                              glm::dot(from_viewpoint, axes.forward));
    }
    const Bounds bounds(corners_);
    const std::span<const double> first_lines = cells.lines_of(0);
    const double x_extent = std::max(-first_lines.front(), first_lines.back());
    const double y_extent = std::max(-cells.row_lines.front(), cells.row_lines.back());
    if (bounds.x.begin > first_lines.back() || bounds.x.end < first_lines.front()) return;

    // Rows whose centre the facet may cover.
    const double* const y = cells.row_centres.data();
    const double* const first_row =
        std::lower_bound(y + row_begin_, y + row_end, bounds.y.begin - spike * y_extent);
    int begin = static_cast<int>(first_row - y);
    int end = static_cast<int>(std::upper_bound(first_row, y + row_end, bounds.y.end + spike * y_extent) - y);
    if (begin >= end) return;

    // A direction (x, y, 1) meets the facet if it lies inside the plane through the viewpoint and each edge:
    // g_x x + g_y y + g_1 >= 0, g = the cross product of the edge's ends. Such an edge bounds a row from one
    // side.
    double *const left = left_.data(), *const right = right_.data();
    std::fill(left + begin, left + end, bounds.x.begin - spike * x_extent);
    std::fill(right + begin, right + end, bounds.x.end + spike * x_extent);
    for (std::size_t k = 0; k < corners_.size(); ++k) {
        const glm::dvec3 &a = corners_[k], &b = corners_[k + 1 < corners_.size() ? k + 1 : 0];
        const glm::dvec3 g = entry.winding * glm::cross(a, b);
        const double size = std::abs(g.x) * x_extent + std::abs(g.y) * y_extent + std::abs(g.z);
        const double margin = crack_m * glm::distance(a, b) * (x_extent + y_extent + 1);
        const double constant = entry.from_behind ? g.z - margin : g.z + margin;
        if (std::abs(g.x) * x_extent <= 1e-14 * size) {  // along the rows: in or out as a whole
            while (begin < end && g.y * y[begin] + constant < 0)
                ++begin;
            while (begin < end && g.y * y[end - 1] + constant < 0)
                --end;
            continue;
        }
        const double slope = -g.y / g.x, at_zero = -constant / g.x;
        if (g.x > 0) {
            for (int row = begin; row < end; ++row)
                left[row] = std::max(left[row], at_zero + slope * y[row]);
        } else {
            for (int row = begin; row < end; ++row)
                right[row] = std::min(right[row], at_zero + slope * y[row]);
        }
    }

    const double w_x = glm::dot(entry.inverse_depth, axes.right),
                 w_y = glm::dot(entry.inverse_depth, axes.up),
                 w_1 = glm::dot(entry.inverse_depth, axes.forward);
    int first = 0, last = cells.columns;
    for (int row = begin; row < end; ++row) {
        if (!(left[row] <= right[row])) continue;
        first = cells.columns_before(row, left[row], first);
        last = cells.columns_before(row, right[row], last);
        const std::size_t offset =
            static_cast<std::size_t>(row - row_begin_) * columns_ + static_cast<std::size_t>(first);
        fill(inverse_depth_.data() + offset, items_.data() + offset, cells.centres_of(row).data() + first,
             last - first, static_cast<float>(w_1 + w_y * y[row]), static_cast<float>(w_x), entry.facet);
    }
}

}  // namespace naturel
