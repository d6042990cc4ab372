#include "hemicube_backend/round_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace naturel {
namespace {

using glm::dvec3;

/// Pixels along a side of a block.
constexpr int block_pixels = 64;

/// Cells along the sides of a pixel; where the pixels around a ray show the same, two are enough to miss nothing of half a
/// pixel.
constexpr int cells_per_pixel = 2;

/// A drawing spans no more than this tangent to each side, so that its cells are of much the same size.
constexpr double widest = 1.0;

/// Where a ray meets a facet, if it does and the view shows it there.
double distance_m(const FacetSet& facets, const FacetSet::Item& item, const Camera& camera, const dvec3& direction) {
    constexpr double nowhere = std::numeric_limits<double>::infinity();
    const double slope = glm::dot(item.plane_normal, direction);
    const double distance = (item.plane_offset_m - glm::dot(item.plane_normal, camera.eye_m)) / slope;
    if (!(distance > 0) || !std::isfinite(distance)) return nowhere;
    const Camera::Reach reach = camera.reach({camera.eye_m, direction});
    if (distance < reach.begin_m || distance > reach.end_m) return nowhere;
    const dvec3 point_m = camera.eye_m + distance * direction;
    const std::span<const dvec3> vertices_m = facets.vertices_of(item);
    const bool from_behind = item.side * slope > 0;
    for (std::size_t k = 0; k < vertices_m.size(); ++k) {
        const dvec3 edge = vertices_m[(k + 1) % vertices_m.size()] - vertices_m[k];
        const double inside = item.side * glm::dot(glm::cross(item.plane_normal, edge), point_m - vertices_m[k]);
        if (inside < (from_behind ? crack_m : -crack_m) * glm::length(edge)) return nowhere;
    }
    return distance;
}

}  // namespace

void RoundView::draw(const FacetSet& facets, const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) {
    for (int row = row_begin; row < row_end; row += block_pixels)
        for (int column = 0; column < camera.width; column += block_pixels)
            draw_block(facets, camera, {row, std::min(row + block_pixels, row_end), column, std::min(column + block_pixels, camera.width)},
                       row_begin, seen);
}

