#include "hemicube_backend/item_buffer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace naturel {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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

/// What a polygon covers of the plane at most. corners: homogeneous, at (x / z, y / z).
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

/// Depths of what is nearer than this share more are told apart whatever the rounding: it is 100 times that of a float.
constexpr double depth_rounding = 1e-5;

constexpr float nothing_drawn = std::numeric_limits<float>::quiet_NaN();

/// The sides of what a plane shows: dot(inward, p - eye) + offset >= 0 inside.
struct Side {
    glm::dvec3 inward{};
    double offset = 0.0;
};

}  // namespace

struct ItemBuffer::Window {
    Side sides[5];

    Window(const Projection& projection, const ProjectionCells& cells, int row_begin, int row_end) {
        const auto& [right, up, forward] = projection.axes;
        const auto [x_begin, x_end] = cells.x_extent();
        const double y_begin = cells.row_lines[static_cast<std::size_t>(row_begin)],
                     y_end = cells.row_lines[static_cast<std::size_t>(row_end)];
        sides[0] = {forward, 0};
        if (projection.parallel) {
            sides[1] = {right, -x_begin}, sides[2] = {-right, x_end};
            sides[3] = {up, -y_begin}, sides[4] = {-up, y_end};
        } else {
            sides[1] = {right - x_begin * forward, 0}, sides[2] = {x_end * forward - right, 0};
            sides[3] = {up - y_begin * forward, 0}, sides[4] = {y_end * forward - up, 0};
        }
    }

    bool misses(const FacetSet::Node& node, const glm::dvec3& eye_m) const {
        for (const Side& side : sides) {
            const double reach = glm::dot(glm::abs(side.inward), node.half_size_m) + edge_on_m;
            if (glm::dot(side.inward, node.centre_m - eye_m) + side.offset + reach < 0) return true;
        }
        return false;
    }
};

void ItemBuffer::draw(const FacetSet& facets, const Projection& projection, const ProjectionCells& cells, FacetKind kind,
                      int row_begin, int row_end) {
    projection_ = projection;
    cells_ = &cells;
    row_begin_ = row_begin;
    row_end_ = row_end;
    // Whole tiles, and room for a kernel that runs past the last cell.
    stride_ = (cells.columns + tile_columns - 1) / tile_columns * tile_columns + kernel_lanes;
    const auto rows = static_cast<std::size_t>(row_end - row_begin);
    // 1 / t of a perspective is positive before the viewpoint.
    const float empty_depth = projection.parallel ? std::numeric_limits<float>::lowest() : std::numeric_limits<float>::denorm_min();
    items_.assign(rows * static_cast<std::size_t>(stride_), empty_item);
    depth_.assign(items_.size(), empty_depth);
    for (std::size_t row = 0; row < rows; ++row) {
        float* const end = depth_.data() + static_cast<std::ptrdiff_t>(row + 1) * stride_;
        std::fill(end - stride_ + cells.columns, end, std::numeric_limits<float>::max());
    }
    farthest_.assign(cells.tiles.size(), nothing_drawn);
    left_.resize(rows + kernel_lanes);
    right_.resize(rows + kernel_lanes);
    at_origin_.resize(rows);
    first_.resize(rows + kernel_lanes);
    last_.resize(rows + kernel_lanes);
    entries_.clear();
    entry_of_.resize(facets.size());
    add(facets, kind);
}

