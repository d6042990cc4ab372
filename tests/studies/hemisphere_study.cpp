// How honest the estimated errors of hemisphere rows are, and how their cost grows: the tables and the plot of docs/embree.md.
// Usage: hemisphere_study calibration > TABLE, writes hemisphere_calibration.svg; hemisphere_study growth
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "core/building.h"
#include "core/form_factors.h"
#include "core/parallel.h"
#include "core/patch_grid.h"
#include "core/scene_reader.h"
#include "embree_backend/embree_visibility.h"
#include "tests/hall.h"
#include "tests/random_scenes.h"
#include "tests/reference/exact_form_factors.h"

using namespace naturel;
using namespace naturel::tests;
using glm::dvec3;

namespace {

struct Place {
    std::string name;
    Building building;
    PatchGrid grid;

    Place(std::string what, const Scene& scene, double spacing_m)
        : name(std::move(what)), building(assemble(scene)), grid(make_patch_grid(building, {.spacing_m = spacing_m})) {}
};

Scene room_with_boxes() {
    Scene scene = closed_room({6, 5, 3});
    for (int k = 0; k < 24; ++k) {
        const dvec3 low{0.3 + 0.95 * (k % 6), 0.4 + 1.2 * (k / 6), 0.0};
        scene.polyhedra.push_back(
            box("box " + std::to_string(k), Effect::fill, low, low + dvec3(0.4, 0.5, 0.5 + 0.25 * (k % 4))));
    }
    return scene;
}

/// True and predicted errors.
struct Tally {
    double true_square = 0.0, predicted_square = 0.0;
    std::size_t count = 0, within[3] = {0, 0, 0};

    void add(double error, double predicted) {
        true_square += error * error;
        predicted_square += predicted * predicted;
        ++count;
        for (int k = 0; k < 3; ++k) within[k] += std::abs(error) < (k + 1) * predicted;
    }
    double rms() const { return std::sqrt(true_square / static_cast<double>(count)); }
    double predicted_rms() const { return std::sqrt(predicted_square / static_cast<double>(count)); }
    double share(int k) const { return 100.0 * static_cast<double>(within[k]) / static_cast<double>(count); }
};

/// By the predicted error, two to an octave.
using Curve = std::map<int, Tally>;

/// Exact rows of every `step`-th patch: closed forms where nothing stands between, else pairwise with a tight tolerance.
std::vector<std::vector<double>> exact_rows(const Place& place, std::size_t step, bool empty) {
    const std::size_t n = place.grid.gather_patch_count;
    const auto pairwise =
        empty ? nullptr
              : make_embree_visibility(place.building, place.grid, {.form_factors = FormFactorMethod::pairwise, .pair_tolerance = 1e-5});
    std::vector<std::vector<double>> rows((n + step - 1) / step, std::vector<double>(n));
    parallel_for(rows.size(), 1, [&](std::size_t r) {
        const PatchId from = make_id<PatchId>(step * r);
        if (empty) {
            for (std::size_t j = 0; j < n; ++j)
                if (place.grid.patches[j].face != place.grid.patches[step * r].face)
                    rows[r][j] = reference::polygon_to_polygon(place.grid.polygon_of(from), place.grid.polygon_of(make_id<PatchId>(j)));
        } else {
            FormFactorRow row;
            pairwise->form_factor_row(from, row);
            for (std::size_t k = 0; k < row.values.size(); ++k) rows[r][index(row.patches[k])] = row.values[k];
        }
    });
    return rows;
}

void calibration() {
    std::printf("| scene | rays | patches | values | RMS error | RMS predicted | ratio | within 1, 2, 3 | rows: true / predicted |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|\n");
    std::vector<std::pair<std::string, Curve>> curves;
    for (const bool empty : {true, false}) {
        const Place place(empty ? "empty room" : "24 boxes", empty ? closed_room({4, 5, 2.8}) : room_with_boxes(), 0.5);
        const std::size_t step = empty ? 3 : 6;
        const auto exact = exact_rows(place, step, empty);
        Curve curve;
        std::vector<double> log_rays, log_error;
        for (const int rays : {256, 1024, 4096, 16384}) {
            Tally values;
            double row_true = 0.0, row_predicted = 0.0;
            std::size_t rows = 0;
            for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
                const auto visibility = make_embree_visibility(place.building, place.grid, {.rays_per_patch = rays, .seed = seed});
                FormFactorRow row;
                for (std::size_t r = 0; r < exact.size(); ++r) {
                    visibility->form_factor_row(make_id<PatchId>(step * r), row);
                    std::vector<double> missing = exact[r];
                    double square = 0.0;
                    for (std::size_t k = 0; k < row.values.size(); ++k) {
                        const std::size_t j = index(row.patches[k]);
                        const double error = row.values[k] - exact[r][j], predicted = row.errors[k];
                        missing[j] = 0.0;
                        values.add(error, predicted);
                        square += error * error;
                        curve[static_cast<int>(std::lround(2 * std::log2(predicted)))].add(error, predicted);
                    }
                    for (const double f : missing) square += f * f;
                    row_true += square;
                    row_predicted += std::pow(estimated_error(row), 2);
                    ++rows;
                }
            }
            std::printf("| %s | %d | %zu | %zu | %.3g | %.3g | %.2f | %.1f, %.1f, %.1f %% | %.2f |\n", place.name.c_str(), rays, rows,
                        values.count, values.rms(), values.predicted_rms(), values.rms() / values.predicted_rms(), values.share(0),
                        values.share(1), values.share(2), std::sqrt(row_true / row_predicted));
            std::fflush(stdout);
            log_rays.push_back(std::log(rays));
            log_error.push_back(0.5 * std::log(row_true / static_cast<double>(rows)));
        }
        std::printf("| %s: error falls as rays^%.2f | | | | | | | | |\n", place.name.c_str(),
                    (log_error.back() - log_error.front()) / (log_rays.back() - log_rays.front()));
        curves.emplace_back(place.name, curve);
    }

