#include "cli/formfactors.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/choices.h"
#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/forecast.h"
#include "cli/form_factor_files.h"
#include "cli/json_text.h"
#include "cli/leaks.h"
#include "cli/physical_memory.h"
#include "cli/prepared_scene.h"
#include "core/errors.h"
#include "core/parallel.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

/// What the rows say of themselves, as they are in the file.
struct RowStatistics {
    std::size_t entries = 0;
    double min_sum = 0.0, mean_sum = 0.0, max_sum = 0.0;  ///< of the values of a row; the mean by area
    double worst_closure = 0.0;  ///< largest |1 - sum - lost - truncated|
    double worst_gap = 0.0;      ///< largest reciprocity_gaps()
    bool has_errors = false;
    double mean_error = 0.0, worst_error = 0.0;
};

RowStatistics row_statistics(const FormFactors& f, const PatchGrid& grid, const std::vector<double>& row_sum,
                             const std::vector<double>& gaps) {
    RowStatistics s{.entries = f.value.size(), .has_errors = !f.error.empty()};
    double area_m2 = 0.0;
    for (std::size_t i = 0; i < row_sum.size(); ++i) {
        s.min_sum = i == 0 ? row_sum[i] : std::min(s.min_sum, row_sum[i]);
        s.max_sum = std::max(s.max_sum, row_sum[i]);
        s.mean_sum += grid.patches[i].area_m2 * row_sum[i];
        area_m2 += grid.patches[i].area_m2;
        s.worst_closure = std::max(s.worst_closure, std::abs(1.0 - row_sum[i] - f.lost[i] - f.truncated[i]));
        s.worst_gap = std::max(s.worst_gap, gaps[i]);
    }
    if (area_m2 > 0.0) s.mean_sum /= area_m2;
    if (s.has_errors) {
        struct Errors {
            double sum = 0.0, worst = 0.0;
            Errors operator+(const Errors& o) const { return {sum + o.sum, std::max(worst, o.worst)}; }
        };
        const Errors errors = deterministic_sum<Errors>(f.error.size(), [&](std::size_t e) {
            const auto error = static_cast<double>(f.error[e]);
            return Errors{error, error};
        });
        s.mean_error = errors.sum / static_cast<double>(f.error.size());
        s.worst_error = errors.worst;
    }
    return s;
}

std::string account(const Visibility& visibility, const FormFactors& f, const RowStatistics& s) {
    const FormFactorQuality& q = f.quality;
    std::string text = fmt::format("{}: form factors of {} patches, {} entries, {:.1f} in a row\n", visibility.name(),
                                   f.row_count(), s.entries,
                                   static_cast<double>(s.entries) / static_cast<double>(std::max<std::size_t>(1, f.row_count())));
    text += fmt::format("  row sums: mean {:.9f} (by area), min {:.9f}, max {:.9f}; with what was lost and truncated, 1 within {:.1e}\n",
                        s.mean_sum, s.min_sum, s.max_sum, s.worst_closure);
    text += fmt::format(
        "  lost: mean {:.1e}, worst {:.1e}; truncated: mean {:.1e}, worst {:.1e}; escaped by rounding and shared out: mean {:.1e}, "
        "worst {:.1e}\n",
        q.mean_lost, q.worst_lost, q.mean_truncated, q.worst_truncated, q.mean_escaped, q.worst_escaped);
    text += fmt::format(
        "  reciprocity: |A_i F_ij - A_j F_ji| is {:.1e} of A_i F_ij + A_j F_ji as computed; in the file at most {:.1e} of a row; "
        "repair moved {:.1e}\n",
        q.reciprocity_gap, s.worst_gap, q.repair_change);
    text += s.has_errors ? fmt::format("  estimated errors: mean {:.1e}, largest {:.1e}\n", s.mean_error, s.worst_error)
                         : std::string("  estimated errors: none (this method or repair gives none)\n");
    return text;
}

