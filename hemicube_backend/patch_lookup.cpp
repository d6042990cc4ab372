#include "hemicube_backend/patch_lookup.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

namespace naturel {
namespace {

/// No building is larger; keeps points under cells finite, m.
constexpr double farthest_m = 1e6;

/// An edge that leaves less than this of a cell outside, m, does not cut it: geometry is rounded to 1 nm.
constexpr double cut_m = 1e-8;

}  // namespace

void PatchSums::move_to(FormFactorRow& row, double scale) {
    row.lost += std::exchange(sums_[patch_count_], 0.0) * scale;
    for (std::size_t k = 0; k < touched_.size(); ++k) {
        if (std::exchange(touched_[k], std::uint8_t{0}) == 0) continue;
        for (std::size_t patch = k * block; patch < (k + 1) * block; ++patch) {
            if (sums_[patch] == 0.0) continue;
            row.patches.push_back(make_id<PatchId>(patch));
            row.values.push_back(scale * std::exchange(sums_[patch], 0.0));
        }
    }
}

PatchLookup::PatchLookup(const FacetSet& facets, const PatchGrid& grid) : facets_(facets), grid_(grid) {
    for (std::size_t cell = 0; cell < grid.cell_count(); ++cell) {
        const std::span<const PatchId> patches = grid.patches_in_cell(cell);
        if (patches.size() == 1)
            patch_of_cell_.push_back(static_cast<std::int32_t>(index(patches[0])));
        else
            cut(cell);
    }
    patch_of_cell_.push_back(static_cast<std::int32_t>(grid.patches.size()));
}

void PatchLookup::cut(std::size_t cell) {
    patch_of_cell_.push_back(-1 - static_cast<std::int32_t>(cut_cells_.size()));
    const std::span<const PatchId> patches = grid_.patches_in_cell(cell);
    cut_cells_.push_back({static_cast<std::uint32_t>(parts_.size()), static_cast<std::uint32_t>(patches.size())});
    for (const PatchId id : patches) {
        const Patch& patch = grid_.patches[index(id)];
        const PatchGrid::FaceGrid& face = grid_.face_grid(patch.face);
        const auto in_face = static_cast<int>(cell - face.first_cell);
        const double s = in_face % face.nu, t = in_face / face.nu;
        // p = origin + s u + t v in the plane of the face
        const glm::dvec3 normal = glm::cross(face.du, face.dv);
        const glm::dvec3 u = glm::cross(face.dv, normal) / glm::dot(normal, normal),
                         v = glm::cross(normal, face.du) / glm::dot(normal, normal);
        const std::span<const glm::dvec3> corners_m = grid_.polygon_of(id);
        Part part{index(id), static_cast<std::uint32_t>(edges_.size()), 0};
        for (std::size_t k = 0; k < corners_m.size(); ++k) {
            const glm::dvec3 along = corners_m[(k + 1) % corners_m.size()] - corners_m[k];
            const glm::dvec3 inward = glm::normalize(glm::cross(patch.normal, along));
            const Edge edge{glm::dot(inward, u), glm::dot(inward, v), glm::dot(inward, face.origin_m - corners_m[k])};
            const double least_m = edge.s * s + edge.t * t + edge.one + std::min(edge.s, 0.0) + std::min(edge.t, 0.0);
            if (least_m < -cut_m) edges_.push_back(edge);
        }
        part.edge_count = static_cast<std::uint32_t>(edges_.size()) - part.first_edge;
        parts_.push_back(part);
    }
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

/// Patches are convex, so that the row shows each of them in one piece. The distance inside an edge times w is linear in x:
/// docs/hemicube.md, eq. 8.
void PatchLookup::add_cut_run(const CutRun& run, const Scratch::FacetLines& lines, const Projection& projection,
                              PatchSums& sums) const {
    const double s_0 = lines.s.z + lines.s.y * run.y, t_0 = lines.t.z + lines.t.y * run.y, w_0 = lines.w.z + lines.w.y * run.y;
    const auto at_0 = [&](const Edge& edge) { return edge.s * s_0 + edge.t * t_0 + edge.one * w_0; };
    const auto by_x = [&](const Edge& edge) { return edge.s * lines.s.x + edge.t * lines.t.x + edge.one * lines.w.x; };
    const std::span<const Part> parts(parts_.data() + run.cell.first_part, run.cell.part_count);
    const double last_x = run.x[run.end - 1];
    for (int begin = run.begin, next = begin; begin < run.end; begin = next) {
        const double x = run.x[begin];
        std::size_t patch = grid_.patches.size();
        std::span<const Edge> edges_of_patch;
        double deepest = std::numeric_limits<double>::lowest();
        bool to_the_end = false;
        for (const Part& part : parts) {
            const std::span<const Edge> edges(edges_.data() + part.first_edge, part.edge_count);
            double depth = std::numeric_limits<double>::max(), last_depth = depth;
            for (const Edge& edge : edges) {
                const double edge_at_0 = at_0(edge), edge_by_x = by_x(edge);
                depth = std::min(depth, edge_at_0 + edge_by_x * x);
                last_depth = std::min(last_depth, edge_at_0 + edge_by_x * last_x);
            }
            if (depth > deepest) deepest = depth, to_the_end = last_depth > 0, edges_of_patch = edges, patch = part.patch;
            if (deepest > 0) break;  // inside: patches do not overlap
        }
        next = begin + 1;
        if (to_the_end && deepest > 0) {
            next = run.end;
        } else if (next < run.end && !parts.empty()) {
            double leaves_at = std::numeric_limits<double>::max();
            for (const Edge& edge : edges_of_patch)
                if (const double slope = by_x(edge); slope < 0) leaves_at = std::min(leaves_at, at_0(edge) / -slope);
            while (next < run.end && run.x[next] < leaves_at) ++next;
        } else if (parts.empty()) {
            // Farther than farthest_m only by rounding, where a facet is seen almost edge-on.
            const double depth_m = 1 / std::max(w_0 + lines.w.x * x, 1 / farthest_m);
            const auto& [right, up, forward] = projection.axes;
            const PatchId nearest =
                grid_.patch_at(facets_[run.facet].face, projection.eye_m + depth_m * (forward + run.y * up + x * right));
            if (nearest != PatchId::none) patch = index(nearest);
        }
        sums.add(patch, run.running_weight[next] - run.running_weight[begin]);
    }
}

void PatchLookup::add_cells(const ItemBuffer& buffer, const ProjectionCells& cells, PatchSums& sums, Scratch& scratch) const {
    const std::vector<ItemBuffer::Entry>& entries = buffer.entries();
    const Projection& projection = buffer.projection();
    scratch.lines.assign(entries.size(), {});
    const auto columns = static_cast<std::size_t>(cells.columns);
    scratch.grid_cells.resize(columns + kernel_lanes);
    scratch.facet_ends.resize(columns + kernel_lanes);
    scratch.cell_ends.resize(columns + kernel_lanes);
    std::int32_t* const grid_cells = scratch.grid_cells.data();
    const auto nowhere = static_cast<std::int32_t>(grid_.cell_count());
    for (int row = 0; row < cells.rows; ++row) {
        const double y = cells.row_centres[static_cast<std::size_t>(row)];
        const float* const x = cells.centres_of(row).data();
        const double* const running_weight = cells.running_weight_of(row);
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
                                 .columns = static_cast<float>(lines.grid->nu),
                                 .first_cell = static_cast<std::int32_t>(lines.grid->first_cell)},
                                x + begin, end - begin, grid_cells + begin);
            }
            begin = end;
        }
        const int cell_runs = find_run_ends(grid_cells, cells.columns, scratch.cell_ends.data());
        for (int run = 0, begin = 0; run < cell_runs; ++run) {
            const int end = scratch.cell_ends[static_cast<std::size_t>(run)];
            const auto cell = static_cast<std::size_t>(grid_cells[begin]);
            if (const std::int32_t patch = patch_of_cell_[cell]; patch >= 0) {
                sums.add(static_cast<std::size_t>(patch), running_weight[end] - running_weight[begin]);
            } else {
                const FacetId facet = ItemBuffer::facet_of(codes[begin]);
                add_cut_run({cut_cells_[static_cast<std::size_t>(-1 - patch)], facet, begin, end, y, x, running_weight}, scratch.lines[buffer.entry_number(facet)], projection,
                            sums);
            }
            begin = end;
        }
    }
}

}  // namespace naturel
