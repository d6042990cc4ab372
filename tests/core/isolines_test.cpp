#include "core/isolines.h"

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>

#include "core/units.h"
#include "tests/catch.h"

using namespace naturel;
using glm::dvec2;

namespace {

std::vector<double> sampled(int columns, int rows, const std::function<double(double, double)>& f) {
    std::vector<double> field;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) field.push_back(f(column, row));
    return field;
}

/// Signed: positive when the inside lies to the left.
double area_of(const Isoline& line) {
    double sum = 0.0;
    for (std::size_t k = 0; k < line.points.size(); ++k) {
        const dvec2 a = line.points[k], b = line.points[(k + 1) % line.points.size()];
        sum += 0.5 * (a.x * b.y - b.x * a.y);
    }
    return sum;
}

}  // namespace

TEST_CASE("the isoline of a plane is one straight line", "[core][isolines][analytic]") {
    const auto plane = [](double x, double y) { return 2.0 * x + 3.0 * y; };
    const auto lines = isolines(sampled(9, 7, plane), 9, 7, 12.5);
    REQUIRE(lines.size() == 1);
    CHECK_FALSE(lines[0].closed);
    for (const dvec2& p : lines[0].points) CHECK(std::abs(plane(p.x, p.y) - 12.5) < 1e-12);  // rounding
    // From one side of the lattice to the other, with what is larger to the left.
    const dvec2 first = lines[0].points.front(), last = lines[0].points.back();
    CHECK(glm::distance(first, dvec2(0.0, 12.5 / 3.0)) < 1e-12);
    CHECK(glm::distance(last, dvec2(6.25, 0.0)) < 1e-12);
}

TEST_CASE("isolines of a bowl close round its middle, the nearer the finer the lattice", "[core][isolines][convergence]") {
    double errors[2];
    for (const int fine : {0, 1}) {
        const int n = fine == 0 ? 21 : 41;
        const double middle = 0.5 * (n - 1), radius = 0.3 * (n - 1);
        const auto field = sampled(n, n, [&](double x, double y) { return std::pow((x - middle) / radius, 2.0) + std::pow((y - middle) / radius, 2.0); });
        const auto lines = isolines(field, n, n, 1.0);
        REQUIRE(lines.size() == 1);
        CHECK(lines[0].closed);
        CHECK(area_of(lines[0]) < 0.0);  // the middle is lower: it lies to the right
        errors[fine] = std::abs(-area_of(lines[0]) / (pi * radius * radius) - 1.0);
    }
    CHECK(errors[0] < 0.01);
    // Linear interpolation of a parabola: the error falls with the square of the spacing.
    CHECK(errors[1] < 0.35 * errors[0]);
}

TEST_CASE("at a saddle isolines do not cross: the mean of the cell decides", "[core][isolines]") {
    // High at two opposite corners. Where the mean is over the value, too, the middle belongs to what is high.
    const double high = GENERATE(1.0, 3.5, 7.0);
    const bool over_first = GENERATE(false, true);
    const auto lines = isolines(over_first ? std::vector<double>{high, -3.0, -3.0, high} : std::vector<double>{-3.0, high, high, -3.0},
                                2, 2, 0.0);
    REQUIRE(lines.size() == 2);
    for (const Isoline& line : lines) {
        REQUIRE(line.points.size() == 2);
        const dvec2 along = line.points[1] - line.points[0], to_middle = dvec2(0.5) - 0.5 * (line.points[0] + line.points[1]);
        CHECK((along.x * to_middle.y - along.y * to_middle.x > 0.0) == (high > 3.0));
    }
}

TEST_CASE("isolines end at what has no value, and a flat field has none", "[core][isolines]") {
    auto field = sampled(5, 5, [](double x, double) { return x; });
    CHECK(isolines(field, 5, 5, 7.0).empty());
    CHECK(isolines(std::vector<double>(25, 3.0), 5, 5, 3.0).empty());
    CHECK(isolines(std::vector<double>(5, 3.0), 5, 1, 3.0).empty());
    field[12] = std::numeric_limits<double>::quiet_NaN();  // the middle
    const auto lines = isolines(field, 5, 5, 1.5);
    REQUIRE(lines.size() == 2);
    CHECK(lines[0].points.size() + lines[1].points.size() == 4);  // the rows over 1 and under 3
}

TEST_CASE("an isoline through corners of the lattice stays whole", "[core][isolines]") {
    // The value is met exactly on a diagonal.
    const auto lines = isolines(sampled(6, 6, [](double x, double y) { return x - y; }), 6, 6, 0.0);
    REQUIRE(lines.size() == 1);
    for (const dvec2& p : lines[0].points) CHECK(std::abs(p.x - p.y) < 1e-12);
}

TEST_CASE("isolines keep to the parts of a lattice", "[core][isolines]") {
    const auto field = sampled(10, 6, [](double x, double y) { return y + (x >= 5 ? 3.0 : 0.0); });
    std::vector<std::uint32_t> parts;
    for (int k = 0; k < 60; ++k) parts.push_back(k % 10 >= 5 ? 7 : 9);
    const auto lines = isolines(field, 10, 6, 3.5, parts);
    REQUIRE(lines.size() == 2);  // one in each part, and none along the step between them
    for (const Isoline& line : lines)
        for (const dvec2& p : line.points) CHECK((std::abs(p.y - 3.5) < 1e-12 || std::abs(p.y - 0.5) < 1e-12));
    CHECK(lines[0].points.size() == 5);
    CHECK(lines[1].points.size() == 5);
    for (std::uint32_t& part : parts) part = part == 7 ? 0 : part;
    CHECK(isolines(field, 10, 6, 3.5, parts).size() == 1);  // 0 is no part
}