void RoundView::draw_block(const FacetSet& facets, const Camera& camera, const Block& block, int first_row, std::span<FacetId> seen) {
    directions_.clear();
    dvec3 middle{0};
    for (int row = block.row_begin; row < block.row_end; ++row) {
        for (int column = block.column_begin; column < block.column_end; ++column) {
            const bool shown = camera.shows(column + 0.5, row + 0.5);
            directions_.push_back(shown ? camera.ray(column + 0.5, row + 0.5).direction : dvec3(0));
            middle += directions_.back();
        }
    }
    const auto at = [&](int row, int column) {
        return seen.begin() + static_cast<std::ptrdiff_t>(row - first_row) * camera.width + column;
    };
    const auto each_pixel = [&](const auto& tell) {
        auto direction = directions_.begin();
        for (int row = block.row_begin; row < block.row_end; ++row)
            for (int column = block.column_begin; column < block.column_end; ++column) *at(row, column) = tell(*direction++);
    };
    if (glm::length(middle) < 1e-9) {
        const bool shown = std::ranges::any_of(directions_, [](const dvec3& d) { return d != dvec3(0); });
        if (!shown) return each_pixel([](const dvec3&) { return FacetId::none; });
    }
    // The drawing lies before the mean direction.
    const PlaneFrame plane = make_plane_frame(camera.eye_m, glm::length(middle) < 1e-9 ? camera.forward : glm::normalize(middle));
    Camera drawing{.kind = ViewKind::perspective, .eye_m = camera.eye_m, .right = plane.y, .up = plane.x, .forward = plane.normal,
                   .cut_planes = camera.cut_planes, .see_through = camera.see_through};
    bool too_wide = false;
    for (const dvec3& d : directions_) {
        if (d == dvec3(0)) continue;
        const double depth = glm::dot(d, drawing.forward);
        too_wide = too_wide || depth < 0.1;
        drawing.half_width = std::max(drawing.half_width, std::abs(glm::dot(d, drawing.right)) / depth);
        drawing.half_height = std::max(drawing.half_height, std::abs(glm::dot(d, drawing.up)) / depth);
    }
    const int rows = block.row_end - block.row_begin, columns = block.column_end - block.column_begin;
    if ((too_wide || drawing.half_width > widest || drawing.half_height > widest) && rows * columns > 1) {
        const int row_middle = block.row_begin + (rows + 1) / 2, column_middle = block.column_begin + (columns + 1) / 2;
        const std::array<Block, 2> halves =
            rows >= columns ? std::array{Block{block.row_begin, row_middle, block.column_begin, block.column_end},
                                         Block{row_middle, block.row_end, block.column_begin, block.column_end}}
                            : std::array{Block{block.row_begin, block.row_end, block.column_begin, column_middle},
                                         Block{block.row_begin, block.row_end, column_middle, block.column_end}};
        for (const Block& half : halves) draw_block(facets, camera, half, first_row, seen);
        return;
    }
    // A margin, so that the cells around each ray are there.
    drawing.width = drawing.height = std::max(block_pixels / 2, cells_per_pixel * std::max(rows, columns));
    const double margin = 1.0 + 4.0 / drawing.width;
    drawing.half_width = margin * std::max(drawing.half_width, 1e-6);
    drawing.half_height = margin * std::max(drawing.half_height, 1e-6);
    const ProjectionCells cells = picture_cells(drawing);
    buffer_.draw(facets, {drawing.eye_m, {drawing.right, -drawing.up, drawing.forward}, false, drawing.cut_planes, drawing.see_through},
                 cells, FacetKind::opaque);
    each_pixel([&](const dvec3& direction) {
        return direction == dvec3(0) ? FacetId::none : seen_along(facets, camera, direction, cells);
    });
}

/// Where the cells around a ray show one thing, so does the ray; elsewhere it is asked which of them it meets.
FacetId RoundView::seen_along(const FacetSet& facets, const Camera& camera, const dvec3& direction, const ProjectionCells& cells) const {
    const ProjectionAxes& axes = buffer_.projection().axes;
    const double depth = glm::dot(direction, axes.forward);
    // The cells are uniform, and the drawing is wider than all rays.
    const auto place = [&](const glm::dvec3& axis, double begin, int count) {
        return std::clamp(static_cast<int>((glm::dot(direction, axis) / depth - begin) * count / (-2 * begin)), 0, count - 1);
    };
    const int row = place(axes.up, cells.row_lines.front(), cells.rows);
    const int column = place(axes.right, cells.column_lines.front(), cells.columns);
    const ItemCode own = buffer_.codes(row)[column];
    std::array<ItemCode, 9> others;  // the own cell comes last
    std::size_t count = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, cells.rows - 1); ++r) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, cells.columns - 1); ++c)
            if (buffer_.codes(r)[c] != own) others[count++] = buffer_.codes(r)[c];
    }
    if (count == 0) return ItemBuffer::facet_of(own);
    bool open = own == empty_item;
    ItemCode best = empty_item;
    double nearest = std::numeric_limits<double>::infinity();
    others[count++] = own;
    for (const ItemCode code : std::span(others).first(count)) {
        open = open || code == empty_item;
        if (code == empty_item) continue;
        const double distance = distance_m(facets, facets[ItemBuffer::facet_of(code)], camera, direction);
        if (!std::isfinite(distance)) continue;
        if (distance < nearest || (distance == nearest && code < best)) best = code, nearest = distance;
    }
    // A ray between all of them, where nothing is open, has found a crack of rounding.
    return ItemBuffer::facet_of(best == empty_item && !open ? own : best);
}

}  // namespace naturel
