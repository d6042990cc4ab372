// How far projections are from closed forms, and why: aliasing, truncation, proximity; what the rim of a single plane costs.
// Usage: hemicube_error_study PAIRS    prints tables in Markdown and draws hemicube_error.svg, hemicube_truncation.svg and
// hemicube_proximity.svg; docs/hemicube.md shows them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>

#include "core/building.h"
#include "core/form_factors.h"
#include "core/parallel.h"
#include "core/units.h"
#include "hemicube_backend/hemicube_visibility.h"
#include "hemicube_backend/item_buffer.h"
#include "hemicube_backend/projection_cells.h"
#include "tests/random_scenes.h"

namespace naturel::tests {
namespace {

using glm::dvec3;

/// A square that sends to an element at the origin that faces +z.
struct Square {
    dvec3 corners_m[4];
    dvec3 normal;  // towards the origin
};

class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double operator()(double low, double high) { return low + (high - low) * static_cast<double>(bits_() >> 11) * 0x1p-53; }
    dvec3 direction() {
        for (;;) {
            const dvec3 v{(*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1)};
            if (glm::length(v) > 0.1 && glm::length(v) < 1) return glm::normalize(v);
        }
    }

private:
    std::mt19937_64 bits_;
};

/// Squares of side 0.2 to 1 within 0.6 to 3 of the origin, above the horizon, that face it.
Square random_square(Random& random) {
    for (;;) {
        const dvec3 centre = random(0.6, 3) * random.direction();
        dvec3 normal = random.direction();
        if (glm::dot(normal, centre) > 0) normal = -normal;
        const dvec3 a = glm::normalize(glm::cross(normal, random.direction())), b = glm::cross(normal, a);
        const double half = random(0.1, 0.5);
        const Square square{{centre - half * (a + b), centre + half * (a - b), centre + half * (a + b), centre - half * (a - b)}, normal};
        if (-glm::dot(normal, centre) < 0.1 * glm::length(centre)) continue;  // hardly seen
        if (std::ranges::all_of(square.corners_m, [](const dvec3& p) { return p.z > 0.01; })) return square;
    }
}

/// Lambert's closed form: from an element at `eye_m` that faces +z to a polygon above its horizon.
double exact_form_factor(const Square& square, const dvec3& eye_m) {
    double sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        const dvec3 a = glm::normalize(square.corners_m[k] - eye_m), b = glm::normalize(square.corners_m[(k + 1) % 4] - eye_m);
        const dvec3 cross = glm::cross(a, b);
        const double sine = glm::length(cross);
        if (sine > 0) sum += std::atan2(sine, glm::dot(a, b)) * cross.z / sine;
    }
    return std::abs(sum) / (2 * pi);
}

struct Method {
    ProjectionCells front, side;
    bool has_sides;
};

Method hemicube(int n) {
    return {hemicube_top_cells(n), hemicube_side_cells(n), true};
}
Method plane(int n, double d_h, CellSpacing spacing) {
    return {single_plane_cells(n, d_h, spacing), {}, false};
}

double projected_form_factor(const Square& square, const dvec3& eye_m, double turn_rad, const Method& method, ItemBuffer& buffer) {
    Building building;
    Facet facet;
    facet.vertices_m.assign(std::begin(square.corners_m), std::end(square.corners_m));
    facet.normal = square.normal;
    building.faces.resize(1);
    building.facets = {facet};
    const FacetSet facets(building);
    const dvec3 up{0, 0, 1}, tangent{std::cos(turn_rad), std::sin(turn_rad), 0}, bitangent = glm::cross(up, tangent);
    double sum = 0.0;
    const auto add = [&](const ProjectionAxes& axes, const ProjectionCells& cells) {
        buffer.draw(facets, {eye_m, axes}, cells, FacetKind::all);
        for (int row = 0; row < cells.rows; ++row)
            for (int column = 0; column < cells.columns; ++column)
                if (buffer.codes(row)[column] != empty_item) sum += cells.weight(row, column, column + 1);
    };
    add({tangent, bitangent, up}, method.front);
    if (method.has_sides)
        for (const dvec3& side : {tangent, bitangent, -tangent, -bitangent}) add({glm::cross(up, side), up, side}, method.side);
    return sum;
}

