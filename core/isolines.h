#pragma once
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace naturel {

/// A line of equal value.
struct Isoline {
    std::vector<glm::dvec2> points{};  ///< x: column, y: row of the lattice; at least two, the first not repeated at the end of a closed one
    bool closed = false;
};

/// Lines on which a field passes a value, by marching squares: straight within each cell of the lattice, where values are
/// linear along its edges. Where a cell has two ways to join its crossings (a saddle) the mean of its corners decides.
/// With x to the right and y up, larger values lie to the left of a line. Cells with a corner that is not finite have no line.
/// field: [columns x rows], x fastest. parts: empty, or as large; cells whose corners are not of one part, or of part 0, have no line.
/// Source: docs/pictures.md, "Lines of equal value".
std::vector<Isoline> isolines(std::span<const double> field, int columns, int rows, double value, std::span<const std::uint32_t> parts = {});

}  // namespace naturel
