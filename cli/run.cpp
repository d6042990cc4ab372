#include "cli/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "cli/colour_notes.h"
#include "cli/csv_writer.h"
#include "cli/file_reader.h"
#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/forecast.h"
#include "cli/glb_writer.h"
#include "cli/image_writer.h"
#include "cli/json_writer.h"
#include "cli/leaks.h"
#include "cli/prepared_scene.h"
#include "cli/report.h"
#include "cli/run_account.h"
#include "cli/sensor_maps.h"
#include "cli/stored_solution.h"
#include "cli/view_notes.h"
#include "cli/view_writer.h"
#include "cli/vtp_writer.h"
#include "cli/zone_writer.h"
#include "core/trace.h"

namespace naturel {
namespace {

std::filesystem::path comparison_file(const std::filesystem::path& out, std::string_view backend,
                                      std::string_view reference) {
    return out / fmt::format("{}_minus_{}.json", backend, reference);
}

/// Files beside the folders of the backends speak of the run that wrote them, and would outlive it.
void remove_results_of_earlier_run(const std::filesystem::path& out) {
    std::error_code absent;
    std::filesystem::remove(out / "zones.json", absent);
    for (const Backend& backend : all_backends())
        for (const Backend& reference : all_backends())
            std::filesystem::remove(comparison_file(out, backend.name, reference.name), absent);
}

/// What a run writes that may have the name of a scene or of a table.
std::vector<std::filesystem::path> tables_of_run(const std::filesystem::path& out) {
    std::vector<std::filesystem::path> files{out / "zones.json"};
    for (const Backend& backend : all_backends()) {
        for (const Backend& reference : all_backends()) files.push_back(comparison_file(out, backend.name, reference.name));
        for (const char* name : {"summary.json", "timings.json", glare_file_name, "sensors.csv", "nodes.csv", "patches.csv", "report.html"})
            files.push_back(out / backend.name / name);
    }
    return files;
}

/// What is kept of one backend to compare it with the next.
struct SensorTotals {
    ComparedBackend backend;
    std::vector<Sensor> sensors;
    std::vector<double> total_lx;  ///< luminous, [sensors]
};

SensorTotals sensor_totals(const Result& result) {
    SensorTotals totals{{std::string(result.visibility.name()), result.visibility.settings()},
                        result.solution.sensors,
                        {}};
    for (const PointIlluminance& point : result.solution.sensor_values)
        totals.total_lx.push_back(result.primaries.luminous(point.total_lx()));
    return totals;
}

BackendOptions companion_options(BackendOptions options, Companion kind) {
    if (kind == Companion::other_seed) {
        ++options.embree.seed;
        ++options.hemicube.seed;
        options.hemicube.random_rotation = true;  // what shows aliasing
        options.embree.pair_tolerance = std::max(1e-9, 0.25 * options.embree.pair_tolerance);  // pairs know no seed
    } else {
        options.embree.rays_per_patch = std::max(1, options.embree.rays_per_patch / 4);
    }
    return options;
}

/// The pictures of views that a browser shows.
std::vector<ReportPicture> report_pictures(const std::vector<WrittenView>& views, const std::filesystem::path& folder) {
    std::vector<ReportPicture> pictures;
    for (const WrittenView& view : views)
        for (const std::string& file : view.files) {
            if (!file.ends_with(".png")) continue;
            pictures.push_back({view.id, file, file_content(folder / file)});
        }
    return pictures;
}

ExitCode dry_run(const RunOptions& options, Scene scene, const std::vector<Backend>& backends,
                 const Progress& progress) {
    const PreparedScene prepared = prepare_scene(std::move(scene), options.quality, progress);
    const std::vector<Sensor> sensors = place_sensors(prepared.scene, prepared.building);
    std::string text;
    for (const Backend& backend : backends)
        text += dry_run_account(options, prepared.scene, prepared.building, prepared.grid, sensors,
                                *backend.make(prepared.building, prepared.grid, options.backends));
    print_at_once(stdout, text);
    return ExitCode::done;
}

}  // namespace

ExitCode run(const RunOptions& asked, Progress& progress) {
    RunOptions options = asked;
    std::optional<WholeFile> trace;
    if (options.trace) {
        trace.emplace(*options.trace);
        Trace::start();
    }
    StageClock shared_clock;
    std::vector<SourceFile> sources;
    Scene read = read_scene_file(options, sources);
    const std::vector<std::filesystem::path> files_read = paths_of_sources(options.scene, sources);
    if (options.trace) refuse_to_replace(files_read, std::vector{*options.trace}, "--trace");
    refuse_to_replace(files_read, tables_of_run(options.out));
    const std::vector<Backend> backends = backends_named(options.backend);
    if (options.dry_run) return dry_run(options, std::move(read), backends, progress);
    shared_clock.end_stage("read scene");
    const bool has_views = !read.views.empty();
    std::optional<ImageWriterOpening> opening;
    if (has_views) opening.emplace(options.stages_apart ? 1 : options.threads);
    for (const Backend& backend : backends) {
        make_writable_folder(options.out / backend.name);
        prepare_view_folders(read, options.picture_files, options.out / backend.name);
    }
    remove_results_of_earlier_run(options.out);
    for (const std::string& note : colour_notes(read))
        print_at_once(stderr, "warning: " + note + "\n");
    shared_clock.end_stage("open output");
    const PreparedScene prepared = prepare_scene(std::move(read), options.quality, progress, &shared_clock);
    const auto& [scene, building, sun, zones, grid] = prepared;
    options.backends = settled(options.backends, grid);  // grids of companions have other numbers of patches
    const Primaries primaries(scene.primaries);
    const std::vector<Sensor> sensors = place_sensors(scene, building);

    for (const std::string& note : view_notes(scene, building)) print_at_once(stderr, "warning: " + note + "\n");

    bool converged = true;
    std::vector<SensorTotals> totals;
    for (const Backend& backend : backends) {
        const std::filesystem::path folder = options.out / backend.name;
        StageClock clock(shared_clock.stages());
        const std::unique_ptr<Visibility> visibility =
            with_cache(backend.make(building, grid, options.backends), building, grid, options.cache);
        refuse_what_memory_cannot_hold(forecast(scene, building, grid, sensors.size(), backend.name, options.backends,
                                                options.daylight.node_indirect),
                                       *visibility, grid, progress);
        clock.end_stage("visibility");
        const DaylightSolution solution =
            compute_daylight(scene, building, grid, *visibility, options.daylight, sensors, progress);
        clock.add_stages(solution.stages);
        std::optional<ErrorEstimate> error;
        if (options.error_estimate) {
            const auto companion = [&](const PatchGrid& companion_grid, Companion kind) {
                return backend.make(building, companion_grid, companion_options(options.backends, kind));
            };
            error = estimate_error(scene, building, grid, zones, solution, options.daylight, companion,
                                   progress);
            clock.end_stage("error estimate");
        }
        print_at_once(stderr, leak_warning(building, grid, solution.form_factor_quality));
        const Result result{options, scene, building, grid, *visibility, solution, primaries, error};
        const std::vector<SensorSetStatistics> sets = sensor_set_statistics(result);

        if (has_views) {
            require_image_writer();
            clock.end_stage("picture writer");
        }
        // The summary goes first and comes last: where there is one, it speaks of the files beside it.
        std::error_code absent;
        std::filesystem::remove(folder / "summary.json", absent);
        std::filesystem::remove(folder / "report.html", absent);
        const std::string sensors_text = sensors_csv(result);
        write_file(folder / "sensors.csv", sensors_text);
        write_file(folder / "nodes.csv", nodes_csv(result));
        write_file(folder / "patches.csv", patches_csv(result));
        write_file(folder / stored_solution_name, stored_solution(result, sources));
        const std::vector<SensorMap> maps = draw_sensor_maps(result, sets);
        for (const SensorMap& map : maps) {
            make_writable_folder((folder / map.file).parent_path());
            write_file(folder / map.file, map.svg);
        }
        clock.end_stage("tables");
        const SurfaceMesh mesh = make_surface_mesh(result);
        write_file(folder / "scene.glb", scene_glb(result, mesh));
        write_file(folder / "scene.vtp", scene_vtp(result, mesh));
        clock.end_stage("3D files");
        const std::vector<WrittenView> views = write_views(result, folder, progress);
        if (!views.empty()) clock.end_stage("views");
        const std::vector<GlareJudgement> judgements = judgements_of(views);
        for (const std::string& warning : glare_warnings(judgements)) print_at_once(stderr, "warning: " + warning + "\n");
        const std::string glare = glare_json(judgements);
        std::filesystem::remove(folder / glare_file_name, absent);
        if (!glare.empty()) write_file(folder / glare_file_name, glare);
        const std::string summary = summary_json(result, sets, maps, views);
        if (options.report) {
            write_file(folder / "report.html", report_html(result, mesh, summary, sensors_text, report_pictures(views, folder)));
            clock.end_stage("report");
        }
        write_file(folder / "timings.json", timings_json(result, clock.stages()));
        // Zones do not depend on the backend. They come after everything that may fail in the first one.
        if (totals.empty() && scene.grid.zones)
            write_file(options.out / "zones.json",
                       zones_json({options.scene, scene, building, sun, zones, primaries}));
        write_file(folder / "summary.json", summary);

        print_at_once(stdout, run_account(result, sets) + glare_account(judgements) + fmt::format("  written to {}\n", folder.string()));
        if (!options.quiet) {
            std::string times = fmt::format("{}, threads {}", backend.name, options.threads);
            for (const StageTime& stage : clock.stages())
                times += fmt::format("; {} {:.2f} s", stage.stage, stage.wall_s);
            // Where sensors are does not depend on the backend.
            if (totals.empty()) times = misplaced_sensors(sets) + times;
            print_at_once(stderr, times + "\n");
        }
        converged = converged && solution.radiosity.converged;
        totals.push_back(sensor_totals(result));
    }
    if (totals.size() > 1) {
        // The last backend is the reference: ray casting has no bias.
        const SensorTotals& reference = totals.back();
        for (std::size_t k = 0; k + 1 < totals.size(); ++k) {
            const auto sets =
                compare_sensor_sets(scene, reference.sensors, totals[k].total_lx, reference.total_lx);
            print_at_once(stdout, difference_account(totals[k].backend.name, reference.backend.name, sets));
            write_file(comparison_file(options.out, totals[k].backend.name, reference.backend.name),
                       comparison_json(scene, options.scene, totals[k].backend, reference.backend, sets));
        }
    }
    if (trace) {
        trace->write(Trace::json());
        trace->put_in_place();
    }
    return converged ? ExitCode::done : ExitCode::not_converged;
}

}  // namespace naturel
