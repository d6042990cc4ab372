#include "hemicube_backend/projection_cells.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/units.h"
#include "hemicube_backend/cell_kernels.h"

namespace naturel {
namespace {

/// Form factor from an element at the origin, facing +z, to the rectangle [0, x] x [0, y] of the plane z = 1.
/// Odd in x and in y, so that four of them give any rectangle. docs/hemicube.md, eq. 3.
double parallel_form_factor(double x, double y) {
    const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
    return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * pi);
}

/// Its derivative by x.
double parallel_form_factor_slope(double x, double y) {
    const double p2 = 1 + x * x, p = std::sqrt(p2);
    return (y / (p2 + y * y) + std::atan(y / p) / p) / (2 * pi * p2);
}

/// Form factor from an element at the origin, facing +y, to the rectangle [0, x] x [0, y] of the plane z = 1.
/// docs/hemicube.md, eq. 4.
double perpendicular_form_factor(double x, double y) {
    const double q = std::sqrt(1 + y * y);
    return (std::atan(x) - std::atan(x / q) / q) / (2 * pi);
}

/// Solid angle of the rectangle [0, x] x [0, y] of the plane z = 1 from the origin, sr. docs/hemicube.md,
/// eq. 5.
double solid_angle(double x, double y) {
    return std::atan(x * y / std::sqrt(1 + x * x + y * y));
}

/// Its derivative by x.
double solid_angle_slope(double x, double y) {
    return y / ((1 + x * x) * std::sqrt(1 + x * x + y * y));
}

/// What the cells of a square share out equally: the measure of the rectangle [0, x] x [0, y], symmetric in x
/// and y.
struct Measure {
    double (*corner)(double x, double y);
    double (*slope)(double x, double y);  ///< by x
};

/// Positions 0 = p[0] < p[1] < ... < p[steps] = limit that divide `measure` (zero at 0, rising, concave)
/// equally. Newton's method from the position before: on a concave curve it comes from the left and cannot
/// overshoot.
template <class Value, class Slope>
std::vector<double> equal_parts(const Value& value, const Slope& slope, double limit, int steps) {
    std::vector<double> positions{0.0};
    const double total = value(limit);
    for (int k = 1; k < steps; ++k) {
        const double target = total * k / steps;
        double x = positions.back();
        for (int iteration = 0; iteration < 100;
             ++iteration) {  // about 5 are needed, 30 far out on a wide plane
            const double step = (target - value(x)) / slope(x);
            x += step;
            if (step <= 1e-15 * x) break;  // below rounding
        }
        positions.push_back(std::min(x, limit));
    }
    positions.push_back(limit);
    return positions;
}

/// Half steps on one side of the axis, mirrored: every second position is a line between cells, the others
/// are centres.
void mirror(std::span<const double> half_steps, double* lines, double* centres) {
    const int steps = static_cast<int>(half_steps.size()) - 1;
    for (int k = -steps; k <= steps; ++k) {
        const double position =
            k < 0 ? -half_steps[static_cast<std::size_t>(-k)] : half_steps[static_cast<std::size_t>(k)];
        if ((k + steps) % 2 == 0) {
            lines[(k + steps) / 2] = position;
        } else {
            centres[(k + steps) / 2] = position;
        }
    }
}

/// What is derived from the lines and centres.
ProjectionCells finished(ProjectionCells cells) {
    cells.column_centres.resize(cells.column_centres.size() + kernel_lanes);
    cells.tiles_per_row = static_cast<std::size_t>((cells.columns + tile_columns - 1) / tile_columns);
    for (int row = 0; row < cells.rows; row += tile_rows) {
        for (int column = 0; column < cells.columns; column += tile_columns) {
            const auto begin = static_cast<std::size_t>(column),
                       end = static_cast<std::size_t>(std::min(column + tile_columns, cells.columns));
            ProjectionCells::Tile tile{cells.lines_of(row)[begin], cells.lines_of(row)[end]};
            for (int r = row; r < std::min(row + tile_rows, cells.rows); ++r) {
                tile.x_begin = std::min(tile.x_begin, cells.lines_of(r)[begin]);
                tile.x_end = std::max(tile.x_end, cells.lines_of(r)[end]);
            }
            cells.tiles.push_back(tile);
        }
    }
    return cells;
}

ProjectionCells uniform_cells(int columns, double x_begin, double x_end, int rows, double y_begin,
                              double y_end) {
    ProjectionCells cells;
    cells.columns = columns;
    cells.rows = rows;
    cells.columns_per_unit = columns / (x_end - x_begin);
    for (int k = 0; k <= columns; ++k)
        cells.column_lines.push_back(x_begin + (x_end - x_begin) * k / columns);
    for (int k = 0; k < columns; ++k) {
        cells.column_centres.push_back(static_cast<float>(x_begin + (x_end - x_begin) * (k + 0.5) / columns));
    }
    for (int k = 0; k <= rows; ++k)
        cells.row_lines.push_back(y_begin + (y_end - y_begin) * k / rows);
    for (int k = 0; k < rows; ++k)
        cells.row_centres.push_back(y_begin + (y_end - y_begin) * (k + 0.5) / rows);
    return finished(std::move(cells));
}

ProjectionCells equal_cells(int resolution, double half_side, const Measure& measure) {
    const auto n = static_cast<std::size_t>(resolution);
    ProjectionCells cells;
    cells.columns = cells.rows = resolution;
    cells.uniform = false;
    cells.row_lines.resize(n + 1);
    cells.row_centres.resize(n);
    cells.column_lines.resize(n * (n + 1));
    cells.column_centres.resize(n * n);
    mirror(equal_parts([&](double y) { return measure.corner(y, half_side); },
                       [&](double y) { return measure.slope(y, half_side); }, half_side, resolution),
           cells.row_lines.data(), cells.row_centres.data());
    // The upper half, with the middle row of an odd number.
    parallel_for((n + 1) / 2, 8, [&](std::size_t k) {
        const std::size_t row = n / 2 + k, mirrored_row = n - 1 - row;
        const double y_begin = cells.row_lines[row], y_end = cells.row_lines[row + 1];
        const std::vector<double> half_steps =
            equal_parts([&](double x) { return measure.corner(x, y_end) - measure.corner(x, y_begin); },
                        [&](double x) { return measure.slope(x, y_end) - measure.slope(x, y_begin); },
                        half_side, resolution);
        std::vector<double> centres(n);
        for (const std::size_t r : {row, mirrored_row}) {
            mirror(half_steps, &cells.column_lines[r * (n + 1)], centres.data());
            std::transform(centres.begin(), centres.end(), &cells.column_centres[r * n],
                           [](double x) { return static_cast<float>(x); });
        }
    });
    return finished(std::move(cells));
}

/// Lines at the tangents of equal steps of angle, the same for every row and column.
ProjectionCells equal_angle_cells(int resolution, double half_side) {
    const auto n = static_cast<std::size_t>(resolution);
    std::vector<double> half_steps;
    for (int k = 0; k < resolution; ++k) half_steps.push_back(std::tan(std::atan(half_side) * k / resolution));
    half_steps.push_back(half_side);
    ProjectionCells cells;
    cells.columns = cells.rows = resolution;
    cells.uniform = false;
    cells.row_lines.resize(n + 1);
    cells.row_centres.resize(n);
    mirror(half_steps, cells.row_lines.data(), cells.row_centres.data());
    for (std::size_t row = 0; row < n; ++row) {
        cells.column_lines.insert(cells.column_lines.end(), cells.row_lines.begin(), cells.row_lines.end());
        for (const double x : cells.row_centres) cells.column_centres.push_back(static_cast<float>(x));
    }
    return finished(std::move(cells));
}

/// corner: form factor of the rectangle [0, x] x [0, y].
void weigh(ProjectionCells& cells, double (*corner)(double x, double y)) {
    const auto stride = static_cast<std::size_t>(cells.columns) + 1;
    cells.running_weight.resize(static_cast<std::size_t>(cells.rows) * stride);
    parallel_for(static_cast<std::size_t>(cells.rows), 8, [&](std::size_t row) {
        const std::span<const double> lines = cells.lines_of(static_cast<int>(row));
        for (std::size_t k = 0; k < stride; ++k) {
            cells.running_weight[row * stride + k] =
                corner(lines[k], cells.row_lines[row + 1]) - corner(lines[k], cells.row_lines[row]);
        }
    });
}

}  // namespace

