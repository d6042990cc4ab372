#include "hemicube_backend/projection_cells.h"

#include <cmath>
#include <numeric>

#include "core/units.h"
#include "tests/catch.h"

namespace naturel {
namespace {

double total_weight(const ProjectionCells& cells) {
    double sum = 0.0;
    for (int row = 0; row < cells.rows; ++row) {
        for (int column = 0; column < cells.columns; ++column)
            sum += cells.weight(row, column, column + 1);
    }
    return sum;
}

/// Integral of f over a cell by Gauss's rule with 5 x 5 points: exact to degree 9, here better than 1e-10
/// relative.
template <class Function>
double integrate(const ProjectionCells& cells, int row, int column, const Function& f) {
    constexpr double at[] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                             0.9061798459386640};
    constexpr double weight[] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                 0.4786286704993665, 0.2369268850561891};
    const auto r = static_cast<std::size_t>(row), c = static_cast<std::size_t>(column);
    const double x_0 = cells.lines_of(row)[c], x_1 = cells.lines_of(row)[c + 1];
    const double y_0 = cells.row_lines[r], y_1 = cells.row_lines[r + 1];
    double sum = 0.0;
    for (int i = 0; i < 5; ++i) {
        for (int j = 0; j < 5; ++j) {
            sum +=
                weight[i] * weight[j] *
                f(((1 - at[i]) * x_0 + (1 + at[i]) * x_1) / 2, ((1 - at[j]) * y_0 + (1 + at[j]) * y_1) / 2);
        }
    }
    return sum * (x_1 - x_0) * (y_1 - y_0) / 4;
}

double square(double x) {
    return x * x;
}
double facing_plane(double x, double y) {
    return 1 / (pi * square(1 + x * x + y * y));
}
double facing_up(double x, double y) {
    return y / (pi * square(1 + x * x + y * y));
}
double solid_angle_density(double x, double y) {
    return std::pow(1 + x * x + y * y, -1.5);
}

constexpr CellSpacing all_spacings[] = {CellSpacing::equal_solid_angle, CellSpacing::equal_form_factor,
                                        CellSpacing::equal_plane_angle, CellSpacing::uniform};

TEST_CASE("cells of a single plane sum to 4/pi s atan(s) for every spacing and d/h",
          "[hemicube][cells][analytic]") {
    for (const CellSpacing spacing : all_spacings) {
        for (const double d_h : {0.1, 0.5, 1.0, 3.0, 10.0, 14.0, 100.0, 1000.0}) {
            for (const int resolution : {1, 2, 7, 10, 64}) {
                const double s = d_h / std::sqrt(1 + d_h * d_h);
                INFO("spacing " << static_cast<int>(spacing) << ", d/h " << d_h << ", resolution "
                                << resolution);
                // Rounding of 4096 sums of differences of numbers below 1.
                CHECK(std::abs(total_weight(single_plane_cells(resolution, d_h, spacing)) -
                               4 / pi * s * std::atan(s)) < 1e-12);
            }
        }
    }
}

TEST_CASE("the article's single plane, d/h = 14, catches 99.58 %", "[hemicube][cells][analytic]") {
    CHECK(std::abs(total_weight(single_plane_cells(64, 14, CellSpacing::equal_solid_angle)) - 0.99584) <
          5e-6);
}

TEST_CASE("cells of a hemi-cube sum to 1", "[hemicube][cells][analytic]") {
    for (const int resolution : {1, 2, 3, 4, 50, 101, 256}) {
        const double top = total_weight(hemicube_top_cells(resolution)),
                     side = total_weight(hemicube_side_cells(resolution));
        INFO("resolution " << resolution);
        CHECK(std::abs(top + 4 * side - 1) < 1e-12);
        CHECK(std::abs(top - 4 / pi * std::sqrt(0.5) * std::atan(std::sqrt(0.5))) < 1e-12);
    }
}

TEST_CASE("every cell's weight is the integral of its form factor", "[hemicube][cells][analytic]") {
    const ProjectionCells top = hemicube_top_cells(16), side = hemicube_side_cells(16);
    const ProjectionCells plane = single_plane_cells(32, 2, CellSpacing::equal_solid_angle);
    // The rule's error: seen to fall below this when cells are halved once more.
    constexpr double tolerance = 1e-9;
    const auto worst = [&](const ProjectionCells& cells, auto density) {
        double gap = 0.0;
        for (int row = 0; row < cells.rows; ++row) {
            for (int column = 0; column < cells.columns; ++column) {
                gap = std::max(gap, std::abs(cells.weight(row, column, column + 1) /
                                                 integrate(cells, row, column, density) -
                                             1));
            }
        }
        return gap;
    };
    CHECK(worst(top, facing_plane) < tolerance);
    CHECK(worst(side, facing_up) < tolerance);
    CHECK(worst(plane, facing_plane) < 1e-5);  // the outermost cells are long: 0.4 of the half side
}