struct Spread {
    double median, p95, worst;
};

Spread spread(std::vector<double> errors) {
    std::sort(errors.begin(), errors.end());
    return {errors[errors.size() / 2], errors[errors.size() * 95 / 100], errors.back()};
}

/// Relative errors of `pairs` random squares.
Spread errors_of(int pairs, const Method& method) {
    std::vector<double> errors(static_cast<std::size_t>(pairs));
    ThreadScratch<ItemBuffer> buffers;
    parallel_for(errors.size(), 8, [&](std::size_t k) {
        Random random(k + 1);
        const Square square = random_square(random);
        const double exact = exact_form_factor(square, {});
        errors[k] = std::abs(projected_form_factor(square, {}, random(0, pi / 2), method, buffers.local()) / exact - 1);
    });
    return spread(errors);
}

struct Curve {
    std::string name, colour;
    std::vector<double> x, y;

    void add(double x_value, double y_value) {
        x.push_back(x_value);
        y.push_back(y_value);
    }
};

/// Curves in a square with logarithmic axes, 10^first to 10^last.
void draw(const std::string& file, const std::vector<Curve>& curves, double x_low, double x_high, int y_first, int y_last,
          const std::string& x_title, const std::string& y_title) {
    const double width = 560, height = 380, left = 80, top = 20;
    std::ofstream out(file);
    const auto px = [&](double x) { return left + width * std::log(x / x_low) / std::log(x_high / x_low); };
    const auto py = [&](double y) { return top + height * (y_last - std::log10(y)) / (y_last - y_first); };
    out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"860\" height=\"460\" font-family=\"sans-serif\" font-size=\"13\">\n"
           "<rect width=\"860\" height=\"460\" fill=\"white\"/>\n";
    for (int decade = y_first; decade <= y_last; ++decade)
        out << fmt::format("<path d=\"M{} {:.1f}h{}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:g}</text>\n", left,
                           py(std::pow(10, decade)), width, left - 8, py(std::pow(10, decade)) + 4, std::pow(10, decade));
    for (const double x : curves[0].x)
        out << fmt::format("<path d=\"M{:.1f} {}v{}\" stroke=\"#ddd\"/><text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", px(x),
                           top, height, px(x), top + height + 18, x);
    double legend = top + 14;
    for (const Curve& curve : curves) {
        out << "<path fill=\"none\" stroke-width=\"2\" stroke=\"" << curve.colour << "\" d=\"";
        for (std::size_t k = 0; k < curve.x.size(); ++k) out << fmt::format("{}{:.1f} {:.1f}", k == 0 ? 'M' : 'L', px(curve.x[k]), py(curve.y[k]));
        out << fmt::format("\"/><text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n", left + width + 10, legend, curve.colour, curve.name);
        legend += 20;
    }
    out << fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", left + width / 2, top + height + 40, x_title)
        << fmt::format("<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</svg>\n", top + height / 2, y_title);
}

void aliasing(int pairs) {
    fmt::print("\n| method | cells | median % | 95th percentile % | worst % |\n|---|---|---|---|---|\n");
    const char* colours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e"};
    std::vector<Curve> curves;
    for (int m = 0; m < 5; ++m) {
        const char* names[] = {"hemi-cube", "equal solid angle", "equal form factor", "equal plane angle", "uniform"};
        Curve curve{names[m], colours[m], {}, {}};
        for (const int n : {32, 64, 128, 256, 512, 1024}) {
            const CellSpacing spacings[] = {{}, CellSpacing::equal_solid_angle, CellSpacing::equal_form_factor,
                                            CellSpacing::equal_plane_angle, CellSpacing::uniform};
            const Spread e = errors_of(pairs, m == 0 ? hemicube(n) : plane(n, 14, spacings[m]));
            fmt::print("| {} | {} | {:.3f} | {:.3f} | {:.2f} |\n", names[m], n, 100 * e.median, 100 * e.p95, 100 * e.worst);
            curve.add(n, 100 * e.median);
        }
        curves.push_back(curve);
    }
    draw("hemicube_error.svg", curves, 32, 1024, -3, 2, "cells along a side", "median error of a form factor, %");
}

