#include "cli/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <limits>
#include <thread>

#include "cli/choices.h"
#include "cli/stored_solution.h"
#include "core/errors.h"
#include "core/sky_models.h"
#include "core/picture_reader.h"
#include "core/view_reader.h"

namespace naturel {
namespace {

/// Refuses numbers outside [low, high], and NaN, which CLI::Range lets pass.
CLI::Validator within(double low, double high) {
    return CLI::Validator(
        [=](std::string& text) {
            double value = 0.0;
            const bool is_number = CLI::detail::lexical_cast(text, value);
            return is_number && value >= low && value <= high
                       ? std::string()
                       : fmt::format("\"{}\" is not a number from {} to {}", text, low, high);
        },
        "", "");
}

/// CLI11 wraps "-1" round to a large unsigned number, and takes what is too large as the largest.
CLI::Validator whole_number() {
    return CLI::Validator(
        [](std::string& text) {
            std::uint64_t value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            return error == std::errc() && end == text.data() + text.size()
                       ? std::string()
                       : fmt::format("\"{}\" is not a whole number from 0 to {}", text,
                                     std::numeric_limits<std::uint64_t>::max());
        },
        "", "");
}

/// Refuses what is no whole number in [low, high]; CLI11 would answer "1e3" without a word of what is right.
CLI::Validator whole_within(std::int64_t low, std::int64_t high, const std::string& what = "whole number") {
    return CLI::Validator(
        [=](std::string& text) {
            std::int64_t value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            return error == std::errc() && end == text.data() + text.size() && value >= low && value <= high
                       ? std::string()
                       : fmt::format("\"{}\" is not a {} from {} to {}", text, what, low, high);
        },
        "", "");
}

/// More rays take hours for one patch, and tell nothing that the noise of the others does not hide.
CLI::Validator ray_count() {
    return whole_within(1, 100'000'000, "whole number of rays");
}

/// A square of half side d at height h catches (4 / pi) s atan(s) of the view, s = (d/h) / sqrt(1 + (d/h)^2):
/// 1.3 % at d/h = 0.1.
CLI::Validator half_side() {
    constexpr double least = 0.1, most = 1e4;
    return CLI::Validator(
        [=](std::string& text) {
            double value = 0.0;
            return CLI::detail::lexical_cast(text, value) && value >= least && value <= most
                       ? std::string()
                       : fmt::format(
                             "\"{}\" is not a number from {} to {} (on a smaller plane its rim would hold most "
                             "of the view)",
                             text, least, most);
        },
        "", "");
}

template <class Target, class Enum, std::size_t count>
CLI::Option* add_choice(CLI::App& app, const std::string& name, Target& target,
                        const std::array<Choice<Enum>, count>& choices, const std::string& description) {
    std::vector<std::string_view> names;
    for (const Choice<Enum>& choice : choices)
        names.push_back(choice.name);
    const auto take = [name, names, &target, &choices](const std::string& word) {
        const auto found = std::ranges::find(choices, word, &Choice<Enum>::name);
        if (found == choices.end())
            throw CLI::ValidationError(
                name, fmt::format("unknown word \"{}\" (known: {})", word, fmt::join(names, ", ")));
        target = found->value;
    };
    return app.add_option_function<std::string>(name, take, description)
        ->type_name(fmt::format("{}", fmt::join(names, "|")));
}

std::string version_text() {
    std::string text = "naturel " NATUREL_VERSION;
    for (const Backend& backend : all_backends())
        text += fmt::format("\n{}{}{}", backend.name, backend.library.empty() ? "" : ": ", backend.library);
    return text;
}

void add_scene(CLI::App& app, std::filesystem::path& scene) {
    app.add_option("SCENE", scene, "scene file (JSON, see docs/scene_format.md)")
        ->required()
        ->type_name("FILE");
}

void add_threads(CLI::App& app, int& threads) {
    app.add_option("--threads", threads, "number of threads; results do not depend on it")
        ->type_name("N")
        ->check(whole_within(1, 1024));
}

CLI::Option* add_grid_spacing(CLI::App& app, std::optional<double>& spacing_m) {
    return app.add_option("--grid-spacing", spacing_m, "longest cell of the grid indoors, m")
        ->type_name("M")
        ->check(within(1e-3, 1e3));
}

void add_quality(CLI::App& app, QualityPreset& quality, const std::string& description) {
    std::vector<std::string_view> names;
    for (const QualityPreset& known : quality_presets)
        names.push_back(known.name);
    const auto take = [names, &quality](const std::string& word) {
        const auto found = std::ranges::find(quality_presets, word, &QualityPreset::name);
        if (found == quality_presets.end())
            throw CLI::ValidationError(
                "--quality", fmt::format("unknown word \"{}\" (known: {})", word, fmt::join(names, ", ")));
        quality = *found;
    };
    app.add_option_function<std::string>("--quality", take, description)
        ->type_name(fmt::format("{}", fmt::join(names, "|")))
        ->default_str(std::string(quality.name));
}

constexpr auto scene_group = "Instead of what the scene file says";

/// Accuracy options as the command line has them. Those that were not given are the preset's.
class AccuracyOptions {
public:
    /// Returns `option`, for chaining.
    template <class Target>
    CLI::Option* add(CLI::Option* option, Target& target, Target QualityPreset::*member) {
        fields_.push_back(
            {option, [&target, member](const QualityPreset& quality) { target = quality.*member; }});
        return option;
    }
    void take_from(const QualityPreset& quality) const {
        for (const Field& field : fields_)
            if (field.option->count() == 0) field.take(quality);
    }

private:
    struct Field {
        const CLI::Option* option;
        std::function<void(const QualityPreset&)> take;
    };
    std::vector<Field> fields_;
};

/// "auto", or a way to expose and its value: "white=500".
CLI::Option* add_exposure(CLI::App& app, std::optional<Exposure>& exposure) {
    const auto take = [&exposure](const std::string& text) {
        const std::size_t sign = std::min(text.find('='), text.size());
        const auto way = std::ranges::find(exposure_modes, text.substr(0, sign), &Choice<ExposureMode>::name);
        double value = 0.0;
        const bool plain = sign == text.size();
        if (way == exposure_modes.end() || plain != (way->value == ExposureMode::automatic) ||
            (!plain && !CLI::detail::lexical_cast(text.substr(sign + 1), value)))
            throw CLI::ValidationError(
                "--exposure", fmt::format("\"{}\" is not an exposure (auto, white=CD_M2, ev100=EV or percentile=PERCENT)", text));
        const Range range = exposure_range(way->value);
        if (!(value >= range.low && value <= range.high))
            throw CLI::ValidationError(
                "--exposure", fmt::format("\"{}\" is out of range ({} would be right)", text, range.words()));
        exposure = Exposure{way->value, value};
    };
    return app.add_option_function<std::string>("--exposure", take, "luminance shown as white in PNG files")
        ->type_name("auto|white=CD_M2|ev100=EV|percentile=PERCENT");
}

void add_picture_overrides(CLI::App& app, PictureOverrides& picture) {
    add_exposure(app, picture.exposure)->group(scene_group);
    add_choice(app, "--tone-mapping", picture.tone_mapping, tone_mappings, "how luminance becomes brightness in PNG files")
        ->group(scene_group);
    add_choice(app, "--white-point", picture.white_point, white_points, "the light that looks white in PNG files")
        ->group(scene_group);
}

void add_picture_files(CLI::App& app, PictureFiles& files) {
    std::vector<std::string_view> formats;
    for (const auto& format : image_formats) formats.push_back(format.name);
    app.add_option_function<std::vector<std::string>>(
           "--format",
           [&files, formats](const std::vector<std::string>& words) {
               files.formats.clear();
               for (const std::string& word : words) {
                   const auto found = std::ranges::find(image_formats, word, &Choice<ImageFormat>::name);
                   if (found == image_formats.end())
                       throw CLI::ValidationError(
                           "--format", fmt::format("unknown word \"{}\" (known: {})", word, fmt::join(formats, ", ")));
                   if (std::ranges::find(files.formats, found->value) == files.formats.end()) files.formats.push_back(found->value);
               }
           },
           "image files of each view, parted by commas: exr is cd/m2, png for screens, hdr for Radiance and its tools")
        ->type_name(fmt::format("{},...", fmt::join(formats, "|")))
        ->delimiter(',')
        ->default_str("exr,png");

    constexpr auto false_colour_group = "False colour (views/false_colour)";
    add_choice(app, "--false-colour", files.false_colour.quantity, false_colour_quantities,
               "draw what the views show in false colour, too")
        ->default_str(std::string(name_of(false_colour_quantities, files.false_colour.quantity)))
        ->group(false_colour_group);
    add_choice(app, "--false-colour-scale", files.false_colour.scale, colour_scale_kinds, "of the colours")
        ->default_str(std::string(name_of(colour_scale_kinds, files.false_colour.scale)))
        ->group(false_colour_group);
    app.add_option("--false-colour-max", files.false_colour.maximum,
                   "upper end of the scale, cd/m2, lx or %; unless given a round value that leaves windows and sun spots above it")
        ->type_name("X")
        ->check(within(1e-6, 1e10))
        ->group(false_colour_group);
    app.add_option("--contours", files.false_colour.contours, "values at which lines are drawn, parted by commas")
        ->type_name("X,X,...")
        ->delimiter(',')
        ->check(within(1e-6, 1e10))
        ->group(false_colour_group);
}

void add_zones_options(CLI::App& app, ZonesOptions& options) {
    add_scene(app, options.scene);
    app.add_option("--out", options.out, "folder for zones.json and the drawings")->type_name("DIR");
    app.add_flag("--svg", options.svg,
                 "draw every floor as a plan with its grid, sunspots and umbra zones, and its walls unrolled");
    add_threads(app, options.threads);
    app.add_flag("--quiet", options.quiet, "no progress on the terminal");
    add_quality(app, options.quality, "lays the grid of this quality where the scene asks for none");
    add_grid_spacing(app, options.grid_spacing_m)->group(scene_group);
}

/// words: the backends that may be named.
void add_backend(CLI::App& app, std::string& backend, const std::vector<std::string>& words) {
    app.add_option("--backend", backend, "visibility method")
        ->type_name(fmt::format("{}", fmt::join(words, "|")))
        ->check(CLI::Validator(
            [words](std::string& word) {
                return std::ranges::find(words, word) == words.end()
                           ? fmt::format("unknown backend \"{}\" (known: {})", word, fmt::join(words, ", "))
                           : std::string();
            },
            "", ""));
}

std::vector<std::string> single_backends() {
    std::vector<std::string> words;
    for (const Backend& backend : all_backends())
        words.emplace_back(backend.name);
    return words;
}

void add_form_factor_repair(CLI::App& app, FormFactorRepair& repair, const char* group) {
    add_choice(app, "--form-factor-repair", repair, form_factor_repairs,
               "what is done about form factors that break reciprocity or closure")
        ->default_str(std::string(name_of(form_factor_repairs, repair)))
        ->group(group);
}

/// The options of every backend, and the seed that they share.
constexpr auto hemicube_group = "Backend hemicube";

CLI::Option* add_cells(CLI::App& app, HemicubeOptions& hemicube) {
    return app
        .add_option("--cells", hemicube.resolution, "cells along a side of the square or of the top of the hemi-cube")
        ->type_name("N")
        ->check(whole_within(1, 4096))
        ->group(hemicube_group);
}

/// What no preset chooses.
void add_projection_options(CLI::App& app, HemicubeOptions& hemicube) {
    add_choice(app, "--projection", hemicube.surface, projection_surfaces,
               "surface the scene is projected on")
        ->default_str(std::string(name_of(projection_surfaces, hemicube.surface)))
        ->group(hemicube_group);
    app.add_option("--half-side-over-height", hemicube.half_side_over_height, "d/h of the single plane")
        ->type_name("X")
        ->check(half_side())
        ->group(hemicube_group);
    add_choice(app, "--spacing", hemicube.spacing, cell_spacings, "cells of the single plane")
        ->default_str(std::string(name_of(cell_spacings, hemicube.spacing)))
        ->group(hemicube_group);
    add_choice(app, "--rim", hemicube.rim, rim_shares, "light that passes below the rim of the single plane")
        ->default_str(std::string(name_of(rim_shares, hemicube.rim)))
        ->group(hemicube_group);
    app.add_option("--viewpoints", hemicube.viewpoints,
                   "points of a patch from which its form factors are taken; 1: its centroid")
        ->type_name("N")
        ->check(whole_within(1, 4096))
        ->group(hemicube_group);
    app.add_flag_callback(
           "--fixed-rotation", [&hemicube] { hemicube.random_rotation = false; },
           "do not turn the projection by a random angle about the normal")
        ->group(hemicube_group);
}

void add_backend_options(CLI::App& app, BackendOptions& backends, std::uint64_t& seed, AccuracyOptions& accuracy) {
    app.add_option("--seed", seed, "seed of every random choice")->type_name("N")->check(whole_number());

    constexpr auto embree_group = "Backend embree";
    EmbreeOptions& embree = backends.embree;
    accuracy
        .add(add_choice(app, "--form-factors", embree.form_factors, form_factor_methods,
                        "form factors from rays all over each patch, or of every pair of patches in closed form past "
                        "what stands between them"),
             embree.form_factors, &QualityPreset::form_factors)
        ->default_str(std::string(name_of(form_factor_methods, embree.form_factors)))
        ->group(embree_group);
    accuracy
        .add(app.add_option("--pair-tolerance", embree.pair_tolerance,
                            "pairwise: largest estimated error of a form factor"),
             embree.pair_tolerance, &QualityPreset::pair_tolerance)
        ->type_name("X")
        ->check(within(1e-9, 0.1))
        ->group(embree_group);
    accuracy
        .add(app.add_option("--rays", embree.rays_per_patch,
                            "hemisphere: rays per patch for form factors, rounded up to a multiple of 256"),
             embree.rays_per_patch, &QualityPreset::rays_per_patch)
        ->type_name("N")
        ->check(ray_count())
        ->group(embree_group);
    accuracy
        .add(app.add_option("--rays-per-point", embree.rays_per_point,
                            "hemisphere: rays per sensor for interreflected light, rounded up to a multiple of 256"),
             embree.rays_per_point, &QualityPreset::rays_per_point)
        ->type_name("N")
        ->check(ray_count())
        ->group(embree_group);
    app.add_option("--target-error", embree.target_error,
                   "hemisphere: double the rays of each patch until the estimated error of its row (the root of the sum of the squares "
                   "of its errors) is no larger; unless given, all patches have as many")
        ->type_name("X")
        ->default_str("")
        ->check(within(1e-6, 1.0))
        ->group(embree_group);
    app.add_option("--most-rays", embree.most_rays_per_patch, "hemisphere: rays per patch at which a target error is given up")
        ->type_name("N")
        ->check(ray_count())
        ->group(embree_group);

    accuracy
        .add(add_cells(app, backends.hemicube), backends.hemicube.resolution, &QualityPreset::cells);
    add_projection_options(app, backends.hemicube);
}

/// "500M", "10G", or plain bytes.
CLI::Validator byte_count() {
    return CLI::Validator(
        [](std::string& text) {
            double number = 0.0;
            const std::size_t unit = std::string("kMGT").find(text.empty() ? ' ' : text.back());
            const std::string digits = unit == std::string::npos ? text : text.substr(0, text.size() - 1);
            if (!CLI::detail::lexical_cast(digits, number) || !(number >= 0.0 && number <= 1e15))
                return fmt::format("\"{}\" is not a number of bytes such as 500M or 10G", text);
            if (unit != std::string::npos) text = fmt::format("{}", number * std::pow(1e3, static_cast<double>(unit) + 1.0));
            return std::string();
        },
        "", "");
}

void add_cache(CLI::App& app, FormFactorCache& cache) {
    constexpr auto group = "Form factors of earlier runs";
    app.add_option("--cache", cache.folder, "folder where form factors are kept for runs with the same geometry and options")
        ->type_name("DIR")
        ->group(group);
    app.add_option("--cache-limit", cache.limit_bytes, "bytes in that folder (500M, 10G); what was used longest ago goes first")
        ->type_name("BYTES")
        ->transform(byte_count())
        ->group(group);
}

void add_batch_options(CLI::App& app, BatchOptions& options) {
    app.add_option("STUDY", options.study, "study file (JSON, see docs/batch.md)")->required()->type_name("FILE");
    app.add_option("--out", options.out, "folder for the results; finished jobs found there are not computed again")->type_name("DIR");
    app.add_flag("--dry-run", options.dry_run, "print the jobs, what they share, memory and time, and compute nothing");
    add_threads(app, options.threads);
    app.add_flag("--quiet", options.quiet, "no progress on the terminal");
    add_choice(app, "--progress", options.progress, progress_forms, "how progress is told on stderr; json: an object a line")
        ->default_str(std::string(name_of(progress_forms, options.progress)));
    app.add_option("--max-failures", options.max_failures, "stop when more jobs than that have failed")->type_name("N")->check(whole_number());
    app.add_flag("--retry-failed", options.retry_failed, "compute jobs again that failed before");
    constexpr auto group = "More than one process";
    app.add_option_function<std::string>(
           "--shard",
           [&options](const std::string& text) {
               options.shard = shard_of_text(text);
               if (!options.shard) throw CLI::ValidationError("--shard", fmt::format("\"{}\" is no share of a study (2/8 would be the second of eight)", text));
           },
           "compute the I-th of N parts of the study (default: what the variables of a Slurm job array say)")
        ->type_name("I/N")
        ->group(group);
    add_choice(app, "--print", options.print, job_scripts, "write a script that runs the study in shards to stdout, and compute nothing")->group(group);
    app.add_option("--shards", options.shards, "of that script")->type_name("N")->check(whole_within(1, 100000))->group(group);
    add_cache(app, options.cache);
}

void add_merge_options(CLI::App& app, MergeOptions& options) {
    app.add_option("DIR", options.folders, "folders of one study, of its shards for example")->required()->type_name("DIR...");
    app.add_option("--out", options.out, "folder for the whole study; default: the only DIR")->type_name("DIR");
}

void add_run_options(CLI::App& app, RunOptions& options, std::uint64_t& seed, AccuracyOptions& accuracy) {
    // So that --help shows the numbers of the default.
    options.daylight.node_indirect = options.quality.node_indirect;
    options.daylight.sensor_indirect = options.quality.sensor_indirect;
    options.daylight.radiosity.tolerance = options.quality.radiosity_tolerance;
    options.backends = backend_options(options.quality);

    app.footer(quality_table());
    add_scene(app, options.scene);
    add_quality(app, options.quality, "chooses every accuracy option that is not given: see the table below");
    app.add_flag("--dry-run", options.dry_run,
                 "print what would be computed, with which options, memory and work, and compute nothing");
    app.add_flag_callback(
        "--no-error-estimate", [&options] { options.error_estimate = false; },
        "do not compute some sensors again to estimate the error (saves up to a quarter of the time)");
    app.add_flag_callback("--no-report", [&options] { options.report = false; }, "leave out report.html, the page for people");
    add_backend(app, options.backend, backend_words());
    app.add_option("--out", options.out,
                   "folder for the results; each backend writes into a folder of its name there")
        ->type_name("DIR");
    app.add_flag("--quiet", options.quiet, "no progress and no times on the terminal");

    add_grid_spacing(app, options.grid_spacing_m)->group(scene_group);
    add_choice(app, "--direct", options.direct_method, direct_methods, "how direct illuminance is computed")
        ->group(scene_group);
    app.add_option("--tolerance", options.direct_tolerance,
                   "relative error aimed at for direct illuminance (adaptive method)")
        ->type_name("X")
        ->check(within(1e-6, 0.5))
        ->group(scene_group);

    add_picture_overrides(app, options.picture);
    add_picture_files(app, options.picture_files);

    constexpr auto light_group = "Interreflection";
    accuracy
        .add(add_choice(
                 app, "--irc", options.daylight.sensor_indirect, indirect_methods,
                 "how interreflected light reaches sensors: mean of the patch, or gathered at the point"),
             options.daylight.sensor_indirect, &QualityPreset::sensor_indirect)
        ->default_str(std::string(name_of(indirect_methods, options.daylight.sensor_indirect)))
        ->group(light_group);
    accuracy
        .add(add_choice(app, "--node-irc", options.daylight.node_indirect, indirect_methods,
                        "the same for nodes of the grid"),
             options.daylight.node_indirect, &QualityPreset::node_indirect)
        ->default_str(std::string(name_of(indirect_methods, options.daylight.node_indirect)))
        ->group(light_group);
    add_form_factor_repair(app, options.daylight.form_factors.repair, light_group);
    accuracy
        .add(app.add_option("--radiosity-tolerance", options.daylight.radiosity.tolerance,
                            "bound on the relative error of the flux at which the iteration stops"),
             options.daylight.radiosity.tolerance, &QualityPreset::radiosity_tolerance)
        ->type_name("X")
        ->check(within(1e-14, 0.1))
        ->group(light_group);
    app.add_option("--max-iterations", options.daylight.radiosity.max_iterations,
                   "iterations after which radiosity gives up (exit code 4)")
        ->type_name("N")
        ->check(whole_within(1, 1'000'000'000))
        ->group(light_group);

    add_backend_options(app, options.backends, seed, accuracy);
    add_cache(app, options.cache);
}

void add_trace(CLI::App& app, RunOptions& options) {
    app.add_option("--trace", options.trace, "write when which thread did what, for ui.perfetto.dev or chrome://tracing")
        ->type_name("FILE");
}

void add_timing_options(CLI::App& app, TimingOptions& options, std::uint64_t& seed, AccuracyOptions& accuracy) {
    options.run.out = "timing";
    add_run_options(app, options.run, seed, accuracy);
    // A cache would leave the stage that it is about to the warm-up.
    for (const char* name : {"--dry-run", "--cache", "--cache-limit"}) app.remove_option(app.get_option(name));
    app.add_option("--threads", options.threads, "numbers of threads, parted by commas")
        ->type_name("N,N,...")
        ->delimiter(',')
        ->check(whole_within(1, 1024));
    app.add_option("--repeat", options.repeats, "runs with each number of threads")->type_name("N")->check(whole_within(1, 1000));
    app.add_flag("--weak", options.weak, "also with a grid of as many patches per thread as the first number of threads has");
}

void add_render_options(CLI::App& app, RenderOptions& options) {
    app.add_option("RESULT", options.result, "result of a run: the folder of a backend, e.g. out/embree")
        ->required()
        ->type_name("DIR");
    app.add_option("--view", options.views,
                   "a view of the scene by its id, a view in the words of a scene file ('{...}'), or a file of such; "
                   "may be repeated (default: all views of the scene)")
        ->type_name("ID|JSON|FILE")
        ->allow_extra_args(false);
    add_backend(app, options.backend, single_backends());
    app.get_option("--backend")->default_str("that of the run");
    app.add_option("--out", options.out, "folder for the pictures, in views/ there; not that of a run")->type_name("DIR");
    add_threads(app, options.threads);
    app.add_flag("--quiet", options.quiet, "no progress on the terminal");
    constexpr auto view_group = "Instead of what the views say";
    app.add_option("--width", options.width, "of the pictures; their height follows unless given")
        ->type_name("PIXELS")->check(whole_within(1, most_pixels_per_side))->group(view_group);
    app.add_option("--height", options.height, "of the pictures; their width follows unless given")
        ->type_name("PIXELS")->check(whole_within(1, most_pixels_per_side))->group(view_group);
    app.add_option("--samples", options.samples, "rays along each side of a pixel")
        ->type_name("N")->check(whole_within(1, 16))->group(view_group);
    add_picture_overrides(app, options.picture);
    add_picture_files(app, options.picture_files);
}

void add_check_options(CLI::App& app, CheckOptions& options, std::uint64_t& seed, AccuracyOptions& accuracy) {
    options.backends = backend_options(options.quality);
    add_scene(app, options.scene);
    add_quality(app, options.quality, "lays the grid of this quality where the scene asks for none");
    add_backend(app, options.backend, single_backends());
    add_grid_spacing(app, options.grid_spacing_m)->group(scene_group);
    add_backend_options(app, options.backends, seed, accuracy);
}

void add_form_factors_options(CLI::App& app, FormFactorsOptions& options, std::uint64_t& seed,
                              AccuracyOptions& accuracy) {
    options.backends = backend_options(options.quality);
    app.footer(form_factor_quality_table());
    add_scene(app, options.scene);
    add_quality(app, options.quality, "chooses the grid and every option of the backend that is not given: see the table below");
    app.add_flag("--dry-run", options.dry_run, "print what would be computed, with which options, memory and work, and compute nothing");
    add_backend(app, options.backend, single_backends());
    app.add_option("--out", options.out,
                   "file for the form factors; its ending says how: .csv, .npz (numpy, scipy) or .bin "
                   "(docs/form_factor_files.md)")
        ->type_name("FILE")
        ->check(CLI::Validator(
            [](std::string& name) {
                const auto extension = std::filesystem::path(name).extension();
                return extension == ".csv" || extension == ".npz" || extension == ".bin"
                           ? std::string()
                           : fmt::format("\"{}\" does not end in .csv, .npz or .bin", name);
            },
            "", ""));
    add_threads(app, options.threads);
    app.add_flag("--quiet", options.quiet, "no progress and no times on the terminal");
    add_form_factor_repair(app, options.repair, "Options");
    add_grid_spacing(app, options.grid_spacing_m)->group(scene_group);
    add_backend_options(app, options.backends, seed, accuracy);
    app.get_option("--rays-per-point")->group("");
}

/// An option that only one backend, or one of its methods, looks at.
struct OwnedOption {
    const char* name;
    std::string_view backend;
    std::optional<FormFactorMethod> method{};
};
constexpr std::array owned_options{
    OwnedOption{"--form-factors", "embree"},
    OwnedOption{"--pair-tolerance", "embree", FormFactorMethod::pairwise},
    OwnedOption{"--rays", "embree", FormFactorMethod::hemisphere},
    OwnedOption{"--rays-per-point", "embree", FormFactorMethod::hemisphere},
    OwnedOption{"--target-error", "embree", FormFactorMethod::hemisphere},
    OwnedOption{"--most-rays", "embree", FormFactorMethod::hemisphere},
    OwnedOption{"--cells", "hemicube"},
    OwnedOption{"--projection", "hemicube"},
    OwnedOption{"--half-side-over-height", "hemicube"},
    OwnedOption{"--spacing", "hemicube"},
    OwnedOption{"--rim", "hemicube"},
    OwnedOption{"--viewpoints", "hemicube"},
    OwnedOption{"--fixed-rotation", "hemicube"},
};

/// What is done about options of a backend that is not the chosen one.
enum class ForeignOptions { refused, left_alone };

void refuse_unused(const CLI::App& command, std::string_view backend, FormFactorMethod method, ForeignOptions foreign, std::string_view quality) {
    const auto given = [&](const char* name) { return command.get_option(name)->count() > 0; };
    for (const OwnedOption& option : owned_options) {
        if (!given(option.name)) continue;
        if (backend != option.backend && backend != "both") {
            if (foreign == ForeignOptions::left_alone) continue;
            throw CLI::ValidationError(option.name, fmt::format("is for the backend {}, and this is {} (leave it out, or give \"--backend {}\", too)",
                                                                option.backend, backend, option.backend));
        }
        if (!option.method || *option.method == method) continue;
        const std::string by_preset = given("--form-factors") ? std::string() : fmt::format("; quality \"{}\" takes {}", quality,
                                                                                            method == FormFactorMethod::pairwise ? "pairs" : "rays");
        throw CLI::ValidationError(option.name,
                                   method == FormFactorMethod::pairwise
                                       ? fmt::format("pairs of patches need no rays (give \"--form-factors hemisphere\", too{})", by_preset)
                                       : fmt::format("rays are cast without a tolerance (give \"--form-factors pairwise\", too{})", by_preset));
    }
}

/// Options of false colour mean nothing unless there is any.
void refuse_details_without_false_colour(const CLI::App& command, const PictureFiles& files) {
    if (!command.parsed() || files.false_colour.quantity != FalseColourQuantity::none) return;
    for (const char* name : {"--false-colour-scale", "--false-colour-max", "--contours"})
        if (command.get_option(name)->count() > 0)
            throw CLI::ValidationError(name, "nothing is drawn in false colour (give \"--false-colour luminance\", illuminance or daylight_factor, too)");
}

/// Options that the preset chooses take its values, unless given; those that would have no effect are refused.
template <class Options>
void finish(const CLI::App& command, const AccuracyOptions& accuracy, Options& options, std::uint64_t seed,
            ForeignOptions foreign = ForeignOptions::refused) {
    accuracy.take_from(options.quality);
    options.backends.hemicube.seed = seed;
    options.backends.embree.seed = seed;
    options.backends.most_patches_for_pairs = options.quality.most_patches_for_pairs;
    if (!command.parsed()) return;
    EmbreeOptions& embree = options.backends.embree;
    refuse_unused(command, options.backend, embree.form_factors, foreign, options.quality.name);
    const auto given = [&](const char* name) { return command.get_option(name)->count() > 0; };
    if (given("--form-factors") || given("--pair-tolerance")) options.backends.most_patches_for_pairs = any_number;
    const bool takes_embree = options.backend != "hemicube";
    if (takes_embree && given("--most-rays") && !given("--target-error"))
        throw CLI::ValidationError("--most-rays", "limits how often rays are doubled to reach a target error (give \"--target-error\", too)");
    if (takes_embree && given("--most-rays") && embree.most_rays_per_patch < embree.rays_per_patch)
        throw CLI::ValidationError("--most-rays", fmt::format("{} are fewer than the {} rays that every patch begins with (give fewer \"--rays\")",
                                                              embree.most_rays_per_patch, embree.rays_per_patch));
    // The default limits a search; rays that are asked for are no search.
    embree.most_rays_per_patch = std::max(embree.most_rays_per_patch, embree.rays_per_patch);
}

void add_compare_options(CLI::App& app, CompareOptions& options) {
    add_scene(app, options.scene);
    add_quality(app, options.quality, "lays the grid of this quality where the scene asks for none");
    app.add_option("--out", options.out, "folder for comparison.json, tables, figures and report.html")->type_name("DIR");
    add_threads(app, options.threads);
    app.add_flag("--quiet", options.quiet, "no progress on the terminal");
    add_grid_spacing(app, options.grid_spacing_m)->group(scene_group);
    add_choice(app, "--direct", options.direct_method, direct_methods, "how the method under study computes direct illuminance")
        ->default_str(std::string(name_of(direct_methods, options.direct_method)));
    add_choice(app, "--node-irc", options.node_indirect, indirect_methods,
               "how its interreflected light reaches nodes; sensors gather")
        ->default_str(std::string(name_of(indirect_methods, options.node_indirect)));
    add_form_factor_repair(app, options.repair, "Options");
    app.add_option("--reference-tolerance", options.reference_tolerance,
                   "relative error aimed at for the direct light of the reference")
        ->type_name("X")
        ->check(within(1e-6, 0.1));
    app.add_flag_callback("--no-sweeps", [&options] { options.sweeps = false; },
                          "do not vary cells, d/h, spacing, viewpoints and rays");
    app.add_option("--repeat", options.repeats, "times each cost is measured")->type_name("N")->check(whole_within(1, 99));
    add_cells(app, options.backends.hemicube);
    add_projection_options(app, options.backends.hemicube);
    app.add_flag_callback("--random-rotation", [&options] { options.backends.hemicube.random_rotation = true; },
                          "turn the projection by a random angle about the normal")
        ->group(hemicube_group);
}

/// An option that says what a scene's key would say.
struct DescriptionOption {
    const char* name;
    const char* object;
    const char* key;
    const char* type;
    const char* help;
};

constexpr std::array sun_options{
    DescriptionOption{"--altitude", "sun", "altitude_deg", "DEG", "sun above the horizon"},
    DescriptionOption{"--azimuth", "sun", "azimuth_deg", "DEG", "sun from true north, clockwise"},
    DescriptionOption{"--date", "sun", "date", "YYYY-MM-DD", "sun by the clock, with --time and the place"},
    DescriptionOption{"--time", "sun", "time", "HH:MM", "by the clock of --time-zone"},
    DescriptionOption{"--latitude", "site", "latitude_deg", "DEG", "north positive"},
    DescriptionOption{"--longitude", "site", "longitude_deg", "DEG", "east positive"},
    DescriptionOption{"--time-zone", "site", "time_zone_h", "H", "hours ahead of Greenwich"},
    DescriptionOption{"--direct-normal", "sun", "direct_normal_illuminance_lx", "LX|WORD",
                      "sunlight, or from_sky, gensky, ies_clear, turbid"},
};
constexpr std::array level_options{
    DescriptionOption{"--zenith-luminance", "sky", "zenith_luminance_cd_m2", "CD/M2", "level of the sky"},
    DescriptionOption{"--horizontal-illuminance", "sky", "horizontal_illuminance_lx", "LX",
                      "level of the sky, without the sun"},
    DescriptionOption{"--turbidity", "sky", "turbidity", "X", "of the formula for the level"},
    DescriptionOption{"--highest-sun", "sky", "highest_sun_deg", "DEG", "limit for the sun of the distribution (Radiance: 87)"},
    DescriptionOption{"--direct-irradiance", "sky", "direct_normal_irradiance_w_m2", "W/M2", "perez"},
    DescriptionOption{"--diffuse-irradiance", "sky", "diffuse_horizontal_irradiance_w_m2", "W/M2", "perez"},
    DescriptionOption{"--direct-illuminance", "sky", "direct_normal_illuminance_lx", "LX", "perez"},
    DescriptionOption{"--diffuse-illuminance", "sky", "diffuse_horizontal_illuminance_lx", "LX", "perez"},
    DescriptionOption{"--dew-point", "sky", "dew_point_c", "C", "perez"},
    DescriptionOption{"--day-of-year", "sky", "day_of_year", "N", "perez"},
    DescriptionOption{"--normalisation", "sky", "normalisation", "WORD", "perez: exact or patches_145"},
    DescriptionOption{"--table", "table", "file", "FILE", "table: luminances"},
    DescriptionOption{"--subdivision", "table", "subdivision", "WORD", "table: tregenza, reinhart_2 to 6, or raster"},
    DescriptionOption{"--interpolation", "table", "interpolation", "WORD", "table: constant or linear"},
    DescriptionOption{"--luminance", "sky", "luminance", "FORMULA", "expression, e.g. \"1 + 2*sin(altitude)\""},
};

void add_sky_options(CLI::App& app, SkyOptions& options) {
    app.add_option("SCENE|MODEL", options.target, "scene file, or the name of a sky")->required()->type_name("NAME");
    app.add_option("--out", options.out, "folder for sky.png")->type_name("DIR");
    app.add_option("--size", options.size, "diameter of the dome in the picture, pixels")
        ->type_name("N")
        ->check(whole_within(64, 8192));
    app.add_option("--maximum", options.maximum_cd_m2, "luminance at the end of the colours, cd/m2")
        ->type_name("X")
        ->check(within(1e-6, 1e12));
    app.add_flag_callback("--linear", [&] { options.logarithmic = false; }, "linear scale of colours");
    app.add_flag_callback("--logarithmic", [&] { options.logarithmic = true; }, "logarithmic scale of colours");
    const auto add_all = [&](const auto& list, const char* group) {
        for (const DescriptionOption& option : list) {
            app.add_option_function<std::string>(
                   option.name,
                   [&options, &option](const std::string& text) {
                       options.description[{option.object, option.key}] = text;
                   },
                   option.help)
                ->type_name(option.type)
                ->group(group);
        }
    };
    add_all(sun_options, "The sun of a model");
    app.add_flag_callback(
           "--summer-time", [&] { options.description[{"sun", "summer_time"}] = "true"; },
           "the clock is an hour ahead of --time-zone")
        ->group("The sun of a model");
    app.add_flag_callback(
           "--refraction", [&] { options.description[{"sun", "refraction"}] = "true"; },
           "raise the sun by the refraction of the air")
        ->group("The sun of a model");
    add_all(level_options, "The sky of a model");
    std::string models = "Models:\n";
    for (const SkyModelInfo& info : sky_models())
        models += fmt::format("  {:<20}{}{}\n", info.name, info.summary, info.needs_sun ? " (needs the sun)" : "");
    app.footer(models);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> CompareOptions::words() const {
    return {{"direct", std::string(name_of(direct_methods, direct_method))},
            {"node_irc", std::string(name_of(indirect_methods, node_indirect))},
            {"form_factor_repair", std::string(name_of(form_factor_repairs, repair))}};
}

void PictureOverrides::apply_to(PictureOptions& picture) const {
    if (exposure) picture.exposure = *exposure;
    if (tone_mapping) picture.tone_mapping = *tone_mapping;
    if (white_point) picture.white_point = *white_point;
}

RunOptions parse_run_options(const std::map<std::string, std::string>& words) {
    RunOptions run;
    std::uint64_t seed = run.backends.embree.seed;
    AccuracyOptions accuracy;
    CLI::App app("naturel");
    add_run_options(app, run, seed, accuracy);
    std::vector<std::string> arguments;
    for (const auto& [key, value] : words) {
        std::string name = key;
        std::ranges::replace(name, '_', '-');
        const bool is_flag = app.get_option("--" + name)->get_expected_max() == 0;
        if (value.empty()) throw InputError("", fmt::format("--{}: the value is an empty text (leave the option out)", name));
        if (is_flag && value != "true" && value != "false")
            throw InputError("", fmt::format("--{}: \"{}\" is neither true nor false", name, value));
        if (!is_flag || value == "true") arguments.push_back(is_flag ? "--" + name : fmt::format("--{}={}", name, value));
    }
    arguments.emplace_back("scene");
    try {
        std::ranges::reverse(arguments);  // CLI11 takes them from the back
        app.parse(arguments);
        // A study that varies the backend gives the options of both.
        finish(app, accuracy, run, seed, ForeignOptions::left_alone);
    } catch (const CLI::ParseError& error) {
        throw InputError("", error.what());
    }
    if (run.backend == "both") throw InputError("", "--backend: a job has one backend (vary \"backend\" to compare them)");
    return run;
}

std::variant<ExitCode, RunOptions, RenderOptions, TimingOptions, CheckOptions, FormFactorsOptions, CompareOptions, ZonesOptions, SkyOptions,
             BatchOptions, MergeOptions>
parse_command_line(int argc, const char* const* argv) {
    RunOptions run;
    ZonesOptions zones;
    FormFactorsOptions form_factors;
    CompareOptions compare;
    run.threads = zones.threads = form_factors.threads = compare.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 1024u));
    RenderOptions render;
    render.threads = run.threads;
    std::uint64_t seed = run.backends.embree.seed;
    CheckOptions check;

    CLI::App app("naturel: daylight in buildings by radiosity, with two ways to see", "naturel");
    app.option_defaults()->always_capture_default();
    app.set_version_flag("--version", version_text(), "print the version and leave");
    app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
        const auto commands = failed->get_subcommands();
        return fmt::format("naturel: {}\nSee naturel {}--help.\n", error.what(),
                           commands.empty() ? "" : commands.front()->get_name() + " ");
    });
    CLI::App* run_command =
        app.add_subcommand("run", "compute the daylight of a scene and write tables and pictures");
    AccuracyOptions accuracy;
    add_run_options(*run_command, run, seed, accuracy);
    add_threads(*run_command, run.threads);
    add_trace(*run_command, run);
    CLI::App* timing_command = app.add_subcommand("timing", "run a scene again and again with several numbers of threads");
    TimingOptions timing;
    AccuracyOptions timing_accuracy;
    add_timing_options(*timing_command, timing, seed, timing_accuracy);
    CLI::App* render_command = app.add_subcommand("render", "draw views of a finished run without computing it again");
    add_render_options(*render_command, render);
    CLI::App* check_command = app.add_subcommand(
        "check", "say what a scene contains and warn of likely mistakes, without computing light");
    AccuracyOptions check_accuracy;
    add_check_options(*check_command, check, seed, check_accuracy);
    CLI::App* form_factors_command =
        app.add_subcommand("formfactors", "write the form factors of a scene with their errors, and nothing else");
    AccuracyOptions form_factors_accuracy;
    add_form_factors_options(*form_factors_command, form_factors, seed, form_factors_accuracy);
    CLI::App* compare_command =
        app.add_subcommand("compare", "find what the projection costs in accuracy, ingredient by ingredient");
    add_compare_options(*compare_command, compare);
    CLI::App* zones_command = app.add_subcommand(
        "zones", "find where the sun shines indoors and where no window is seen, and draw it");
    add_zones_options(*zones_command, zones);