TEST_CASE("cells of equal solid angle and of equal form factor are equal", "[hemicube][cells][analytic]") {
    constexpr int n = 128;
    constexpr double d_h = 1.5;
    const double quarter_sr = std::atan(d_h * d_h / std::sqrt(1 + 2 * d_h * d_h));
    const ProjectionCells by_angle = single_plane_cells(n, d_h, CellSpacing::equal_solid_angle);
    const ProjectionCells by_factor = single_plane_cells(n, d_h, CellSpacing::equal_form_factor);
    const double all = total_weight(by_factor);
    double worst_angle = 0.0, worst_factor = 0.0;
    for (int row = 0; row < n; ++row) {
        for (int column = 0; column < n; ++column) {
            worst_angle = std::max(
                worst_angle,
                std::abs(integrate(by_angle, row, column, solid_angle_density) * n * n / (4 * quarter_sr) -
                         1));
            worst_factor =
                std::max(worst_factor, std::abs(by_factor.weight(row, column, column + 1) * n * n / all - 1));
        }
    }
    CHECK(worst_angle < 1e-8);    // of the integration rule; the solution itself is exact to rounding
    CHECK(worst_factor < 1e-11);  // rounding of differences of numbers near 0.1 that are 6e-5 apart
}

TEST_CASE("a cell contains its centre, and is found by it", "[hemicube][cells]") {
    for (const CellSpacing spacing : all_spacings) {
        for (const int n : {32, 33}) {
        const ProjectionCells cells = single_plane_cells(n, 14, spacing);
        for (int row = 0; row < cells.rows; ++row) {
            REQUIRE(cells.row_of(cells.row_centres[static_cast<std::size_t>(row)]) == row);
            for (int column = 0; column < cells.columns; ++column) {
                const double centre = cells.centres_of(row)[static_cast<std::size_t>(column)];
                REQUIRE(cells.column_of(row, centre) == column);
                for (const int guess : {0, column, cells.columns}) {
                    REQUIRE(cells.columns_before(row, centre + 1e-5, guess) == column + 1);
                    REQUIRE(cells.columns_before(row, centre - 1e-5, guess) == column);
                }
            }
        }
        CHECK(cells.row_of(-20) == 0);
        CHECK(cells.row_of(20) == n - 1);
        }
    }
}

TEST_CASE("single plane and rim together sum to 1 for every d/h", "[hemicube][cells][analytic]") {
    for (const double d_h : {0.1, 0.5, 1.0, 3.0, 14.0, 100.0, 1000.0}) {
        for (const int resolution : {1, 9, 64}) {
            INFO("d/h " << d_h << ", resolution " << resolution);
            const double plane = total_weight(single_plane_cells(resolution, d_h, CellSpacing::equal_solid_angle));
            CHECK(std::abs(plane + 4 * total_weight(rim_cells(resolution, d_h)) - 1) < 1e-12);
        }
    }
}

TEST_CASE("strips of equal plane angle are seen under equal angles", "[hemicube][cells][analytic]") {
    for (const int resolution : {7, 64}) {
        const ProjectionCells cells = single_plane_cells(resolution, 14, CellSpacing::equal_plane_angle);
        const double expected_rad = 2 * std::atan(14.0) / resolution;
        for (int k = 0; k < resolution; ++k) {
            const auto c = static_cast<std::size_t>(k);
            CHECK(std::abs(std::atan(cells.row_lines[c + 1]) - std::atan(cells.row_lines[c]) - expected_rad) < 1e-14);
            CHECK(cells.lines_of(k)[c] == cells.row_lines[c]);
        }
    }
}

TEST_CASE("a rim reaches from the edge of the single plane to the horizon", "[hemicube][cells]") {
    for (const double d_h : {0.1, 1.0, 14.0, 1000.0}) {
        const ProjectionCells rim = rim_cells(64, d_h);
        CHECK(rim.row_lines.front() == 0.0);
        CHECK(rim.row_lines.back() == 1 / d_h);
        CHECK(rim.rows >= 2);
        CHECK(rim.rows <= 64);
    }
}

}  // namespace
}  // namespace naturel