void truncation(int pairs) {
    fmt::print("\n| d/h | lost, closed form % | median % | 95th percentile % | worst % |\n|---|---|---|---|---|\n");
    Curve lost{"lost of a row", "#1f77b4", {}, {}}, median{"median error", "#d62728", {}, {}}, p95{"95th percentile", "#2ca02c", {}, {}},
        worst{"worst error", "#9467bd", {}, {}};
    for (const double d_h : {1.0, 3.0, 7.0, 14.0, 30.0, 100.0}) {
        const double s = d_h / std::sqrt(1 + d_h * d_h);
        const Spread e = errors_of(pairs, plane(512, d_h, CellSpacing::equal_solid_angle));
        const double share = 1 - 4 / pi * s * std::atan(s);
        fmt::print("| {:g} | {:.3f} | {:.4f} | {:.3f} | {:.2f} |\n", d_h, 100 * share, 100 * e.median, 100 * e.p95, 100 * e.worst);
        lost.add(d_h, 100 * share), median.add(d_h, 100 * e.median), p95.add(d_h, 100 * e.p95), worst.add(d_h, 100 * e.worst);
    }
    draw("hemicube_truncation.svg", {lost, median, p95, worst}, 1, 100, -3, 2, "d/h of the single plane (equal solid angle, 512 cells)",
         "share of a row, error of a form factor, %");
}

/// A square patch and an equal one at a right angle that shares no point with it but comes near; the exact value by 64 x 64
/// viewpoints of Lambert's closed form.
void proximity() {
    fmt::print("\n| gap / side | centre, exact % | 1 % | 4 % | 16 % | 64 % |\n|---|---|---|---|---|---|\n");
    const Method method = hemicube(256);
    ItemBuffer buffer;
    std::vector<Curve> curves{{"centre, closed form", "#7f7f7f", {}, {}}, {"1 viewpoint", "#1f77b4", {}, {}}, {"4 viewpoints", "#d62728", {}, {}},
                              {"16 viewpoints", "#2ca02c", {}, {}}, {"64 viewpoints", "#9467bd", {}, {}}};
    for (const double gap : {0.05, 0.25, 0.5, 1.0, 2.0, 4.0}) {
        const Square wall{{{0.5 + gap, -0.5, 1e-6}, {0.5 + gap, -0.5, 1}, {0.5 + gap, 0.5, 1}, {0.5 + gap, 0.5, 1e-6}}, {-1, 0, 0}};
        const auto mean = [&](int side, auto value) {
            double sum = 0.0;
            for (int i = 0; i < side; ++i)
                for (int j = 0; j < side; ++j) sum += value(dvec3((i + 0.5) / side - 0.5, (j + 0.5) / side - 0.5, 0), i * side + j);
            return sum / (side * side);
        };
        const double exact = mean(128, [&](const dvec3& p, int) { return exact_form_factor(wall, p); });
        const double centre_error = exact_form_factor(wall, {}) / exact - 1;
        fmt::print("| {:g} | {:+.2f}", gap, 100 * centre_error);
        curves[0].add(gap, 100 * std::abs(centre_error));
        const int sides[] = {1, 2, 4, 8};
        for (std::size_t k = 0; k < 4; ++k) {
            const double got =
                mean(sides[k], [&](const dvec3& p, int j) { return projected_form_factor(wall, p, 0.3 + 0.37 * j, method, buffer); });
            fmt::print(" | {:+.2f}", 100 * (got / exact - 1));
            curves[k + 1].add(gap, 100 * std::abs(got / exact - 1));
        }
        fmt::print(" |\n");
    }
    draw("hemicube_proximity.svg", curves, 0.05, 4, -2, 1, "gap / side of two equal squares at a right angle (hemi-cube, 256 cells)",
         "error of the form factor between them, %");
}