    BatchOptions batch;
    batch.threads = run.threads;
    CLI::App* batch_command = app.add_subcommand("batch", "compute every job of a study: scenes, and what varies in them");
    add_batch_options(*batch_command, batch);
    MergeOptions merge;
    CLI::App* merge_command = app.add_subcommand("merge", "write the results of a study whose jobs lie in several folders");
    add_merge_options(*merge_command, merge);

    SkyOptions sky;
    CLI::App* sky_command =
        app.add_subcommand("sky", "print the illuminances of a sky and draw its dome in false colour");
    add_sky_options(*sky_command, sky);

    app.require_subcommand(0, 1);
    app.allow_extras();  // so that an unknown command can be answered with the known ones

    try {
        app.parse(argc, argv);
        if (merge_command->parsed() && merge.folders.size() > 1 && merge.out.empty())
            throw CLI::ValidationError("--out", "several folders are merged into another one (name it)");
        if (app.get_subcommands().empty())
            throw CLI::ValidationError(
                app.remaining().empty()
                    ? "missing command (known: run, render, check, formfactors, compare, timing, zones, sky, batch, merge)"
                    : fmt::format("unknown command \"{}\" (known: run, render, check, formfactors, compare, timing, zones, sky, batch, merge)",
                                  app.remaining().front()));
        refuse_details_without_false_colour(*run_command, run.picture_files);
        refuse_details_without_false_colour(*render_command, render.picture_files);
        std::error_code absent;
        if (render_command->parsed() && std::filesystem::exists(render.out / stored_solution_name, absent))
            throw CLI::ValidationError("--out", fmt::format("\"{}\" is the folder of a run, whose pictures and glare would be replaced (name another one)",
                                                            render.out.string()));
        finish(*run_command, accuracy, run, seed);
        finish(*timing_command, timing_accuracy, timing.run, seed);
        finish(*check_command, check_accuracy, check, seed);
        if (form_factors_command->count("--rays-per-point") > 0)
            throw CLI::ValidationError("--rays-per-point", "is for light at points, and this command has none (\"--rays\" are those of a patch)");
        finish(*form_factors_command, form_factors_accuracy, form_factors, seed);
    } catch (const CLI::ParseError& error) {
        return app.exit(error, std::cout, std::cerr) == 0 ? ExitCode::done : ExitCode::wrong_usage;
    }
    if (render_command->parsed()) return render;
    if (check_command->parsed()) return check;
    if (timing_command->parsed()) {
        std::ranges::sort(timing.threads);
        timing.threads.erase(std::ranges::unique(timing.threads).begin(), timing.threads.end());
        timing.command = fmt::format("{}", fmt::join(argv, argv + argc, " "));
        return timing;
    }
    if (form_factors_command->parsed()) return form_factors;
    if (compare_command->parsed()) return compare;
    if (zones_command->parsed()) return zones;
    if (sky_command->parsed()) return sky;
    if (batch_command->parsed()) return batch;
    if (merge_command->parsed()) return merge;
    return run;
}

}  // namespace naturel