/// Front to back, as far as boxes tell; what is hidden as a whole is left out.
void ItemBuffer::add(const FacetSet& facets, FacetKind kind) {
    const bool draws_all = kind == FacetKind::all || kind == FacetKind::all_from_air;
    const std::vector<FacetSet::Node>& tree = facets.tree();
    if (tree.empty()) return;
    const Window window(projection_, *cells_, row_begin_, row_end_);
    const auto distance = [&](const FacetSet::Node& node) {
        const glm::dvec3 to_centre = node.centre_m - projection_.eye_m;
        if (projection_.parallel)
            return glm::dot(to_centre, projection_.axes.forward) - glm::dot(glm::abs(projection_.axes.forward), node.half_size_m);
        const glm::dvec3 gap = glm::max(glm::abs(to_centre) - node.half_size_m, glm::dvec3(0));
        return glm::dot(gap, gap);
    };
    stack_.assign(1, 0);
    while (!stack_.empty()) {
        const FacetSet::Node& node = tree[stack_.back()];
        stack_.pop_back();
        if (!draws_all && !(kind == FacetKind::opaque ? node.has_opaque : node.has_apertures)) continue;
        if (window.misses(node, projection_.eye_m) || box_is_hidden(node)) continue;
        if (node.count == 0) {
            const bool second_first = distance(tree[node.first + 1]) < distance(tree[node.first]);
            stack_.push_back(node.first + (second_first ? 0 : 1));
            stack_.push_back(node.first + (second_first ? 1 : 0));
            continue;
        }
        for (std::uint32_t k = 0; k < node.count; ++k) {
            const FacetId facet = facets.leaf_facets()[node.first + k];
            if (draws_all || facets[facet].is_aperture == (kind == FacetKind::apertures))
                draw_facet(facets, facet, kind == FacetKind::all_from_air);
        }
    }
}

float ItemBuffer::farthest_in_tile(std::size_t tile_row, std::size_t tile) {
    float& farthest = farthest_[tile];
    if (std::isnan(farthest)) {
        const int begin = std::max(row_begin_, static_cast<int>(tile_row) * tile_rows);
        const int end = std::min(row_end_, (static_cast<int>(tile_row) + 1) * tile_rows);
        const auto column = static_cast<std::ptrdiff_t>(tile % cells_->tiles_per_row) * tile_columns;
        farthest = smallest_depth(depth_.data() + (begin - row_begin_) * stride_ + column, end - begin, stride_);
    }
    return farthest;
}

bool ItemBuffer::is_hidden(const Extent& x, const Extent& y, double nearest) {
    const auto bound = static_cast<float>(nearest + depth_rounding * std::abs(nearest));
    const double* const centres = cells_->row_centres.data();
    const double* const first = std::lower_bound(centres + row_begin_, centres + row_end_, y.begin);
    const double* const last = std::upper_bound(first, centres + row_end_, y.end);
    if (first == last) return true;
    const auto begin = static_cast<std::size_t>(first - centres) / tile_rows;
    const auto end = static_cast<std::size_t>(last - centres - 1) / tile_rows + 1;
    for (std::size_t tile_row = begin; tile_row < end; ++tile_row) {
        for (std::size_t tile = tile_row * cells_->tiles_per_row; tile < (tile_row + 1) * cells_->tiles_per_row; ++tile) {
            const ProjectionCells::Tile& bounds = cells_->tiles[tile];
            if (bounds.x_begin <= x.end && bounds.x_end >= x.begin && !(farthest_in_tile(tile_row, tile) > bound)) return false;
        }
    }
    return true;
}

bool ItemBuffer::box_is_hidden(const FacetSet::Node& node) {
    const auto& [right, up, forward] = projection_.axes;
    const glm::dvec3 to_centre = node.centre_m - projection_.eye_m;
    const double nearest_m = glm::dot(forward, to_centre) - glm::dot(glm::abs(forward), node.half_size_m);
    if (nearest_m <= edge_on_m) return false;
    const glm::dvec3 centre(glm::dot(right, to_centre), glm::dot(up, to_centre), glm::dot(forward, to_centre));
    const auto along_axes = [&](int axis) {
        glm::dvec3 half_edge(0);
        half_edge[axis] = node.half_size_m[axis];
        return glm::dvec3(glm::dot(right, half_edge), glm::dot(up, half_edge), glm::dot(forward, half_edge));
    };
    const glm::dvec3 a = along_axes(0), b = along_axes(1), c = along_axes(2);
    Interval x, y;
    for (const glm::dvec3& p : {a + b + c, a + b - c, a - b + c, a - b - c}) {
        for (const glm::dvec3& corner : {centre + p, centre - p}) {
            const double scale = projection_.parallel ? 1 : 1 / corner.z;
            x.include(corner.x * scale);
            y.include(corner.y * scale);
        }
    }
    const double margin = spike * cells_->reach();
    return is_hidden({x.begin - margin, x.end + margin}, {y.begin - margin, y.end + margin},
                     projection_.parallel ? -nearest_m : 1 / nearest_m);
}

