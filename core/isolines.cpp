#include "core/isolines.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/errors.h"

namespace naturel {
namespace {

// Edges of a cell, seen with y up.
enum : std::uint8_t { below, right, above, left };
using Crossing = std::pair<std::uint8_t, std::uint8_t>;  // from edge, to edge

/// By which corners are at or over the value: 1 lower left, 2 lower right, 4 upper right, 8 upper left.
constexpr std::array<std::array<Crossing, 2>, 16> crossings_of_corners{{
    {},
    {{{below, left}}},
    {{{right, below}}},
    {{{right, left}}},
    {{{above, right}}},
    {{{below, left}, {above, right}}},  // a saddle whose middle is under the value
    {{{above, below}}},
    {{{above, left}}},
    {{{left, above}}},
    {{{below, above}}},
    {{{right, below}, {left, above}}},  // the other one
    {{{right, above}}},
    {{{left, right}}},
    {{{below, right}}},
    {{{left, below}}},
    {},
}};

constexpr std::int64_t no_edge = -1;

/// Numbers of the edges of a lattice: those between columns first, then those between rows.
struct Lattice {
    std::int64_t columns, rows;

    std::int64_t edges_along_x() const { return (columns - 1) * rows; }
    std::int64_t edge_count() const { return edges_along_x() + columns * (rows - 1); }
    std::int64_t edge(std::int64_t column, std::int64_t row, std::uint8_t side) const {
        switch (side) {
            case below: return row * (columns - 1) + column;
            case above: return (row + 1) * (columns - 1) + column;
            case left: return edges_along_x() + row * columns + column;
            default: return edges_along_x() + row * columns + column + 1;
        }
    }
    /// The corner where an edge begins, and the step to its end.
    std::pair<std::array<std::int64_t, 2>, glm::dvec2> ends(std::int64_t edge) const {
        if (edge < edges_along_x()) return {{edge % (columns - 1), edge / (columns - 1)}, {1.0, 0.0}};
        const std::int64_t k = edge - edges_along_x();
        return {{k % columns, k / columns}, {0.0, 1.0}};
    }
};

}  // namespace

std::vector<Isoline> isolines(std::span<const double> field, int columns, int rows, double value, std::span<const std::uint32_t> parts) {
    NATUREL_EXPECT(columns >= 0 && rows >= 0 && field.size() == static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    NATUREL_EXPECT(parts.empty() || parts.size() == field.size());
    if (columns < 2 || rows < 2) return {};
    const Lattice lattice{columns, rows};
    const auto at = [&](std::int64_t column, std::int64_t row) { return field[static_cast<std::size_t>(row * columns + column)]; };

    const auto is_of_one_part = [&](std::int64_t column, std::int64_t row) {
        if (parts.empty()) return true;
        const auto part = [&](std::int64_t x, std::int64_t y) { return parts[static_cast<std::size_t>(y * columns + x)]; };
        const std::uint32_t first = part(column, row);
        return first != 0 && part(column + 1, row) == first && part(column + 1, row + 1) == first && part(column, row + 1) == first;
    };

    // Larger values lie to the left of every crossing, so each edge is the end of one crossing and the beginning of another.
    std::vector<std::int64_t> next(static_cast<std::size_t>(lattice.edge_count()), no_edge);
    std::vector<char> entered(next.size(), 0);
    const auto next_of = [&](std::int64_t edge) -> std::int64_t& { return next[static_cast<std::size_t>(edge)]; };
    for (std::int64_t row = 0; row + 1 < rows; ++row) {
        for (std::int64_t column = 0; column + 1 < columns; ++column) {
            const std::array corners{at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)};
            const double sum = corners[0] + corners[1] + corners[2] + corners[3];
            if (!std::isfinite(sum) || !is_of_one_part(column, row)) continue;
            std::size_t over = 0;
            for (std::size_t k = 0; k < 4; ++k) over |= corners[k] >= value ? std::size_t{1} << k : 0;
            const bool saddle = over == 5 || over == 10;
            // The crossings of the other saddle are the same lines, turned round.
            const bool turned = saddle && 0.25 * sum >= value;
            for (auto [from, to] : crossings_of_corners[turned ? 15 - over : over]) {
                if (from == to) continue;
                if (turned) std::swap(from, to);
                next_of(lattice.edge(column, row, from)) = lattice.edge(column, row, to);
                entered[static_cast<std::size_t>(lattice.edge(column, row, to))] = 1;
            }
        }
    }

    std::vector<Isoline> lines;
    const auto follow = [&](std::int64_t first) {
        Isoline& line = lines.emplace_back();
        for (std::int64_t edge = first;;) {
            const auto [corner, step] = lattice.ends(edge);
            const double a = at(corner[0], corner[1]), b = at(corner[0] + (step.x > 0.0 ? 1 : 0), corner[1] + (step.y > 0.0 ? 1 : 0));
            line.points.push_back(glm::dvec2{corner[0], corner[1]} + (value - a) / (b - a) * step);
            const std::int64_t following = std::exchange(next_of(edge), no_edge);
            line.closed = following == first;
            if (following == no_edge || line.closed) return;
            edge = following;
        }
    };
    for (const bool closed : {false, true})
        for (std::int64_t edge = 0; edge < lattice.edge_count(); ++edge)
            if (next_of(edge) != no_edge && (closed || entered[static_cast<std::size_t>(edge)] == 0)) follow(edge);
    return lines;
}

}  // namespace naturel
