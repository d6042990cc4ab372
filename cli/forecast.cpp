#include "cli/forecast.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/choices.h"
#include "cli/physical_memory.h"
#include "core/daylight.h"
#include "core/errors.h"

namespace naturel {
namespace {

/// What tells a row of form factors, or a point, what it sees.
struct SamplesPerRow {
    double patch = 0.0, point = 0.0;
    std::string_view unit;
    double seconds = 0.0;  ///< CPU time of one
};

/// The top of a hemi-cube and four half sides; or one square with a rim that is looked at apart.
double hemicube_cells(const BackendOptions& options) {
    const double side = options.hemicube.resolution;
    return side * side + (options.hemicube.surface == ProjectionSurface::hemicube ? 4.0 * side * std::ceil(0.5 * side) : 0.0);
}

/// CPU time of a pair of patches: what is between them is looked for among the facets; what is partly visible is divided until the
/// tolerance is met, more often where there are many of them.
double pair_seconds(double facets, double tolerance) {
    // Measured with up to 732 facets: docs/method.md, "Forecasts".
    return 1.3e-8 * facets + 2.6e-10 * facets * std::min(facets, 1500.0) * std::pow(1e-5 / tolerance, 0.85);
}

SamplesPerRow samples_per_row(std::string_view backend, const BackendOptions& options, std::size_t facets, std::size_t rows) {
    // Measured: docs/method.md, "Forecasts".
    if (backend == "embree") {
        if (options.embree.form_factors == FormFactorMethod::pairwise) {
            const double all = static_cast<double>(rows);
            return {0.5 * std::max(0.0, all - 1.0), all, "pairs", pair_seconds(static_cast<double>(facets), options.embree.pair_tolerance)};
        }
        const auto in_rays = [](int rays) { return 256.0 * std::ceil(rays / 256.0); };
        const int patch_rays = options.embree.target_error > 0.0 ? options.embree.most_rays_per_patch : options.embree.rays_per_patch;
        return {in_rays(patch_rays), in_rays(options.embree.rays_per_point), "rays",
                5e-8 + 1.7e-8 * std::log2(static_cast<double>(facets + 1))};
    }
    const double cells = hemicube_cells(options);
    return {cells * options.hemicube.viewpoints, cells, "cells", 6e-9};
}

/// CPU time of the direct light on a point.
double direct_point_seconds(const Scene& scene, std::string_view backend, const BackendOptions& options, std::size_t facets) {
    // Measured at tolerances from 1e-2 to 2e-4, and in halls of 500 and 5000 boxes: docs/method.md, "Forecasts".
    const double crowd = std::sqrt(1.0 + static_cast<double>(facets) / 3000.0);
    const double seconds = backend == "embree" ? 6e-5 * crowd : 5e-5 * crowd + 1.5e-9 * hemicube_cells(options);
    return seconds * std::pow(1e-3 / scene.direct.tolerance, 0.1);
}

/// Code, libraries and what threads take before there is any scene: docs/method.md, "Forecasts".
constexpr double bytes_of_program = 2.5e7;

/// As many pixels wait for their encoding together, unless one view has more.
constexpr std::size_t pixels_encoded_together = 4'000'000;

/// Memory and CPU time of pictures.
struct PictureCost {
    double bytes = 0.0;  ///< of those that are in memory together, and of the module that writes them
    double seconds = 0.0, writer_seconds = 0.0;
};

PictureCost picture_cost(const Scene& scene, std::string_view backend, double point_seconds) {
    if (scene.views.empty()) return {};
    // Measured: docs/method.md, "Forecasts".
    constexpr double writer_bytes = 1.3e8, bytes_per_pixel = 190.0, seconds_per_pixel = 1e-6;
    constexpr double seconds_per_single_sample = 1e-7;  // of pixels whose samples are looked at one by one
    const double seconds_per_sample = backend == "embree" ? 3e-8 : 2e-8;
    PictureCost cost{.bytes = writer_bytes, .writer_seconds = 0.2};
    double all_pixels = 0.0, largest = 0.0;
    for (const View& view : scene.views) {
        const double pixels = static_cast<double>(view.width) * static_cast<double>(view.height);
        const double samples = static_cast<double>(view.samples) * static_cast<double>(view.samples);
        const bool one_by_one = (view.kind != ViewKind::perspective && view.kind != ViewKind::parallel) || !view.cut_planes.empty();
        double of_pixel = seconds_per_pixel + samples * (seconds_per_sample + (one_by_one ? seconds_per_single_sample : 0.0));
        if (view.quality == PictureQuality::gather) of_pixel += point_seconds;
        cost.seconds += pixels * of_pixel;
        all_pixels += pixels;
        largest = std::max(largest, pixels);
    }
    cost.bytes += bytes_per_pixel * std::min(all_pixels, std::max(largest, static_cast<double>(pixels_encoded_together)));
    return cost;
}

}  // namespace

std::string in_millions(double number) {
    return number < 1e9 ? fmt::format("{:.3g} million", number / 1e6)
                        : fmt::format("{:.3g} billion", number / 1e9);
}

std::string_view at_most(std::string_view backend, const BackendOptions& options) {
    return backend == "embree" && options.embree.target_error > 0.0 ? "at most " : "";
}

std::string in_bytes(double bytes) {
    return bytes < 1e9 ? fmt::format("{:.0f} MB", std::ceil(bytes / 1e6)) : fmt::format("{:.1f} GB", bytes / 1e9);
}

std::string in_time(double seconds) {
    if (seconds < 100.0) return fmt::format("{:.0f} s", std::ceil(seconds));
    return seconds < 6000.0 ? fmt::format("{:.0f} min", seconds / 60.0) : fmt::format("{:.1f} h", seconds / 3600.0);
}

std::string counted(std::size_t number, std::string_view noun) {
    return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

double Forecast::peak_bytes() const {
    // Memory of form factors that is free again lies in pieces that pictures do not always fit into. Measured, they take it up to the
    // last byte as well as not at all, and fill less than half of the forecast.
    const double left_bytes = picture_bytes > 0.0 ? 0.5 * form_factor_bytes : 0.0;
    return process_bytes + light_bytes + std::max({form_factor_bytes, table_bytes, left_bytes + picture_bytes});
}

Forecast forecast(const Scene& scene, const Building& building, const PatchGrid& grid, std::size_t sensors,
                  std::string_view backend, const BackendOptions& asked, IndirectMethod node_indirect) {
    const BackendOptions options = settled(asked, grid);
    Forecast f{.rows = grid.gather_patch_count, .process_bytes = bytes_of_program};
    const bool pairwise = backend == "embree" && options.embree.form_factors == FormFactorMethod::pairwise;
    const SamplesPerRow samples = samples_per_row(backend, options, building.facets.size(), f.rows);
    f.longest_row = pairwise ? f.rows
                             : static_cast<std::size_t>(std::min(static_cast<double>(f.rows), samples.patch));
    // What samples that fall at random on patches in view leave out.
    const double in_view = 0.65 * static_cast<double>(f.rows);
    f.usual_entries = static_cast<double>(f.rows) * in_view * (pairwise || in_view == 0.0 ? 1.0 : 1.0 - std::exp(-samples.patch / in_view));
    f.form_factor_bytes = forecast_memory_bytes(f.rows, static_cast<double>(f.longest_row));
    f.samples = samples.patch * static_cast<double>(f.rows);
    f.sample_unit = samples.unit;
    f.form_factor_seconds = samples.seconds * samples.patch * static_cast<double>(f.rows);
    std::size_t gathered = sensors;
    if (node_indirect == IndirectMethod::gather) gathered += grid.nodes.size();
    f.gather_seconds = samples.seconds * samples.point * static_cast<double>(gathered);
    f.direct_seconds = direct_point_seconds(scene, backend, options, building.facets.size()) * static_cast<double>(grid.nodes.size() + sensors);
    // Nodes and sensors hold a PointIlluminance each; patches their polygon, light by component and source,
    // exitance, and the vectors of the radiosity (about ten numbers for each of six channels).
    const auto count = [](std::size_t n) { return static_cast<double>(n); };
    f.light_bytes = count(grid.nodes.size() + sensors) * (sizeof(PointIlluminance) + sizeof(Node)) +
                    count(grid.patches.size()) * (sizeof(Patch) + 8.0 * sizeof(LightBySource) + 480.0);
    // A row of a CSV file is about 300 bytes, and a file is written from memory.
    f.table_bytes = 300.0 * count(std::max({grid.nodes.size(), grid.patches.size(), sensors}));
    f.kept_row_bytes = (sizeof(std::uint32_t) + sizeof(double)) * count(f.rows) * static_cast<double>(f.longest_row);
    const double point_seconds = direct_point_seconds(scene, backend, options, building.facets.size()) + samples.seconds * samples.point;
    const PictureCost pictures = picture_cost(scene, backend, point_seconds);
    f.picture_bytes = pictures.bytes;
    f.picture_seconds = pictures.seconds;
    f.picture_writer_seconds = pictures.writer_seconds;
    return f;
}

std::vector<StageWork> stage_work(const Result& result) {
    const std::string_view backend = result.visibility.name();
    const BackendOptions options = settled(result.options.backends, result.grid);
    if (backend == "embree" && options.embree.target_error > 0.0) return {};
    const std::size_t rows = result.grid.gather_patch_count;
    const SamplesPerRow samples = samples_per_row(backend, options, result.building.facets.size(), rows);
    const auto times = [&](double per_row, auto count) { return per_row * static_cast<double>(count); };
    std::vector<StageWork> work;
    if (!came_from_cache(result.visibility)) work.push_back({"form factors", times(samples.patch, rows), samples.unit});
    if (result.options.daylight.node_indirect == IndirectMethod::gather)
        work.push_back({"nodes", times(samples.point, result.grid.nodes.size()), samples.unit});
    if (result.options.daylight.sensor_indirect == IndirectMethod::gather)
        work.push_back({"sensors",
                        times(samples.point, std::ranges::count(result.solution.sensors, Medium::indoor_air, &Sensor::medium)),
                        samples.unit});
    return work;
}

std::string dry_run_account(const RunOptions& options, const Scene& scene, const Building& building,
                            const PatchGrid& grid, const std::vector<Sensor>& sensors,
                            const Visibility& visibility) {
    const Forecast f = forecast(scene, building, grid, sensors.size(), visibility.name(), options.backends,
                                options.daylight.node_indirect);
    const SamplesPerRow samples =
        samples_per_row(visibility.name(), settled(options.backends, grid), building.facets.size(), f.rows);
    const DaylightOptions& daylight = options.daylight;
    std::string text =
        fmt::format("{}: quality {}, nothing computed\n", visibility.name(), options.quality.name);
    text += fmt::format(
        "  {} faces, {} facets, {} apertures; {} patches ({} indoors, {} in apertures), {} nodes, {} "
        "sensors\n",
        building.faces.size(), building.facets.size(), building.apertures.size(), grid.patches.size(),
        grid.indoor_patch_count, grid.gather_patch_count - grid.indoor_patch_count, grid.nodes.size(),
        sensors.size());
    text += fmt::format(
        "  grid {:.4g} m indoors, {:.4g} m outdoors, refined {} times; direct light {}, tolerance {:.3g}\n",
        scene.grid.spacing_m, scene.grid.outdoor_spacing_m, scene.grid.refine.levels,
        name_of(direct_methods, scene.direct.method), scene.direct.tolerance);
    text += fmt::format(
        "  IRC: nodes {}, sensors {}; form factors repaired: {}; radiosity to {:.3g}, at most {} "
        "iterations\n",
        name_of(indirect_methods, daylight.node_indirect),
        name_of(indirect_methods, daylight.sensor_indirect),
        name_of(form_factor_repairs, daylight.form_factors.repair), daylight.radiosity.tolerance,
        daylight.radiosity.max_iterations);
    text += "  settings:";
    for (const auto& [name, value] : visibility.settings())
        text += fmt::format(" {} {};", name, value);
    text.back() = '\n';
    text += fmt::format(
        "  memory at most about {} (form factors {}: {} rows of at most {} entries); this machine has {}\n",
        in_bytes(f.peak_bytes()), in_bytes(f.form_factor_bytes), f.rows, f.longest_row,
        in_bytes(physical_memory_bytes()));
    double gathered = static_cast<double>(sensors.size());
    if (daylight.node_indirect == IndirectMethod::gather) gathered += static_cast<double>(grid.nodes.size());
    text += fmt::format(
        "  work: {}{} {} for form factors, {} for interreflected light at points; direct light at {} "
        "points{}\n",
        at_most(visibility.name(), options.backends), in_millions(f.samples), f.sample_unit,
        in_millions(samples.point * gathered), grid.nodes.size() + sensors.size(),
        options.error_estimate ? "; about a quarter more for the error estimate" : "");
    text += fmt::format(
        "  time {}about {} of one core (form factors {}, interreflected light at points {}, direct light {}, pictures {}; zones and grid apart)\n",
        at_most(visibility.name(), options.backends), in_time(f.seconds()), in_time(f.form_factor_seconds), in_time(f.gather_seconds),
        in_time(f.direct_seconds), in_time(f.picture_seconds + f.picture_writer_seconds));
    return text;
}

void refuse_what_memory_cannot_hold(const Forecast& f, const Visibility& visibility, const PatchGrid& grid,
                                    Progress& progress) {
    const double memory = physical_memory_bytes();
    const double light = f.light_bytes + std::max(f.table_bytes, f.picture_bytes);
    if (light > memory)
        throw InputError("", fmt::format("light at {} nodes and the sensors needs about {} of memory, tables and pictures {}, and "
                                         "there are {} (a coarser grid, fewer sensors or smaller pictures need less)",
                                         grid.nodes.size(), in_bytes(f.light_bytes),
                                         in_bytes(std::max(f.table_bytes, f.picture_bytes)), in_bytes(memory)));
    refuse_excessive_memory(visibility, grid, memory - f.light_bytes, progress);
}

}  // namespace naturel