void rim() {
    Scene scene = closed_room({5, 6, 2.8});
    scene.grid.spacing_m = 0.2;
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    HemicubeOptions options{.surface = ProjectionSurface::single_plane, .resolution = 128, .spacing = CellSpacing::equal_solid_angle};
    options.rim = RimShare::strip;
    const auto whole = make_hemicube_visibility(building, grid, options);
    options.rim = RimShare::left_out;
    const auto open = make_hemicube_visibility(building, grid, options);
    // Exchange of the floor with the walls, by height of the wall's patch above the floor.
    std::vector<double> all(14, 0.0), missing(14, 0.0);
    double to_ceiling = 0.0;
    FormFactorRow row;
    for (std::size_t i = 0; i < grid.gather_patch_count; ++i) {
        if (grid.patches[i].normal.z < 0.5) continue;
        for (const bool strip : {true, false}) {
            (strip ? whole : open)->form_factor_row(make_id<PatchId>(i), row);
            for (std::size_t k = 0; k < row.patches.size(); ++k) {
                const dvec3& centre_m = grid.patches[index(row.patches[k])].centroid_m;
                if (grid.patches[index(row.patches[k])].normal.z < -0.5) {
                    to_ceiling += strip ? row.values[k] : -row.values[k];
                    continue;
                }
                const auto band = std::min<std::size_t>(13, static_cast<std::size_t>(centre_m.z / 0.2));
                if (strip) all[band] += row.values[k];
                missing[band] += strip ? row.values[k] : -row.values[k];
            }
        }
    }
    const double lost = std::accumulate(missing.begin(), missing.end(), 0.0) + to_ceiling;
    fmt::print("\n| height on the wall, m | share of the loss % | missing from its exchange with the floor % |\n|---|---|---|\n");
    for (std::size_t band = 0; band < 5; ++band)
        fmt::print("| {:.1f} to {:.1f} | {:.1f} | {:.2f} |\n", 0.2 * static_cast<double>(band), 0.2 * static_cast<double>(band + 1),
                   100 * missing[band] / lost, 100 * missing[band] / all[band]);

    fmt::print("\n| rim | mean row sum | reciprocity gap % | largest gain or loss of a patch % |\n|---|---|---|---|\n");
    NoProgress silent;
    const auto report = [&](const char* name, const HemicubeOptions& o) {
        const auto visibility = make_hemicube_visibility(building, grid, o);
        const FormFactors f = compute_form_factors(*visibility, grid, {.repair = FormFactorRepair::none}, silent);
        double area = 0.0, sum = 0.0;
        for (std::size_t i = 0; i < f.row_count(); ++i) {
            area += grid.patches[i].area_m2;
            for (std::size_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) sum += grid.patches[i].area_m2 * f.value[e];
        }
        fmt::print("| {} | {:.6f} | {:.3f} | {:.2f} |\n", name, sum / area, 100 * f.quality.reciprocity_gap, 100 * f.quality.worst_flux_error);
    };
    report("left out", options);
    options.rim = RimShare::renormalised;
    report("renormalised", options);
    options.rim = RimShare::strip;
    report("strip", options);
    report("(hemi-cube)", {.resolution = 128});
}

}  // namespace
}  // namespace naturel::tests

int main(int argc, char** argv) {
    const int pairs = argc > 1 ? std::max(20, std::atoi(argv[1])) : 2000;
    naturel::tests::rim();
    naturel::tests::proximity();
    std::fflush(stdout);
    naturel::tests::truncation(pairs);
    naturel::tests::aliasing(pairs);
}