void ItemBuffer::cut_corners() {
    const auto& [right, up, forward] = projection_.axes;
    /// inward: along the axes; what has dot(inward, p) + offset >= 0 stays.
    const auto cut = [&](const glm::dvec3& inward, double offset) {
        const auto height = [&](const glm::dvec3& p) { return glm::dot(inward, p) + offset; };
        if (std::ranges::all_of(corners_, [&](const glm::dvec3& p) { return height(p) >= 0; })) return;
        clipped_.clear();
        for (std::size_t k = 0; k < corners_.size(); ++k) {
            const glm::dvec3 &a = corners_[k], &b = corners_[k + 1 < corners_.size() ? k + 1 : 0];
            const double above_a = height(a), above_b = height(b);
            if (above_a >= 0) clipped_.push_back(a);
            if ((above_a >= 0) != (above_b >= 0)) clipped_.push_back(a + above_a / (above_a - above_b) * (b - a));
        }
        corners_.swap(clipped_);
    };
    if (projection_.parallel) cut({0, 0, 1}, 0);  // only what lies before the plane of the view is seen
    for (const CutPlane& plane : projection_.cut_planes) {
        cut({-glm::dot(plane.normal, right), -glm::dot(plane.normal, up), -glm::dot(plane.normal, forward)},
            -height_over(plane, projection_.eye_m));
    }
}