int ProjectionCells::row_of(double y) const {
    const auto above = std::upper_bound(row_lines.begin(), row_lines.end(), y);
    return std::clamp(static_cast<int>(above - row_lines.begin()) - 1, 0, rows - 1);
}

int ProjectionCells::column_of(int row, double x) const {
    const std::span<const double> lines = lines_of(row);
    const auto above = std::upper_bound(lines.begin(), lines.end(), x);
    return std::clamp(static_cast<int>(above - lines.begin()) - 1, 0, columns - 1);
}

ProjectionCells hemicube_top_cells(int resolution) {
    ProjectionCells cells = uniform_cells(resolution, -1, 1, resolution, -1, 1);
    weigh(cells, parallel_form_factor);
    return cells;
}

ProjectionCells hemicube_side_cells(int resolution) {
    ProjectionCells cells = uniform_cells(resolution, -1, 1, (resolution + 1) / 2, 0, 1);
    weigh(cells, perpendicular_form_factor);
    return cells;
}

ProjectionCells single_plane_cells(int resolution, double half_side, CellSpacing spacing) {
    ProjectionCells cells;
    switch (spacing) {
        case CellSpacing::equal_solid_angle:
            cells = equal_cells(resolution, half_side, {solid_angle, solid_angle_slope});
            break;
        case CellSpacing::equal_form_factor:
            cells = equal_cells(resolution, half_side, {parallel_form_factor, parallel_form_factor_slope});
            break;
        case CellSpacing::equal_plane_angle:
            cells = equal_angle_cells(resolution, half_side);
            break;
        case CellSpacing::uniform:
            cells = uniform_cells(resolution, -half_side, half_side, resolution, -half_side, half_side);
            break;
    }
    weigh(cells, parallel_form_factor);
    return cells;
}

