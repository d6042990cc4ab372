#include "cli/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <set>

#include "cli/choices.h"
#include "cli/colour_notes.h"
#include "cli/csv_writer.h"
#include "cli/false_colour.h"
#include "cli/file_writer.h"
#include "cli/forecast.h"
#include "cli/image_writer.h"
#include "cli/json_writer.h"
#include "cli/physical_memory.h"
#include "cli/zone_writer.h"
#include "core/errors.h"
#include "core/scene_reader.h"

namespace naturel {
namespace {

/// Collects how long the stages of a run take.
class StageClock {
public:
    StageClock() = default;
    /// Goes on from stages that are over, from now.
    explicit StageClock(std::vector<StageTime> stages) : stages_(std::move(stages)) {}

    /// Ends the stage that has been going on since construction or the last call.
    void end_stage(std::string stage) {
        const auto now = std::chrono::steady_clock::now();
        stages_.push_back({std::move(stage), std::chrono::duration<double>(now - start_).count()});
        start_ = now;
    }
    /// Takes over stages that were timed by somebody else since the last call.
    void add_stages(const std::vector<std::pair<std::string, double>>& stages) {
        for (const auto& [stage, seconds] : stages)
            stages_.push_back({stage, seconds});
        start_ = std::chrono::steady_clock::now();
    }
    const std::vector<StageTime>& stages() const { return stages_; }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::vector<StageTime> stages_;
};

void stop_if_interrupted(const Progress& progress) {
    if (progress.interrupted()) throw Interrupted();
}

Scene read_scene_with_overrides(const RunOptions& options) {
    Scene scene = read_scene(options.scene, scene_defaults(options.quality));
    if (options.grid_spacing_m) scene.grid.spacing_m = *options.grid_spacing_m;
    if (options.direct_method) scene.direct.method = *options.direct_method;
    if (options.direct_tolerance) scene.direct.tolerance = *options.direct_tolerance;
    for (View& view : scene.views) {
        if (options.exposure) view.picture.exposure = *options.exposure;
        if (options.tone_mapping) view.picture.tone_mapping = *options.tone_mapping;
        if (options.white_point) view.picture.white_point = *options.white_point;
    }
    return scene;
}

/// A file name for each view: its id without what could leave the folder or upset a shell or another file
/// system. Different ids get different names, also where upper and lower case are the same.
std::vector<std::string> view_file_stems(const std::vector<View>& views) {
    std::vector<std::string> stems;
    std::set<std::string> taken;
    for (const View& view : views) {
        std::string stem = view.id;
        for (char& c : stem) {
            const auto byte = static_cast<unsigned char>(c);
            const bool harmless = byte >= 0x80 || std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.';
            if (!harmless) c = '_';
        }
        if (stem.empty() || stem.front() == '.' || stem.front() == '-') stem.insert(0, "_");
        // 255 bytes is the usual limit of a name; endings and numbers are added. A UTF-8 character is not
        // cut.
        if (stem.size() > 200) {
            std::size_t end = 200;
            while ((static_cast<unsigned char>(stem[end]) & 0xc0) == 0x80)
                --end;
            stem.resize(end);
        }
        const auto in_lower_case = [](std::string text) {
            std::ranges::transform(text, text.begin(), [](unsigned char c) {
                return c < 0x80 ? static_cast<char>(std::tolower(c)) : c;
            });
            return text;
        };
        std::string unique = stem;
        for (int n = 2; !taken.insert(in_lower_case(unique)).second; ++n)
            unique = fmt::format("{}_{}", stem, n);
        stems.push_back(unique);
    }
    return stems;
}

ImageMetadata image_metadata(const Result& result, const View& view) {
    const auto text = [](const glm::dvec3& v) { return fmt::format("{:.9g} {:.9g} {:.9g}", v.x, v.y, v.z); };
    ImageMetadata metadata{
        {"naturel:scene", result.scene.name},
        {"naturel:scene_sha256", result.scene.source_sha256},
        {"naturel:backend", std::string(result.visibility.name())},
        {"naturel:view", view.id},
        {"naturel:from_m", text(view.from_m)},
        {"naturel:to_m", text(view.to_m)},
        {"naturel:up", text(view.up)}};
    if (view.kind == ViewKind::parallel)
        metadata.emplace_back("naturel:width_m", fmt::format("{:.9g}", view.width_m));
    else
        metadata.emplace_back("naturel:horizontal_fov_deg", fmt::format("{:.9g}", degrees_from_radians(view.field_of_view_rad)));
    return metadata;
}

/// The view in false colour with a legend; PNG.
std::string false_colour_png(const Result& result, const View& view, const Picture& picture, ImageMetadata metadata) {
    const FalseColour& wanted = result.options.false_colour;
    const bool luminance = wanted.quantity == FalseColourQuantity::luminance;
    std::vector<double> field, known;
    for (const Band3& band : luminance ? picture.luminance_cd_m2 : picture.illuminance_lx) {
        field.push_back(result.primaries.luminous(band));
        if (std::isfinite(field.back())) known.push_back(field.back());
    }
    std::optional<double> maximum = wanted.maximum;
    if (!maximum) {
        // As for the automatic exposure: the window or a spot of sun would leave one colour to the rest of the room.
        const double bright = white_luminance_cd_m2(std::move(known), {});
        maximum = round_maximum({&bright, 1});
    }
    const std::string unit = luminance ? "cd/m²" : "lx";
    metadata.emplace_back("naturel:unit", luminance ? "cd/m2" : "lx");
    return encode_png(draw_false_colour(field, view.width, view.height,
                                        {.title = fmt::format("{}: {} in {}", view.id,
                                                              luminance ? "luminance" : "illuminance of surfaces", unit),
                                         .unit = unit,
                                         .scale = wanted.scale,
                                         .maximum = maximum,
                                         .contours = wanted.contours}),
                      metadata);
}

std::vector<WrittenView> write_views(const Result& result, const std::filesystem::path& folder,
                                     Progress& progress) {
    std::vector<WrittenView> written;
    const std::vector<std::string> stems = view_file_stems(result.scene.views);
    for (std::size_t k = 0; k < stems.size(); ++k) {
        const View& view = result.scene.views[k];
        const Picture picture = draw_view(result.scene, result.building, result.grid, result.visibility,
                                          result.solution, view, progress);
        const ScreenPicture screen = map_to_screen(picture, result.primaries, view.picture,
                                                   result.solution.outdoors.sky_colour);
        ImageMetadata metadata = image_metadata(result, view);
        std::vector<std::string> files{"views/" + stems[k] + ".exr", "views/" + stems[k] + ".png"};
        if (result.options.false_colour.quantity != FalseColourQuantity::none) {
            files.push_back("views/false_colour/" + stems[k] + ".png");
            write_file(folder / files.back(), false_colour_png(result, view, picture, metadata));
        }
        metadata.emplace_back("naturel:unit", "cd/m2");
        write_file(folder / "views" / (stems[k] + ".exr"), encode_exr(picture, result.primaries, metadata));
        metadata.back() = {"naturel:white_cd_m2", fmt::format("{:.9g}", screen.white_luminance_cd_m2)};
        metadata.emplace_back("naturel:tone_mapping",
                              std::string(name_of(tone_mappings, view.picture.tone_mapping)));
        write_file(folder / "views" / (stems[k] + ".png"),
                   encode_png(screen, metadata));
        written.push_back({view.id, std::move(files), screen.white_luminance_cd_m2, view.picture});
    }
    return written;
}

/// Rounded to one decimal, without the "-0.0" that rounding noise would print.
double in_tenths(double value) {
    return std::round(value * 10.0) / 10.0 + 0.0;
}

/// The short account for people.
std::string account(const Result& result, const std::vector<SensorSetStatistics>& sets) {
    const RadiositySolution& radiosity = result.solution.radiosity;
    const FluxBalance flux = flux_balance(result);
    std::string text =
        fmt::format("{}: {} patches, {} nodes, {} sensors; outdoors {:.0f} lx without the sun\n",
                    result.visibility.name(), result.grid.patches.size(), result.grid.nodes.size(),
                    result.solution.sensors.size(), result.solution.outdoors.horizontal_illuminance().value);
    for (const SensorSetStatistics& set : sets) {
        text += fmt::format("  {} ({} points)", set.id, set.points);
        if (set.daylight_factor_percent)
            text += fmt::format(": daylight factor mean {:.2f} %, min {:.2f} %, max {:.2f} %",
                                set.daylight_factor_percent->mean, set.daylight_factor_percent->min,
                                set.daylight_factor_percent->max);
        if (set.illuminance_lx)
            text += fmt::format("; illuminance mean {:.1f} lx, min {:.1f} lx, max {:.1f} lx",
                                set.illuminance_lx->mean, set.illuminance_lx->min, set.illuminance_lx->max);
        text += '\n';
    }
    if (result.error) {
        const ErrorEstimate& error = *result.error;
        text += fmt::format(
            "  estimated error of illuminance, 95 % of sensors: {:.2f} % (sampling {:.2f} %, grid {}, direct "
            "light {:.2f} %)\n",
            100.0 * error.total(), 100.0 * error.sampling,
            error.grid ? fmt::format("{:.2f} %", 100.0 * *error.grid) : "not estimated",
            100.0 * error.direct);
    }
    text += fmt::format(
        "  flux in {:.1f} lm, absorbed {:.1f} lm, lost {:.1f} lm (gap {:.1e}); radiosity {} after {} "
        "iterations, "
        "residual {:.1e}\n",
        flux.in_lm, flux.absorbed_lm, in_tenths(flux.lost_lm), flux.relative_gap,
        radiosity.converged ? "converged" : "NOT converged", radiosity.iterations,
        radiosity.relative_residual);
    return text;
}

std::string account(const std::string& backend, const std::string& reference,
                    const std::vector<SensorSetDifference>& sets) {
    std::string text = fmt::format("{} minus {}, illuminance:\n", backend, reference);
    for (const SensorSetDifference& set : sets)
        text += fmt::format(
            "  {} ({} points): mean {:+.2f} lx, RMS {:.2f} lx, worst {:+.2f} lx at {} ({} has {:.1f} lx on "
            "average)\n",
            set.id, set.points, set.mean_lx, set.root_mean_square_lx, set.worst_lx, set.worst_point,
            reference, set.mean_reference_lx);
    return text;
}

void print(std::FILE* file, const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), file);
    std::fflush(file);
}