void ItemBuffer::draw_facet(const FacetSet& facets, FacetId facet, bool from_air) {
    const FacetSet::Item& item = facets[facet];
    const auto& [right, up, forward] = projection_.axes;
    const glm::dvec3& eye_m = projection_.eye_m;
    const double distance_m = item.plane_offset_m - glm::dot(item.plane_normal, eye_m);
    Entry entry{.facet = facet};
    bool from_behind = false;
    if (projection_.parallel) {
        const double slope = glm::dot(item.plane_normal, forward);
        if (std::abs(slope) <= 1e-9) return;  // seen edge-on: 1 nm of depth for 1 m
        from_behind = item.side * slope > 0;
        entry.w_1 = -distance_m / slope;
        entry.w_x = glm::dot(item.plane_normal, right) / slope;
        entry.w_y = glm::dot(item.plane_normal, up) / slope;
    } else {
        if (std::abs(distance_m) <= edge_on_m) return;
        from_behind = item.side * distance_m > 0;
        entry.inverse_depth = (1 / distance_m) * item.plane_normal;
        entry.w_1 = glm::dot(entry.inverse_depth, forward);
        entry.w_x = glm::dot(entry.inverse_depth, right);
        entry.w_y = glm::dot(entry.inverse_depth, up);
    }
    if (from_behind && (item.faces_a_twin || (from_air && item.closes_solid))) return;
    if (projection_.see_through != SeeThrough::nothing &&
        (from_behind || (projection_.see_through == SeeThrough::walls && !item.exchanges_light)))
        return;

    corners_.clear();
    for (const glm::dvec3& vertex_m : facets.vertices_of(item)) {
        const glm::dvec3 p = vertex_m - eye_m;
        corners_.emplace_back(glm::dot(p, right), glm::dot(p, up), glm::dot(p, forward));
    }
    cut_corners();
    if (corners_.size() < 3) return;
    double nearest_m = infinity;
    for (glm::dvec3& corner : corners_) {
        nearest_m = std::min(nearest_m, corner.z);
        if (projection_.parallel) corner.z = 1;
    }

    const auto [x_begin, x_end] = cells_->x_extent();
    const double x_extent = std::max(-x_begin, x_end);
    const double y_extent = std::max(-cells_->row_lines.front(), cells_->row_lines.back());
    const Bounds bounds(corners_);
    const Extent x{bounds.x.begin - spike * x_extent, bounds.x.end + spike * x_extent};
    const Extent y{bounds.y.begin - spike * y_extent, bounds.y.end + spike * y_extent};
    if (x.begin > x_end || x.end < x_begin) return;

    // Rows whose centre the facet may cover.
    const double* const centres = cells_->row_centres.data();
    const double* const first_row = std::lower_bound(centres + row_begin_, centres + row_end_, y.begin);
    int begin = static_cast<int>(first_row - centres);
    int end = static_cast<int>(std::upper_bound(first_row, centres + row_end_, y.end) - centres);
    if (begin >= end) return;
    if (nearest_m > edge_on_m) {
        // Depths are rounded as floats; on a plane that is seen almost edge-on, their sum cancels.
        const double rounding = 0x1p-22 * (std::abs(entry.w_1) + std::abs(entry.w_x) * x_extent + std::abs(entry.w_y) * y_extent);
        if (is_hidden(x, y, (projection_.parallel ? -nearest_m : 1 / nearest_m) + rounding)) return;
    }

    // A direction (x, y, 1) meets the facet if it lies inside the plane through the viewpoint and each edge:
    // g_x x + g_y y + g_1 >= 0, g = the cross product of the edge's ends. Such an edge bounds a row from one
    // side.
    begin -= row_begin_, end -= row_begin_;  // from here on rows count from the first one drawn
    const double* const y_of = centres + row_begin_;
    double *const left = left_.data(), *const right_end = right_.data();
    std::fill(left + begin, left + end, x.begin);
    std::fill(right_end + begin, right_end + end, x.end);
    const double winding = from_behind ? 1 : -1;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
        const glm::dvec3 &a = corners_[k], &b = corners_[k + 1 < corners_.size() ? k + 1 : 0];
        const glm::dvec3 g = winding * glm::cross(a, b);
        const double size = std::abs(g.x) * x_extent + std::abs(g.y) * y_extent + std::abs(g.z);
        const double margin = crack_m * glm::distance(a, b) * (projection_.parallel ? 1 : x_extent + y_extent + 1);
        const double constant = from_behind ? g.z - margin : g.z + margin;
        if (std::abs(g.x) * x_extent <= 1e-14 * size) {  // along the rows: in or out as a whole
            while (begin < end && g.y * y_of[begin] + constant < 0) ++begin;
            while (begin < end && g.y * y_of[end - 1] + constant < 0) --end;
            continue;
        }
        const double slope = -g.y / g.x, at_zero = -constant / g.x;
        if (g.x > 0)
            raise_left(left + begin, y_of + begin, end - begin, at_zero, slope);
        else
            lower_right(right_end + begin, y_of + begin, end - begin, at_zero, slope);
    }
    if (begin >= end) return;

    if (cells_->uniform) {
        count_columns_before(left + begin, end - begin, x_begin, cells_->columns_per_unit, cells_->columns, first_.data() + begin);
        count_columns_before(right_end + begin, end - begin, x_begin, cells_->columns_per_unit, cells_->columns, last_.data() + begin);
    } else {
        for (int row = begin, first = 0, last = cells_->columns; row < end; ++row) {
            first_[static_cast<std::size_t>(row)] = first = cells_->columns_before(row_begin_ + row, left[row], first);
            last_[static_cast<std::size_t>(row)] = last = cells_->columns_before(row_begin_ + row, right_end[row], last);
        }
    }
    bool any = false;
    for (int row = begin; row < end;) {
        const int tile_row = (row_begin_ + row) / tile_rows, tile_end = std::min((tile_row + 1) * tile_rows - row_begin_, end);
        int first = cells_->columns, last = 0;
        for (; row < tile_end; ++row) {
            const auto r = static_cast<std::size_t>(row);
            at_origin_[r] = entry.w_1 + entry.w_y * y_of[row];
            first = std::min(first, first_[r]);
            last = std::max(last, last_[r]);
        }
        if (first >= last) continue;
        any = true;
        float* const tiles = farthest_.data() + static_cast<std::size_t>(tile_row) * cells_->tiles_per_row;
        std::fill(tiles + first / tile_columns, tiles + (last - 1) / tile_columns + 1, nothing_drawn);
    }
    if (!any) return;
    draw_spans({.first = first_.data() + begin,
                .last = last_.data() + begin,
                .at_origin = at_origin_.data() + begin,
                .by_x = entry.w_x,
                .x = cells_->centres_of(row_begin_ + begin).data(),
                .x_stride = cells_->uniform ? 0 : cells_->columns,
                .depth = depth_.data() + begin * stride_,
                .items = items_.data() + begin * stride_,
                .stride = stride_,
                .code = static_cast<ItemCode>(static_cast<std::uint32_t>(facet) | (from_behind ? 0u : 0x8000'0000u))},
               end - begin);
    entry_of_[index(facet)] = static_cast<std::uint32_t>(entries_.size());
    entries_.push_back(entry);
}

}  // namespace naturel
