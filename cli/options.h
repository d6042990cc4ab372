#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "cli/backends.h"
#include "cli/exit_codes.h"
#include "cli/form_factor_cache.h"
#include "cli/job_progress.h"
#include "cli/quality.h"
#include "cli/shard.h"
#include "core/daylight.h"
#include "core/false_colour.h"

namespace naturel {

/// What the false-colour pictures of the views show.
enum class FalseColourQuantity { none, luminance, illuminance, daylight_factor };

struct FalseColour {
    FalseColourQuantity quantity = FalseColourQuantity::none;
    ColourScaleKind scale = ColourScaleKind::linear;
    std::optional<double> maximum;  ///< default: round, and at least what an automatic exposure would show as white
    std::vector<double> contours;
};

/// Kinds of image files that are written of each view.
enum class ImageFormat { exr, png, hdr };

/// Replaces what the scene says of how its views are shown, where given.
struct PictureOverrides {
    std::optional<Exposure> exposure;
    std::optional<ToneMapping> tone_mapping;
    std::optional<WhitePoint> white_point;

    void apply_to(PictureOptions& picture) const;
};

/// What is written of each view.
struct PictureFiles {
    std::vector<ImageFormat> formats{ImageFormat::exr, ImageFormat::png};
    FalseColour false_colour;
};

/// `naturel run SCENE`
struct RunOptions {
    std::filesystem::path scene;
    std::string backend = default_backend();
    std::filesystem::path out = "out";
    int threads = 1;  ///< parse_command_line() puts the number of processors here unless told otherwise
    bool quiet = false;
    bool stages_apart = false;  ///< nothing is done beside a stage: for measuring, parse_command_line() leaves it
    std::optional<std::filesystem::path> trace;  ///< file for a trace of stages and threads
    bool dry_run = false;  ///< say what would be computed, and how, and stop
    /// What chose the accuracy options that were not given; they are in place when parse_command_line()
    /// returns, but for what the scene has a say in.
    QualityPreset quality = normal_quality;
    bool error_estimate = true;
    bool report = true;  ///< a page for each backend
    BackendOptions backends;
    DaylightOptions daylight;

    // These replace what the scene file says.
    std::optional<double> grid_spacing_m;
    std::optional<DirectMethod> direct_method;
    std::optional<double> direct_tolerance;
    PictureOverrides picture;

    PictureFiles picture_files;
    FormFactorCache cache;
};

/// `naturel timing SCENE`
struct TimingOptions {
    RunOptions run;  ///< what is timed; RunOptions::threads and quiet do not count
    std::vector<int> threads{1, 2};
    int repeats = 7;
    bool weak = false;  ///< also with patches in proportion to the threads
    std::string command;  ///< that asked for it
};

/// `naturel render RESULT`
struct RenderOptions {
    std::filesystem::path result;     ///< of a run: the folder of a backend, or its stored solution
    std::vector<std::string> views;   ///< ids of the scene, views as JSON, or files of such; empty: all of the scene
    std::string backend;  ///< that sees; empty: the one of the run
    std::filesystem::path out = "render";
    int threads = 1;  ///< as RunOptions::threads
    bool quiet = false;
    std::optional<int> width, height, samples;  ///< replace what the views say
    PictureOverrides picture;
    PictureFiles picture_files;
};

/// `naturel check SCENE`
struct CheckOptions {
    std::filesystem::path scene;
    std::string backend = default_backend();  ///< whose memory and time are forecast
    QualityPreset quality = normal_quality;   ///< whose grid is laid where the scene asks for none
    BackendOptions backends;
    std::optional<double> grid_spacing_m;  ///< replaces what the scene file says
};

/// `naturel formfactors SCENE`
struct FormFactorsOptions {
    std::filesystem::path scene;
    std::string backend = default_backend();  ///< one
    std::filesystem::path out = "form_factors.csv";  ///< its ending chooses the format
    bool dry_run = false;  ///< as RunOptions::dry_run
    int threads = 1;  ///< as RunOptions::threads
    bool quiet = false;
    QualityPreset quality = normal_quality;  ///< as RunOptions::quality
    BackendOptions backends;
    FormFactorRepair repair = FormFactorRepair::none;
    std::optional<double> grid_spacing_m;  ///< replaces what the scene file says
};

/// `naturel compare SCENE`: the method under study is a projection, by default the article's.
struct CompareOptions {
    std::filesystem::path scene;
    std::filesystem::path out = "study";
    int threads = 1;  ///< as RunOptions::threads
    bool quiet = false;
    QualityPreset quality = normal_quality;  ///< whose grid is laid where the scene asks for none
    BackendOptions backends{.hemicube = {.surface = ProjectionSurface::single_plane, .resolution = 128, .random_rotation = false},
                            .embree = {}};
    DirectMethod direct_method = DirectMethod::article;
    IndirectMethod node_indirect = IndirectMethod::patch;
    FormFactorRepair repair = FormFactorRepair::none;
    double reference_tolerance = 1e-4;  ///< of the direct light of the reference
    bool sweeps = true;
    int repeats = 3;  ///< of every time that is measured
    std::optional<double> grid_spacing_m;  ///< replaces what the scene file says

    /// What of the method is no option of its backend, in words.
    std::vector<std::pair<std::string, std::string>> words() const;
};

/// `naturel zones SCENE`
struct ZonesOptions {
    std::filesystem::path scene;
    std::filesystem::path out = "out";
    int threads = 1;  ///< as RunOptions::threads
    bool quiet = false;
    bool svg = false;  ///< draw a plan and the walls of every floor, too
    QualityPreset quality = normal_quality;  ///< as CheckOptions::quality
    std::optional<double> grid_spacing_m;  ///< replaces what the scene file says; the grid is only drawn
};

/// `naturel sky SCENE|MODEL`
struct SkyOptions {
    std::string target;  ///< a model's name or a scene file
    std::filesystem::path out = "out";
    int size = 720;  ///< of the dome in the picture, pixels
    std::optional<double> maximum_cd_m2;
    std::optional<bool> logarithmic;  ///< default: where the brightest spot is far above the rest

    /// What a scene would say of a model, by object and key: {"sun", "altitude_deg"} -> "40".
    std::map<std::pair<std::string, std::string>, std::string> description;
};

enum class JobScript { slurm, parallel };

/// `naturel batch STUDY`. What is computed, and how, the study says.
struct BatchOptions {
    std::filesystem::path study;
    std::filesystem::path out = "out";
    int threads = 1;  ///< as RunOptions::threads
    bool quiet = false;
    bool dry_run = false;
    ProgressForm progress = ProgressForm::text;
    std::optional<Shard> shard;       ///< default: what Slurm says
    std::optional<JobScript> print;   ///< write this script instead of computing
    std::size_t shards = 8;           ///< of the script
    std::optional<std::size_t> max_failures;
    bool retry_failed = false;
    FormFactorCache cache;
};

/// `naturel merge DIR...`
struct MergeOptions {
    std::vector<std::filesystem::path> folders;
    std::filesystem::path out;  ///< empty: the only folder itself
};

/// Options of `naturel run` by their names without "--" and with "_" for "-", as a study gives them. Throws InputError.
RunOptions parse_run_options(const std::map<std::string, std::string>& words);

/// What to do, or the exit code when there is nothing left to do: help and version have been printed on
/// stdout, a usage error on stderr.
std::variant<ExitCode, RunOptions, RenderOptions, TimingOptions, CheckOptions, FormFactorsOptions, CompareOptions, ZonesOptions, SkyOptions,
             BatchOptions, MergeOptions>
parse_command_line(int argc, const char* const* argv);

}  // namespace naturel
