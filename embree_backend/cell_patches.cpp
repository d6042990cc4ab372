#include "embree_backend/cell_patches.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>

#include "embree_backend/hit_counts.h"

namespace naturel {
namespace {

/// The cells of a face's grid, where some are cut, are divided into no more than this: 32 kilobytes, which caches bear.
constexpr int most_divided_cells = 1 << 13;

/// Places within this of an outline lie on it, in cells: corners are rounded to 1 nm.
constexpr double on_outline = 1e-6;

}  // namespace

/// A patch in the coordinates of a divided grid.
struct CellPatches::Outline {
    struct Edge {
        double along_columns, along_rows, offset;  ///< distance inwards, in divided cells

        double depth(const glm::dvec2& p) const { return along_columns * p.x + along_rows * p.y + offset; }
    };
    PatchId patch;
    std::vector<glm::dvec2> corners{};
    std::vector<Edge> edges{};
    glm::dvec2 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

    Outline(const PatchGrid& grid, PatchId id, const PatchGrid::FaceGrid& face, int division) : patch(id) {
        for (const glm::dvec3& p : grid.polygon_of(id)) {
            corners.push_back(double(division) * glm::dvec2(glm::dot(p - face.origin_m, face.du), glm::dot(p - face.origin_m, face.dv)));
            low = glm::min(low, corners.back());
            high = glm::max(high, corners.back());
        }
        // u and v may turn either way about the normal.
        double doubled_area = 0.0;
        for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
            const glm::dvec2 a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
            doubled_area += a.x * b.y - a.y * b.x;
        }
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const glm::dvec2 along = corners[(k + 1) % corners.size()] - corners[k];
            const double length = glm::length(along);
            if (length < on_outline) continue;
            const glm::dvec2 inward = std::copysign(1.0 / length, doubled_area) * glm::dvec2(-along.y, along.x);
            edges.push_back({inward.x, inward.y, -glm::dot(inward, corners[k])});
        }
    }

    /// The least depth of a rectangle of cells under an edge, and the largest.
    static std::pair<double, double> depths(const Edge& edge, const glm::dvec2& from, const glm::dvec2& to) {
        const double middle = edge.depth(0.5 * (from + to));
        const double half = 0.5 * (std::abs(edge.along_columns) * (to.x - from.x) + std::abs(edge.along_rows) * (to.y - from.y));
        return {middle - half, middle + half};
    }

    bool holds(const glm::dvec2& from, const glm::dvec2& to) const {
        return std::ranges::all_of(edges, [&](const Edge& edge) { return depths(edge, from, to).first >= -on_outline; });
    }

    bool meets(const glm::dvec2& from, const glm::dvec2& to) const {
        if (low.x >= to.x - on_outline || high.x <= from.x + on_outline || low.y >= to.y - on_outline || high.y <= from.y + on_outline)
            return false;
        return std::ranges::none_of(edges, [&](const Edge& edge) { return depths(edge, from, to).second <= on_outline; });
    }

    /// An edge that has all of the other patch on its outer side; null if there is none.
    const Edge* edge_before(const Outline& other) const {
        for (const Edge& edge : edges)
            if (std::ranges::all_of(other.corners, [&](const glm::dvec2& p) { return edge.depth(p) <= on_outline; })) return &edge;
        return nullptr;
    }
};

CellPatches::CellPatches(const PatchGrid& grid, std::size_t face_count) {
    std::vector<Outline> outlines;
    for (std::size_t f = 0; f < face_count; ++f) {
        const PatchGrid::FaceGrid& face = grid.face_grid(make_id<FaceId>(f));
        const auto cells = static_cast<std::size_t>(face.nu) * static_cast<std::size_t>(face.nv);
        bool any_cut = false;
        for (std::size_t c = 0; c < cells; ++c) any_cut |= grid.patches_in_cell(face.first_cell + c).size() > 1;
        int division = any_cut ? 4 : 1;
        while (division > 1 && cells * static_cast<std::size_t>(division * division) > most_divided_cells) division /= 2;
        const auto columns = static_cast<std::size_t>(face.nu * division + 1), rows = static_cast<std::size_t>(face.nv * division + 1);
        const std::size_t first = counters_.size();
        faces_.push_back({static_cast<std::uint32_t>(first), division, static_cast<int>(columns)});
        if (cells == 0) continue;
        counters_.resize(first + columns * rows, unknown);
        // Places are floats: some units in the last place of the largest, for they come from products and sums.
        const double rounding = 0x1p-10 + 0x1p-20 * static_cast<double>(std::max(columns, rows));
        for (int v = 0; v < face.nv; ++v)
            for (int u = 0; u < face.nu; ++u) {
                const auto cell = static_cast<std::size_t>(v) * static_cast<std::size_t>(face.nu) + static_cast<std::size_t>(u);
                const std::span<const PatchId> here = grid.patches_in_cell(face.first_cell + cell);
                outlines.clear();
                if (here.size() > 1)
                    for (const PatchId patch : here) outlines.emplace_back(grid, patch, face, division);
                for (int row = v * division; row < (v + 1) * division; ++row)
                    for (int column = u * division; column < (u + 1) * division; ++column)
                        counters_[first + static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] =
                            here.size() == 1 ? HitCounts::counter_of(here[0]) : entry_of(outlines, column, row, rounding);
            }
        for (std::size_t row = 0; row + 1 < rows; ++row) counters_[first + (row + 1) * columns - 1] = counters_[first + (row + 1) * columns - 2];
        std::copy_n(counters_.begin() + static_cast<std::ptrdiff_t>(first + (rows - 2) * columns), columns,
                    counters_.begin() + static_cast<std::ptrdiff_t>(first + (rows - 1) * columns));
    }
    counters_.push_back(unknown);
}

/// Of one divided cell: a patch that has it alone, a line between two, or unknown.
std::uint32_t CellPatches::entry_of(const std::vector<Outline>& outlines, int column, int row, double rounding) {
    const glm::dvec2 from(column, row), to(column + 1, row + 1);
    const Outline* met[2] = {};
    std::size_t count = 0;
    for (const Outline& outline : outlines) {
        if (outline.holds(from, to)) return HitCounts::counter_of(outline.patch);
        if (!outline.meets(from, to)) continue;
        if (count == 2) return unknown;
        met[count++] = &outline;
    }
    if (count == 1) return HitCounts::counter_of(met[0]->patch);  // the rest of the cell is no part of the facets
    if (count == 0) return unknown;
    for (const auto& [inner, outer] : {std::pair(met[0], met[1]), std::pair(met[1], met[0])})
        if (const Outline::Edge* const edge = inner->edge_before(*outer)) {
            splits_.push_back({static_cast<float>(edge->along_columns), static_cast<float>(edge->along_rows), static_cast<float>(edge->offset),
                               static_cast<float>(rounding), inner->patch, outer->patch});
            return cut | static_cast<std::uint32_t>(splits_.size() - 1);
        }
    return unknown;
}

}  // namespace naturel