    // Log-log, predicted to the right, true upwards.
    std::ofstream svg("hemisphere_calibration.svg");
    const double low = -17, high = -5;  // log2
    const auto at = [&](double log2, bool up) { return up ? 430 - 400 * (log2 - low) / (high - low) : 70 + 400 * (log2 - low) / (high - low); };
    svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 500 490\" font-family=\"sans-serif\" font-size=\"12\">\n"
           "<rect width=\"500\" height=\"490\" fill=\"white\"/>\n";
    for (int decade = -5; decade <= -2; ++decade) {
        const double l = decade * std::log2(10.0);
        svg << fmt::format("<path d=\"M{0:.1f} 30V430M70 {1:.1f}H470\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"446\" text-anchor=\"middle\">1e{2}</text>"
                           "<text x=\"64\" y=\"{1:.1f}\" text-anchor=\"end\" dominant-baseline=\"middle\">1e{2}</text>\n",
                           at(l, false), at(l, true), decade);
    }
    svg << fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"#888\" stroke-dasharray=\"4\"/>\n", at(low, false), at(low, true),
                       at(high, false), at(high, true));
    const char* const colours[] = {"#1f77b4", "#d62728"};
    for (std::size_t c = 0; c < curves.size(); ++c) {
        svg << fmt::format("<text x=\"90\" y=\"{}\" fill=\"{}\">{}</text>\n", 50 + 18 * c, colours[c], curves[c].first);
        for (const auto& [bin, tally] : curves[c].second)
            if (tally.count >= 200)
                svg << fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"><title>{} values</title></circle>\n",
                                   at(std::log2(tally.predicted_rms()), false), at(std::log2(tally.rms()), true), colours[c], tally.count);
    }
    svg << "<text x=\"270\" y=\"475\" text-anchor=\"middle\">predicted error of a form factor</text>\n"
           "<text transform=\"translate(16 230) rotate(-90)\" text-anchor=\"middle\">true error, RMS</text>\n</svg>\n";
}