std::string description(const FormFactorsOptions& options, const Scene& scene, const Visibility& visibility,
                        const FormFactors& f, const RowStatistics& s) {
    Json settings = Json::object();
    for (const auto& [name, value] : visibility.settings())
        settings[name] = value;
    const FormFactorQuality& q = f.quality;
    return json_text({{"naturel", NATUREL_VERSION},
                      {"scene",
                       {{"name", scene.name}, {"file", options.scene.filename().string()}, {"sha256", scene.source_sha256}}},
                      {"backend", {{"name", visibility.name()}, {"settings", settings}}},
                      {"options",
                       {{"quality", options.quality.name},
                        {"grid_spacing_m", scene.grid.spacing_m},
                        {"grid_zones", scene.grid.zones},
                        {"grid_refine_levels", scene.grid.refine.levels},
                        {"grid_refine_contrast", scene.grid.refine.contrast},
                        {"form_factor_repair", name_of(form_factor_repairs, options.repair)}}},
                      {"rows", f.row_count()},
                      {"entries", s.entries},
                      {"row_sum", {{"mean", s.mean_sum}, {"min", s.min_sum}, {"max", s.max_sum}}},
                      {"worst_closure", s.worst_closure},
                      {"mean_lost", q.mean_lost},
                      {"worst_lost", q.worst_lost},
                      {"mean_truncated", q.mean_truncated},
                      {"worst_truncated", q.worst_truncated},
                      {"mean_escaped", q.mean_escaped},
                      {"worst_escaped", q.worst_escaped},
                      {"reciprocity_gap_as_computed", q.reciprocity_gap},
                      {"worst_reciprocity_gap_of_a_row", s.worst_gap},
                      {"repair_change", q.repair_change},
                      {"mean_error", s.has_errors ? Json(s.mean_error) : Json()},
                      {"worst_error", s.has_errors ? Json(s.worst_error) : Json()}});
}

/// The most that this command has in memory at a time, where a row has so many entries.
double memory_bytes(const FormFactorsOptions& options, const PatchGrid& grid, double row_length) {
    // Of an entry: column, value and error, twice while rows are joined, or once with the transpose. A repair has more.
    constexpr double joined_bytes = 2.0 * (sizeof(std::uint32_t) + sizeof(double) + sizeof(float));
    const auto rows = static_cast<double>(grid.gather_patch_count);
    const double entries_bytes = options.repair == FormFactorRepair::none ? joined_bytes * rows * row_length
                                                                          : forecast_memory_bytes(grid.gather_patch_count, row_length) +
                                                                                sizeof(float) * rows * row_length;
    // Patch, nodes, and what the file says of a row.
    return entries_bytes + static_cast<double>(grid.patches.size()) * sizeof(Patch) + static_cast<double>(grid.nodes.size()) * sizeof(Node) + 250.0 * rows;
}

void refuse_too_many_entries(const FormFactorsOptions& options, const Forecast& f, const Visibility& visibility, const PatchGrid& grid,
                             Progress& progress) {
    const double memory = physical_memory_bytes();
    if (memory_bytes(options, grid, static_cast<double>(f.longest_row)) <= memory) return;
    const double needed = memory_bytes(options, grid, sample_form_factors(visibility, grid, progress).mean_row_length);
    if (needed <= memory) return;
    const std::string_view fewer = visibility.name() == "hemicube"     ? "; fewer \"--cells\" need less, too"
                                   : f.sample_unit == "rays" ? "; fewer \"--rays\" need less, too"
                                                             : "; \"--form-factors hemisphere\" needs less, too";
    throw InputError("", fmt::format("the form factors of {} patches need about {} of memory, and this machine has {} (a coarser grid needs less: "
                                     "a larger \"--grid-spacing\", or \"spacing_m\" of the scene's \"grid\"{})",
                                     f.rows, in_bytes(needed), in_bytes(memory), fewer));
}

