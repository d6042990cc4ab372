#include "hemicube_backend/patch_lookup.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

namespace naturel {
namespace {

/// No building is larger; keeps points under cells finite, m.
constexpr double farthest_m = 1e6;

/// In place of the number of a grid cell: what the cell shows exchanges no light.
constexpr std::int32_t nowhere = -1;

}  // namespace

void PatchSums::move_to(FormFactorRow& row, double scale) {
    for (std::size_t word = 0; word < touched_.size(); ++word) {
        for (std::uint64_t bits = std::exchange(touched_[word], 0); bits != 0; bits &= bits - 1) {
            const std::size_t patch = 64 * word + static_cast<std::size_t>(std::countr_zero(bits));
            row.patches.push_back(make_id<PatchId>(patch));
            row.values.push_back(scale * std::exchange(sums_[patch], 0.0));
        }
    }
}

PatchLookup::PatchLookup(const FacetSet& facets, const PatchGrid& grid) : facets_(facets), grid_(grid) {
    only_patch_.resize(grid.cell_count());
    for (std::size_t cell = 0; cell < only_patch_.size(); ++cell) {
        const std::span<const PatchId> patches = grid.patches_in_cell(cell);
        only_patch_[cell] = patches.size() == 1 ? patches[0] : PatchId::none;
    }
    for (std::size_t i = 0; i < grid.patches.size(); ++i) {
        const std::span<const glm::dvec3> corners_m = grid.polygon_of(make_id<PatchId>(i));
        first_edge_.push_back(static_cast<std::uint32_t>(edges_.size()));
        for (std::size_t k = 0; k < corners_m.size(); ++k) {
            const glm::dvec3 along = corners_m[(k + 1) % corners_m.size()] - corners_m[k];
            const glm::dvec3 inward = glm::normalize(glm::cross(grid.patches[i].normal, along));
            edges_.push_back({inward, glm::dot(inward, corners_m[k])});
        }
    }
    first_edge_.push_back(static_cast<std::uint32_t>(edges_.size()));
}

/// The point eye + d / w, w = dot(inverse_depth, d), lies in the column dot(eye - origin + d / w, du) of the grid: w times that
/// is linear in d = x right + y up + forward.
void PatchLookup::find_lines(const ItemBuffer::Entry& entry, const Projection& projection, Scratch::FacetLines& lines) const {
    const auto& [right, up, forward] = projection.axes;
    const PatchGrid::FaceGrid& grid = grid_.face_grid(facets_[entry.facet].face);
    const auto along = [&](const glm::dvec3& v) { return glm::dvec3(glm::dot(v, right), glm::dot(v, up), glm::dot(v, forward)); };
    const glm::dvec3 from_origin = projection.eye_m - grid.origin_m;
    lines.w = {entry.w_x, entry.w_y, entry.w_1};
    lines.s = glm::dot(from_origin, grid.du) * lines.w + along(grid.du);
    lines.t = glm::dot(from_origin, grid.dv) * lines.w + along(grid.dv);
    lines.grid = &grid;
    lines.known = true;
}

/// As PatchGrid::patch_at(), among the patches of a cell that is cut.
PatchId PatchLookup::patch_at(std::size_t cell, FaceId face, const glm::dvec3& point_m) const {
    const std::span<const PatchId> patches = grid_.patches_in_cell(cell);
    if (patches.empty()) return grid_.patch_at(face, point_m);  // its corner was cut off
    PatchId best = patches[0];
    double deepest_m = std::numeric_limits<double>::lowest();
    for (const PatchId patch : patches) {
        double depth_m = std::numeric_limits<double>::max();
        for (std::uint32_t k = first_edge_[index(patch)]; k < first_edge_[index(patch) + 1]; ++k)
            depth_m = std::min(depth_m, glm::dot(edges_[k].inward, point_m) - edges_[k].offset_m);
        if (depth_m > deepest_m) deepest_m = depth_m, best = patch;
        if (deepest_m > 0) break;  // inside: patches do not overlap
    }
    return best;
}

/// x at which the row at y leaves a patch to the right. The point eye + d / w of direction d lies inside an edge if
/// dot(inward, d) + w (dot(inward, eye) - offset) >= 0: linear in x and y. docs/hemicube.md, eq. 8.
double PatchLookup::exit(PatchId patch, const ItemBuffer::Entry& entry, const Projection& projection, double y) const {
    const auto& [right, up, forward] = projection.axes;
    double x = std::numeric_limits<double>::infinity();
    for (std::uint32_t k = first_edge_[index(patch)]; k < first_edge_[index(patch) + 1]; ++k) {
        const Edge& edge = edges_[k];
        const glm::dvec3 g = edge.inward + (glm::dot(edge.inward, projection.eye_m) - edge.offset_m) * entry.inverse_depth;
        const double g_x = glm::dot(g, right), g_y = glm::dot(g, up);
        // An edge along the rows is not left to the right.
        if (g_x < -1e-14 * std::abs(g_y)) x = std::min(x, -(glm::dot(g, forward) + g_y * y) / g_x);
    }
    return x;
}

double PatchLookup::add_cells(const ItemBuffer& buffer, const ProjectionCells& cells, PatchSums& sums, Scratch& scratch) const {
    const std::vector<ItemBuffer::Entry>& entries = buffer.entries();
    const Projection& projection = buffer.projection();
    scratch.lines.assign(entries.size(), {});
    const auto columns = static_cast<std::size_t>(cells.columns);
    scratch.grid_cells.resize(columns + kernel_lanes);
    scratch.facet_ends.resize(columns);
    scratch.cell_ends.resize(columns);
    std::int32_t* const grid_cells = scratch.grid_cells.data();
    double lost = 0.0;
    for (int row = 0; row < cells.rows; ++row) {
        const double y = cells.row_centres[static_cast<std::size_t>(row)];
        const float* const x = cells.centres_of(row).data();
        const ItemCode* const codes = buffer.codes(row);
        const int facet_runs = find_run_ends(codes, cells.columns, scratch.facet_ends.data());
        for (int run = 0, begin = 0; run < facet_runs; ++run) {
            const int end = scratch.facet_ends[static_cast<std::size_t>(run)];
            const FacetId facet = ItemBuffer::facet_of(codes[begin]);
            if (!ItemBuffer::faces_viewpoint(codes[begin]) || !facets_[facet].exchanges_light) {
                std::fill(grid_cells + begin, grid_cells + end, nowhere);
            } else {
                const std::uint32_t number = buffer.entry_number(facet);
                Scratch::FacetLines& lines = scratch.lines[number];
                if (!lines.known) find_lines(entries[number], projection, lines);
                find_grid_cells({.s_0 = static_cast<float>(lines.s.z + lines.s.y * y),
                                 .s_x = static_cast<float>(lines.s.x),
                                 .t_0 = static_cast<float>(lines.t.z + lines.t.y * y),
                                 .t_x = static_cast<float>(lines.t.x),
                                 .w_0 = static_cast<float>(lines.w.z + lines.w.y * y),
                                 .w_x = static_cast<float>(lines.w.x),
                                 .last_column = static_cast<float>(lines.grid->nu - 1),
                                 .last_row = static_cast<float>(lines.grid->nv - 1),
                                 .columns = lines.grid->nu,
                                 .first_cell = static_cast<std::int32_t>(lines.grid->first_cell)},
                                x + begin, end - begin, grid_cells + begin);
            }
            begin = end;
        }
        const int cell_runs = find_run_ends(grid_cells, cells.columns, scratch.cell_ends.data());
        for (int run = 0, begin = 0; run < cell_runs; ++run) {
            const int end = scratch.cell_ends[static_cast<std::size_t>(run)];
            const std::int32_t cell = grid_cells[begin];
            if (cell == nowhere) {
                lost += cells.weight(row, begin, end);
            } else if (const PatchId only = only_patch_[static_cast<std::size_t>(cell)]; only != PatchId::none) {
                sums.add(only, cells.weight(row, begin, end));
            } else {
                // Several patches. They are convex, so that the row shows each of them in one piece. Depth comes from a
                // facet of the face, whichever.
                const FacetId facet = ItemBuffer::facet_of(codes[begin]);
                const ItemBuffer::Entry& entry = entries[buffer.entry_number(facet)];
                const glm::dvec3 row_direction = projection.axes.forward + y * projection.axes.up;
                for (int next = begin; begin < end; begin = next) {
                    // Farther than farthest_m only by rounding, where a facet is seen almost edge-on.
                    const double depth_m = 1 / std::max(entry.w_1 + entry.w_y * y + entry.w_x * x[begin], 1 / farthest_m);
                    const glm::dvec3 direction = row_direction + static_cast<double>(x[begin]) * projection.axes.right;
                    const PatchId patch =
                        patch_at(static_cast<std::size_t>(cell), facets_[facet].face, projection.eye_m + depth_m * direction);
                    next = begin + 1;
                    if (patch == PatchId::none) {
                        lost += cells.weight(row, begin, next);
                        continue;
                    }
                    if (next < end) {
                        const double leaves_at = exit(patch, entry, projection, y);
                        while (next < end && x[next] < leaves_at) ++next;
                    }
                    sums.add(patch, cells.weight(row, begin, next));
                }
            }
            begin = end;
        }
    }
    return lost;
}

}  // namespace naturel