/// What a child process found.
struct Cost {
    double patches = 0, facets = 0, entries = 0, cpu_s = 0, build_s = 0, forecast_mb = 0, peak_mb = 0, before_mb = 0;
};

double cpu_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double peak_mb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// All rows, in a process of its own.
Cost cost_of(const Scene& scene, double spacing_m) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    const pid_t child = fork();
    if (child == 0) {
        const ThreadLimit one(1);
        Cost cost;
        const Place place("", scene, spacing_m);
        const std::size_t n = place.grid.gather_patch_count;
        cost.patches = static_cast<double>(n);
        cost.facets = static_cast<double>(place.building.facets.size());
        double start = cpu_seconds();
        const auto visibility = make_embree_visibility(place.building, place.grid, {.rays_per_patch = 1024});
        cost.build_s = cpu_seconds() - start;
        cost.before_mb = peak_mb();
        NoProgress quiet;
        start = cpu_seconds();
        const FormFactorRows rows = visibility->form_factor_rows(n, false, quiet);
        cost.cpu_s = cpu_seconds() - start;
        cost.entries = static_cast<double>(rows.value.size());
        cost.forecast_mb = forecast_memory_bytes(n, cost.entries / cost.patches) * 0x1p-20;
        cost.peak_mb = peak_mb();
        if (write(ends[1], &cost, sizeof(cost)) != sizeof(cost)) std::abort();
        _exit(0);
    }
    Cost cost;
    if (read(ends[0], &cost, sizeof(cost)) != sizeof(cost)) std::fprintf(stderr, "no memory for that\n");
    waitpid(child, nullptr, 0);
    close(ends[0]);
    close(ends[1]);
    return cost;
}

void growth() {
    std::printf("1024 rays a patch, one thread, CPU seconds; memory of all rows before any repair\n");
    std::printf("| scene | facets | patches | entries a row | tree, s | rows, s | us a row | Mrays/s | peak, MB | of which rows | forecast with repair |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|---|\n");
    const auto print = [](const char* name, const Cost& c) {
        std::printf("| %s | %.0f | %.0f | %.0f | %.2f | %.2f | %.0f | %.1f | %.0f | %.0f | %.0f |\n", name, c.facets, c.patches,
                    c.entries / c.patches, c.build_s, c.cpu_s, 1e6 * c.cpu_s / c.patches, 1024e-6 * c.patches / c.cpu_s, c.peak_mb,
                    c.peak_mb - c.before_mb, c.forecast_mb);
        std::fflush(stdout);
    };
    const auto exponents = [](const char* name, const std::vector<Cost>& costs) {
        const Cost &a = costs.front(), &b = costs.back();
        const auto slope = [&](double Cost::*what) { return std::log(b.*what / (a.*what)) / std::log(b.patches / a.patches); };
        std::printf("| %s: as patches to the power of | | | | | %.2f | | | | | %.2f |\n", name, slope(&Cost::cpu_s), slope(&Cost::forecast_mb));
    };
    const Scene office = read_scene(std::filesystem::path(NATUREL_SOURCE_DIR) / "scenes/furnished_office.json");
    std::vector<Cost> costs;
    for (const double spacing_m : {0.42, 0.12, 0.036}) print("furnished office", costs.emplace_back(cost_of(office, spacing_m)));
    exponents("furnished office", costs);
    costs.clear();
    for (const auto& [boxes, spacing_m] : {std::pair{50, 4.0}, {500, 1.2}, {5000, 0.55}})
        print(fmt::format("hall, {} boxes", boxes).c_str(), costs.emplace_back(cost_of(hall_with_boxes(boxes), spacing_m)));
    exponents("hall", costs);
    for (const double spacing_m : {4.0, 0.8}) print("hall, 5000 boxes", cost_of(hall_with_boxes(5000), spacing_m));
}

}  // namespace

int main(int count, char** arguments) {
    const std::string what = count > 1 ? arguments[1] : "";
    if (what == "calibration") calibration();
    else if (what == "growth") growth();
    else return std::fprintf(stderr, "usage: hemisphere_study calibration | growth\n"), 2;
}
