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

}  // namespace

void write_form_factors(const FormFactorsOptions& options, Progress& progress) {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::filesystem::path> files_read;
    Scene read = read_scene_file(options.scene, options.quality, options.grid_spacing_m, files_read);
    refuse_to_replace(files_read, names_of_form_factor_files(options.out));
    if (!options.dry_run) make_writable_folder(options.out.has_parent_path() ? options.out.parent_path() : ".");
    const PreparedScene prepared = prepare_scene(std::move(read), options.quality, progress);
    const auto& [scene, building, sun, zones, grid] = prepared;
    const std::unique_ptr<Visibility> visibility =
        backends_named(options.backend).front().make(building, grid, options.backends);
    refuse_what_memory_cannot_hold(forecast(scene, building, grid, 0, options.backend, options.backends, IndirectMethod::patch),
                                   *visibility, grid, progress);
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
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
    if (!options.quiet)
        fmt::print(stderr, "{}, threads {}; {:.2f} s\n", visibility->name(), options.threads,
                   std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace naturel