/// A line for every set with points that are not where people are.
std::string misplaced_sensors(const std::vector<SensorSetStatistics>& sets) {
    std::string text;
    for (const SensorSetStatistics& set : sets)
        if (set.points_in_solid > 0 || set.points_outdoors > 0)
            text += fmt::format(
                "sensors \"{}\": of {} points {} inside a solid (left empty in sensors.csv), {} outdoors\n",
                set.id, set.points, set.points_in_solid, set.points_outdoors);
    return text;
}

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

ExitCode dry_run(const RunOptions& options, Scene scene, const std::vector<Backend>& backends,
                 const Progress& progress) {
    const Building building = assemble(scene);
    choose_grid_spacing(scene, building, options.quality);
    stop_if_interrupted(progress);
    const PatchGrid grid = make_patch_grid(
        building, scene.grid, scene.grid.zones ? find_light_zones(scene, building) : LightZones{});
    const std::vector<Sensor> sensors = place_sensors(scene, building);
    stop_if_interrupted(progress);
    std::string text;
    for (const Backend& backend : backends)
        text += dry_run_account(options, scene, building, grid, sensors,
                                *backend.make(building, grid, options.backends));
    print(stdout, text);
    return ExitCode::done;
}

}  // namespace

ExitCode run(const RunOptions& options, Progress& progress) {
    StageClock shared_clock;
    Scene scene = read_scene_with_overrides(options);
    const std::vector<Backend> backends = backends_named(options.backend);
    if (options.dry_run) return dry_run(options, std::move(scene), backends, progress);
    for (const Backend& backend : backends) {
        make_writable_folder(options.out / backend.name);
        if (!scene.views.empty()) make_writable_folder(options.out / backend.name / "views");
        if (!scene.views.empty() && options.false_colour.quantity != FalseColourQuantity::none)
            make_writable_folder(options.out / backend.name / "views" / "false_colour");
    }
    if (!scene.views.empty()) require_image_writer();
    remove_results_of_earlier_run(options.out);
    for (const std::string& note : colour_notes(scene))
        print(stderr, "warning: " + note + "\n");
    shared_clock.end_stage("read scene");
    const Building building = assemble(scene);
    choose_grid_spacing(scene, building, options.quality);
    stop_if_interrupted(progress);
    shared_clock.end_stage("assembly");
    const std::optional<SunBeam> sun = sun_beam(scene);
    const LightZones zones =
        scene.grid.zones ? find_light_zones(scene, building, sun ? &*sun : nullptr) : LightZones{};
    stop_if_interrupted(progress);
    if (scene.grid.zones) shared_clock.end_stage("zones");
    const PatchGrid grid = make_patch_grid(building, scene.grid, zones);
    stop_if_interrupted(progress);
    shared_clock.end_stage("grid");
    const Primaries primaries(scene.primaries);
    const std::vector<Sensor> sensors = place_sensors(scene, building);

    bool converged = true;
    std::vector<SensorTotals> totals;
    for (const Backend& backend : backends) {
        const std::filesystem::path folder = options.out / backend.name;
        StageClock clock(shared_clock.stages());
        const std::unique_ptr<Visibility> visibility = backend.make(building, grid, options.backends);
        refuse_what_memory_cannot_hold(forecast(scene, building, grid, sensors.size(), backend.name, options.backends,
                                                options.daylight.node_indirect),
                                       *visibility, grid, progress);
        clock.end_stage("visibility");
        const DaylightSolution solution =
            compute_daylight(scene, building, grid, *visibility, options.daylight, sensors, progress);
        clock.add_stages(solution.stage_seconds);
        std::optional<ErrorEstimate> error;
        if (options.error_estimate) {
            const auto companion = [&](const PatchGrid& companion_grid, Companion kind) {
                return backend.make(building, companion_grid, companion_options(options.backends, kind));
            };
            error = estimate_error(scene, building, grid, zones, solution, options.daylight, companion,
                                   progress);
            clock.end_stage("error estimate");
        }
        const Result result{options, scene, building, grid, *visibility, solution, primaries, error};
        const std::vector<SensorSetStatistics> sets = sensor_set_statistics(result);

        // The summary goes first and comes last: where there is one, it speaks of the files beside it.
        std::error_code absent;
        std::filesystem::remove(folder / "summary.json", absent);
        write_file(folder / "sensors.csv", sensors_csv(result));
        write_file(folder / "nodes.csv", nodes_csv(result));
        write_file(folder / "patches.csv", patches_csv(result));
        clock.end_stage("tables");
        const std::vector<WrittenView> views = write_views(result, folder, progress);
        if (!views.empty()) clock.end_stage("views");
        write_file(folder / "timings.json", timings_json(clock.stages(), options.threads));
        // Zones do not depend on the backend. They come after everything that may fail in the first one.
        if (totals.empty() && scene.grid.zones)
            write_file(options.out / "zones.json",
                       zones_json({options.scene, scene, building, sun, zones, primaries}));
        write_file(folder / "summary.json", summary_json(result, sets, views));

        print(stdout, account(result, sets) + fmt::format("  written to {}\n", folder.string()));
        if (!options.quiet) {
            std::string times = fmt::format("{}, threads {}", backend.name, options.threads);
            for (const StageTime& stage : clock.stages())
                times += fmt::format("; {} {:.2f} s", stage.stage, stage.seconds);
            // Where sensors are does not depend on the backend.
            if (totals.empty()) times = misplaced_sensors(sets) + times;
            print(stderr, times + "\n");
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
            print(stdout, account(totals[k].backend.name, reference.backend.name, sets));
            write_file(comparison_file(options.out, totals[k].backend.name, reference.backend.name),
                       comparison_json(scene, options.scene, totals[k].backend, reference.backend, sets));
        }
    }
    return converged ? ExitCode::done : ExitCode::not_converged;
}

}  // namespace naturel