std::string dry_run_text(const FormFactorsOptions& options, const Forecast& f, const Visibility& visibility, const PreparedScene& prepared) {
    const PatchGrid& grid = prepared.grid;
    const BackendOptions in_force = settled(options.backends, grid);
    std::string text = fmt::format("{}: form factors, quality {}, nothing computed\n", visibility.name(), options.quality.name);
    text += fmt::format("  {} facets, {} patches ({} indoors, {} in apertures), grid {:.4g} m indoors; form factors repaired: {}\n",
                        prepared.building.facets.size(), f.rows, grid.indoor_patch_count, grid.gather_patch_count - grid.indoor_patch_count,
                        prepared.scene.grid.spacing_m, name_of(form_factor_repairs, options.repair));
    text += "  settings:";
    for (const auto& [name, value] : visibility.settings()) text += fmt::format(" {} {};", name, value);
    text.back() = '\n';
    // A line of CSV takes 40 bytes where the numbers have all their digits; an entry of the others 12, and 4 for an error.
    const double entry_bytes = options.out.extension() == ".csv" ? 40.0 : 16.0;
    text += fmt::format("  memory at most about {} ({} rows of at most {} entries); this machine has {}\n",
                        in_bytes(memory_bytes(options, grid, static_cast<double>(f.longest_row))), f.rows, f.longest_row,
                        in_bytes(physical_memory_bytes()));
    text += fmt::format("  {}: at most about {}, {} if most of the room is seen from everywhere\n", options.out.string(),
                        in_bytes(entry_bytes * static_cast<double>(f.rows) * static_cast<double>(f.longest_row)), in_bytes(entry_bytes * f.usual_entries));
    text += fmt::format("  work: {}{} {}; time {}about {} of one core\n", at_most(visibility.name(), in_force), in_millions(f.samples), f.sample_unit,
                        at_most(visibility.name(), in_force), in_time(f.form_factor_seconds));
    return text;
}

}  // namespace

void write_form_factors(const FormFactorsOptions& options, Progress& progress) {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::filesystem::path> files_read;
    Scene read = read_scene_file(options.scene, options.quality, options.grid_spacing_m, files_read);
    refuse_to_replace(files_read, names_of_form_factor_files(options.out));
    if (!options.dry_run) make_writable_folder(options.out.has_parent_path() ? options.out.parent_path() : ".");
    const PreparedScene prepared = prepare_scene(std::move(read), options.quality, progress);
    const auto& [scene, building, sun, zones, grid] = prepared;
    if (grid.gather_patch_count == 0)
        throw InputError(options.scene.string(), "no surface indoors: there are no form factors (carve a room into a solid, or give polygons that enclose one)");
    const std::unique_ptr<Visibility> visibility = backends_named(options.backend).front().make(building, grid, options.backends);
    const Forecast work = forecast(scene, building, grid, 0, options.backend, options.backends, IndirectMethod::patch);
    if (options.dry_run) {
        print_at_once(stdout, dry_run_text(options, work, *visibility, prepared));
        return;
    }
    refuse_too_many_entries(options, work, *visibility, grid, progress);
    const FormFactors f = compute_form_factors(*visibility, grid, {.repair = options.repair, .errors = true}, progress);

    std::vector<double> row_sum(f.row_count());
    parallel_for(row_sum.size(), 64, [&](std::size_t i) {
        for (std::size_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) row_sum[i] += f.value[e];
    });
    const std::vector<double> gaps = reciprocity_gaps(f, grid);
    const RowStatistics statistics = row_statistics(f, grid, row_sum, gaps);
    const std::string described = description(options, scene, *visibility, f, statistics);
    if (progress.interrupted()) throw Interrupted();
    std::string text = account(*visibility, f, statistics);
    for (const std::filesystem::path& file : write_form_factor_files(options.out, {building, grid, f, row_sum, gaps, described}))
        text += fmt::format("  written to {}\n", file.string());
    print_at_once(stdout, text);
    print_at_once(stderr, leak_warning(building, grid, f.quality));
    if (!options.quiet)
        fmt::print(stderr, "{}, threads {}; {:.2f} s\n", visibility->name(), options.threads,
                   std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace naturel
