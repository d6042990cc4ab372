#include "cli/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/comparison.h"
#include "cli/comparison_figures.h"
#include "cli/comparison_report.h"
#include "cli/comparison_writer.h"
#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/json_text.h"
#include "cli/prepared_scene.h"
#include "core/colour_difference.h"
#include "core/errors.h"
#include "core/picture.h"
#include "core/tone_mapping.h"

namespace naturel {
namespace {

/// Pairs of patches in closed form cost the square of their number: so many take a minute or two.
constexpr std::size_t most_patches_for_pairs = 8000;

/// The reference, where pairs are too many, and its independent companion.
constexpr int reference_rays = 65536, companion_rays = 32768;
constexpr int reference_rays_per_point = 65536, companion_rays_per_point = 65536;
constexpr double reference_pair_tolerance = 1e-5;

EmbreeOptions reference_options(const PatchGrid& grid, std::uint64_t seed) {
    EmbreeOptions options{.rays_per_patch = reference_rays, .rays_per_point = reference_rays_per_point,
                          .pair_tolerance = reference_pair_tolerance, .seed = seed};
    if (grid.gather_patch_count <= most_patches_for_pairs) options.form_factors = FormFactorMethod::pairwise;
    return options;
}

EmbreeOptions companion_options(std::uint64_t seed) {
    return {.rays_per_patch = companion_rays, .rays_per_point = companion_rays_per_point, .seed = seed + 1};
}

std::string percent(double lx, double reference_lx) {
    return reference_lx > 0.0 ? fmt::format("{:+.3f} %", 100.0 * lx / reference_lx) : std::string("-");
}

/// The same surfaces in every pixel, lit by either solution, and exposed alike; what is brighter than white is white.
std::vector<PictureDifference> picture_differences(const Scene& scene, const Building& building, const PatchGrid& grid,
                                                   const Visibility& visibility, const ErrorBudget& budget, Progress& progress) {
    const Primaries primaries(scene.primaries);
    const glm::dvec3 white = primaries.xyz(grey(1.0));
    std::vector<PictureDifference> differences;
    for (const View& view : scene.views) {
        const auto draw = [&](const DaylightSolution& solution) {
            return draw_view(scene, building, grid, visibility, solution, view, progress);
        };
        const Picture a = draw(*budget.reference_solution), b = draw(*budget.method_solution);
        const double white_cd_m2 =
            map_to_screen(a, primaries, view.picture, budget.reference_solution->outdoors.sky_colour).white_luminance_cd_m2;
        if (a.luminance_cd_m2.empty() || !(white_cd_m2 > 0.0)) continue;
        const auto lab = [&](const Band3& luminance) {
            const glm::dvec3 xyz = primaries.xyz(luminance) / white_cd_m2;
            return lab_from_xyz(xyz / std::max(1.0, xyz.y), white);
        };
        std::vector<double> found;
        double sum = 0.0;
        for (std::size_t k = 0; k < a.luminance_cd_m2.size(); ++k) {
            found.push_back(colour_difference(lab(a.luminance_cd_m2[k]), lab(b.luminance_cd_m2[k])));
            sum += found.back();
        }
        std::ranges::sort(found);
        differences.push_back({view.id, sum / static_cast<double>(found.size()), found[(95 * found.size() + 99) / 100 - 1], found.back()});
    }
    return differences;
}

std::string account(const Comparison& comparison) {
    const ErrorBudget& budget = comparison.budget;
    constexpr std::size_t total = ComponentsAndTotal::total_index;
    std::string text;
    for (const PointSet& set : point_sets(comparison)) {
        const DifferenceStatistics all = difference_statistics(comparison, budget.method(), budget.reference, total, set);
        text += fmt::format("{} ({} points, {:.1f} lx on average by the reference):\n", set.id, all.points,
                            all.mean_reference_lx);
        const auto line = [&](std::string_view name, const DifferenceStatistics& d, std::string_view note) {
            text += fmt::format("  {:<20} mean {:>10}, RMS {:>9}, worst {:>10} at {}{}\n", name, percent(d.mean_lx, d.mean_reference_lx),
                                percent(d.rms_lx, d.mean_reference_lx).substr(1), percent(d.worst_lx, d.mean_reference_lx),
                                d.worst_point, note);
        };
        for (std::size_t k = 0; k < budget.ingredients.size(); ++k) {
            const Ingredient& ingredient = budget.ingredients[k];
            line(ingredient.name,
                 difference_statistics(comparison, ingredient.in_sequence, state_before(budget, k), total, set),
                 is_resolved(comparison, k, set) ? "" : " (not resolved)");
        }
        line("all together", all, "");
        line("reference's own", difference_statistics(comparison, budget.again, budget.reference, total, set), "");
    }
    for (const PictureDifference& picture : comparison.pictures)
        text += fmt::format("picture \"{}\": CIEDE2000 {:.2f} on average, 95 % of pixels below {:.2f}, worst {:.1f}\n", picture.view,
                            picture.mean, picture.percentile_95, picture.worst);
    return text;
}

}  // namespace

ExitCode compare(const CompareOptions& options, Progress& progress) {
    const std::vector<Backend> rays = backends_named("embree");
    if (rays.empty())
        throw InputError("compare", "this program was built without Embree: there is nothing to compare the projection with");
    std::vector<std::filesystem::path> files_read;
    Scene read = read_scene_file(options.scene, options.quality, options.grid_spacing_m, files_read);
    const auto keep_from = [&](const std::filesystem::path& name) { refuse_to_replace(files_read, std::vector{options.out / name}); };
    for (const char* name : {"comparison.json", "report.html"}) keep_from(name);
    if (read.sensors.empty())
        throw InputError(options.scene.string(), "/sensors: there are none (illuminance is compared at sensors: give a grid or points)");
    make_writable_folder(options.out);
    const PreparedScene prepared = prepare_scene(std::move(read), options.quality, progress);
    const auto& [scene, building, sun, zones, grid] = prepared;
    const BackendOptions reference_backend{.hemicube = {}, .embree = reference_options(grid, options.backends.embree.seed)};
    const BackendOptions companion_backend{.hemicube = {}, .embree = companion_options(options.backends.embree.seed)};
    const std::unique_ptr<Visibility> reference = rays.front().make(building, grid, reference_backend);
    const std::unique_ptr<Visibility> again = rays.front().make(building, grid, companion_backend);
    const std::unique_ptr<Visibility> projection = make_hemicube_visibility(building, grid, options.backends.hemicube);
    const BudgetVisibilities visibilities{*reference, *again, *projection};

    const HemicubeOptions& hemicube = options.backends.hemicube;
    BudgetOptions budget_options{.direct = {.method = options.direct_method, .tolerance = scene.direct.tolerance},
                                 .indirect = options.node_indirect,
                                 .repair = options.repair,
                                 .reference_tolerance = options.reference_tolerance,
                                 .radiosity = {.tolerance = 1e-9, .max_iterations = 1000}};
    if (hemicube.surface == ProjectionSurface::single_plane && hemicube.rim == RimShare::left_out)
        budget_options.half_side_over_height = hemicube.half_side_over_height;
    BudgetFormFactors form_factors;
    const ErrorBudget budget = compute_error_budget(scene, building, grid, visibilities, budget_options, form_factors, progress);

    std::vector<Sweep> sweeps;
    if (options.sweeps)
        sweeps = run_sweeps({.scene = scene, .building = building, .grid = grid, .reference = *reference, .rays = rays.front(),
                             .backends = options.backends, .reference_state = budget.reference,
                             .radiosity = budget_options.radiosity, .reference_tolerance = options.reference_tolerance,
                             .repeats = options.repeats},
                            progress);
    const std::vector<PictureDifference> pictures = picture_differences(scene, building, grid, *reference, budget, progress);
    const Comparison comparison{options, scene, building, grid, visibilities, budget, form_factors, sweeps, pictures};

    const nlohmann::ordered_json json = comparison_json(comparison);
    const auto tables = comparison_tables(comparison);
    for (const auto& [name, text] : tables) keep_from(name);
    std::error_code absent;
    std::filesystem::remove(options.out / "comparison.json", absent);
    for (const auto& [name, text] : tables) write_file(options.out / name, text);
    make_writable_folder(options.out / "figures");
    for (const auto& [name, svg] : comparison_figures(json)) write_file(options.out / "figures" / name, svg);
    write_file(options.out / "report.html", comparison_report(json));
    write_file(options.out / "comparison.json", json_text(json));
    const std::string text = account(comparison) + fmt::format("  written to {}\n", options.out.string());
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
    return ExitCode::done;
}

}  // namespace naturel