ProjectionCells rim_cells(int resolution, double half_side) {
    const double square_rows = std::ceil(resolution / (2 * half_side));  // as high as wide
    const int rows = static_cast<int>(std::clamp(square_rows, 2.0, static_cast<double>(resolution)));
    ProjectionCells cells = uniform_cells(resolution, -1, 1, rows, 0, 1 / half_side);
    weigh(cells, perpendicular_form_factor);
    return cells;
}

double widest_cell_rad(const ProjectionCells& cells) {
    double widest_rad = 0.0;
    // The angle between (x, y, 1) at both ends of a line of length `step` at distance r from its own foot; r: of that line.
    const auto angle = [](double begin, double end, double r) { return std::atan(end / r) - std::atan(begin / r); };
    for (int row = 0; row < cells.rows; ++row) {
        const auto r = static_cast<std::size_t>(row);
        const double y = cells.row_centres[r];
        const std::span<const double> lines = cells.lines_of(row);
        const std::span<const float> centres = cells.centres_of(row);
        for (std::size_t k = 0; k < centres.size(); ++k) {
            const double x = centres[k];
            widest_rad = std::max({widest_rad, angle(lines[k], lines[k + 1], std::sqrt(1 + y * y)),
                                   angle(cells.row_lines[r], cells.row_lines[r + 1], std::sqrt(1 + x * x))});
        }
    }
    return widest_rad;
}

ProjectionCells picture_cells(const Camera& camera) {
    return uniform_cells(camera.width, -camera.half_width, camera.half_width, camera.height,
                         -camera.half_height, camera.half_height);
}

}  // namespace naturel
