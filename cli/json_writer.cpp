#include "cli/json_writer.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/choices.h"
#include "cli/colour_notes.h"
#include "cli/forecast.h"
#include "cli/json_text.h"
#include "cli/physical_memory.h"
#include "core/sky_models.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Statistics& statistics) {
    return {{"mean", statistics.mean},
            {"median", statistics.median},
            {"min", statistics.min},
            {"max", statistics.max}};
}

Json primaries_json(const PrimariesDescription& primaries) {
    if (primaries.name != PrimariesName::custom) return name_of(primaries_names, primaries.name);
    const auto xy = [](const Chromaticity& c) { return Json{c.x, c.y}; };
    return {{"red", xy(primaries.custom[0])}, {"green", xy(primaries.custom[1])}, {"blue", xy(primaries.custom[2])}};
}

Json options_json(const Result& result) {
    const Scene& scene = result.scene;
    const DaylightOptions& daylight = result.options.daylight;
    Json options{{"quality", result.options.quality.name},
                 {"grid_spacing_m", scene.grid.spacing_m},
                 {"outdoor_grid_spacing_m", scene.grid.outdoor_spacing_m},
                 {"grid_zones", scene.grid.zones},
                 {"grid_refine_levels", scene.grid.refine.levels},
                 {"grid_refine_contrast", scene.grid.refine.contrast},
                 {"direct_method", name_of(direct_methods, scene.direct.method)},
                 {"direct_tolerance", scene.direct.tolerance},
                 {"ground_shadows", scene.ground.shadows},
                 {"outdoor_interreflections", scene.outdoors.interreflections},
                 {"primaries", primaries_json(scene.primaries)},
                 {"sensor_irc", name_of(indirect_methods, daylight.sensor_indirect)},
                 {"node_irc", name_of(indirect_methods, daylight.node_indirect)},
                 {"form_factor_repair", name_of(form_factor_repairs, daylight.form_factors.repair)},
                 {"radiosity_tolerance", daylight.radiosity.tolerance},
                 {"max_iterations", daylight.radiosity.max_iterations}};
    return options;
}

Json outdoors_json(const Result& result) {
    const OutdoorLight& outdoors = result.solution.outdoors;
    Json json{{"sky", sky_model(result.scene.sky).name},
              {"zenith_luminance_cd_m2", outdoors.sky.zenith_luminance().value},
              {"horizontal_illuminance_lx", outdoors.horizontal_illuminance().value}};
    if (result.scene.sun)
        json["sun"] = {
            {"altitude_deg", degrees_from_radians(result.scene.sun->altitude_rad)},
            {"azimuth_deg",
             std::fmod(degrees_from_radians(result.scene.sun->azimuth_rad + result.scene.north_rad) + 720.0,
                       360.0)},
            {"direct_normal_illuminance_lx", outdoors.direct_normal_illuminance_lx}};
    return json;
}

Json scene_json(const Scene& scene, const std::filesystem::path& file) {
    return {{"name", scene.name}, {"file", file.filename().string()}, {"sha256", scene.source_sha256}};
}

Json backend_json(const ComparedBackend& backend) {
    Json settings = Json::object();
    for (const auto& [name, value] : backend.settings)
        settings[name] = value;
    return {{"name", backend.name}, {"settings", settings}};
}

Json sensor_sets_json(const std::vector<SensorSetStatistics>& sets) {
    Json json = Json::array();
    for (const SensorSetStatistics& set : sets) {
        Json entry{{"id", set.id},
                   {"points", set.points},
                   {"points_in_solid", set.points_in_solid},
                   {"points_outdoors", set.points_outdoors}};
        if (set.daylight_factor_percent) {
            entry["daylight_factor_percent"] = json_of(*set.daylight_factor_percent);
            // Uniformity is the smallest over the mean; a set in the dark has none.
            if (set.daylight_factor_percent->mean > 0.0)
                entry["daylight_factor_uniformity"] =
                    set.daylight_factor_percent->min / set.daylight_factor_percent->mean;
        }
        if (set.illuminance_lx) entry["illuminance_lx"] = json_of(*set.illuminance_lx);
        if (set.mean_components) {
            const Components& mean = *set.mean_components;
            entry["mean_components_lx"] = {{"sky", mean.sky_lx},
                                           {"sun", mean.sun_lx},
                                           {"erc_ground", mean.erc_ground_lx},
                                           {"erc_buildings", mean.erc_buildings_lx},
                                           {"irc", mean.irc_lx}};
        }
        json.push_back(entry);
    }
    return json;
}

/// Relative errors that 95 % of the sensors are estimated not to exceed; null where nothing was estimated.
Json estimated_error_json(const std::optional<ErrorEstimate>& error) {
    if (!error) return {};
    return {{"percentile", 95},
            {"points", error->points},
            {"relative_error", error->total()},
            {"sampling", error->sampling},
            {"grid", error->grid ? Json(*error->grid) : Json()},
            {"direct", error->direct}};
}

Json quality_json(const Result& result) {
    const FormFactorQuality& form_factors = result.solution.form_factor_quality;
    const RadiositySolution& radiosity = result.solution.radiosity;
    const FluxBalance flux = flux_balance(result);
    return {{"form_factors",
             {{"mean_lost", form_factors.mean_lost},
              {"worst_lost", form_factors.worst_lost},
              {"mean_truncated", form_factors.mean_truncated},
              {"worst_truncated", form_factors.worst_truncated},
              {"mean_escaped", form_factors.mean_escaped},
              {"worst_escaped", form_factors.worst_escaped},
              {"reciprocity_gap", form_factors.reciprocity_gap},
              {"worst_flux_error", form_factors.worst_flux_error},
              {"repair_change", form_factors.repair_change}}},
            {"radiosity",
             {{"iterations", radiosity.iterations},
              {"relative_residual", radiosity.relative_residual},
              {"converged", radiosity.converged}}},
            {"flux",
             {{"in_lm", flux.in_lm},
              {"absorbed_lm", flux.absorbed_lm},
              {"lost_lm", flux.lost_lm},
              {"relative_gap", flux.relative_gap}}}};
}

std::vector<std::string> assumptions(const Scene& scene) {
    std::vector<std::string> list{
    "Every opaque surface reflects diffusely (Lambert), glazing transmits without scattering.",
    light_colour_note(scene),
    "The ground is an infinite diffuse plane, lit by the unobstructed sky and sun unless ground_shadows is set.",
    "Outdoor surfaces reflect once and then as often as outdoor_interreflections says; light from indoors does not reach them.",
    "The daylight factor counts light from the sky alone, reflected light included; the sun is left out on "
    "both sides.",
    "Photometric values are the CIE luminance of the three bands in the primaries named under options.",
    };
    // Numbers stay those of the scene: what became of a colour is an assumption of the run.
    for (const std::string& note : colour_notes(scene))
        list.push_back("T" + note.substr(1) + ".");
    return list;
}

/// What pictures in false colour show, and how.
Json false_colour_json(const FalseColour& shown, std::optional<double> maximum) {
    Json json{{"quantity", name_of(false_colour_quantities, shown.quantity)},
              {"unit", shown.quantity == FalseColourQuantity::illuminance       ? "lx"
                       : shown.quantity == FalseColourQuantity::daylight_factor ? "%"
                                                                                : "cd/m2"},
              {"scale", name_of(colour_scale_kinds, shown.scale)}};
    if (maximum) json["maximum"] = *maximum;
    json["contours"] = shown.contours;
    return json;
}

/// What glare.json says of a view, without the sources.
Json glare_figures(const GlareJudgement& judgement) {
    Json figures = Json::parse(glare_json({judgement}))["views"][0];
    figures.erase("view");
    figures.erase("sources");
    return figures;
}

}  // namespace

std::string summary_json(const Result& result, const std::vector<SensorSetStatistics>& sets,
                         const std::vector<SensorMap>& maps, const std::vector<WrittenView>& views) {
    const PatchGrid& grid = result.grid;
    Json pictures = Json::array();
    Json files{"nodes.csv", "patches.csv", "scene.glb", "scene.vtp", "sensors.csv", "solution.bin", "timings.json"};
    if (result.options.report) files.push_back("report.html");
    if (std::ranges::any_of(views, [](const WrittenView& view) { return view.judgement.glare.has_value(); })) files.push_back(glare_file_name);
    for (const SensorMap& map : maps) files.push_back(map.file);
    for (const WrittenView& view : views) {
        pictures.push_back({{"id", view.id},
                            {"file", view.files.front()},
                            {"png_white_cd_m2", view.white_luminance_cd_m2},
                            {"png_exposure", name_of(exposure_modes, view.options.exposure.mode)},
                            {"png_tone_mapping", name_of(tone_mappings, view.options.tone_mapping)},
                            {"png_white_point", name_of(white_points, view.options.white_point)}});
        const FalseColour& false_colour = result.options.picture_files.false_colour;
        if (false_colour.quantity != FalseColourQuantity::none) pictures.back()["false_colour"] = false_colour_json(false_colour, view.false_colour_maximum);
        if (view.judgement.glare) pictures.back()["glare"] = glare_figures(view.judgement);
        for (const std::string& file : view.files)
            files.push_back(file);
    }
    return json_text({{"naturel", NATUREL_VERSION},
                    {"scene", scene_json(result.scene, result.options.scene)},
                    {"backend",
                     backend_json({std::string(result.visibility.name()), result.visibility.settings()})},
                    {"options", options_json(result)},
                    {"assumptions", assumptions(result.scene)},
                    {"counts",
                     {{"faces", result.building.faces.size()},
                      {"facets", result.building.facets.size()},
                      {"apertures", result.building.apertures.size()},
                      {"patches", grid.patches.size()},
                      {"indoor_patches", grid.indoor_patch_count},
                      {"aperture_patches", grid.gather_patch_count - grid.indoor_patch_count},
                      {"nodes", grid.nodes.size()},
                      {"sensors", result.solution.sensors.size()}}},
                    {"outdoors", outdoors_json(result)},
                    {"sensor_sets", sensor_sets_json(sets)},
                    {"estimated_error", estimated_error_json(result.error)},
                    {"quality", quality_json(result)},
                    {"views", pictures},
                    {"files", files}});
}

Json figures_json(const Result& result, const std::vector<SensorSetStatistics>& sets) {
    const Json quality = quality_json(result);
    return {{"outdoors", outdoors_json(result)},
            {"sensor_sets", sensor_sets_json(sets)},
            {"radiosity", quality["radiosity"]},
            {"flux", quality["flux"]}};
}

std::string timings_json(const Result& result, const std::vector<StageTime>& stages) {
    const std::vector<StageWork> work = stage_work(result);
    Json list = Json::array();
    double wall_s = 0.0, cpu_s = 0.0;
    std::set<std::size_t> all_workers;
    for (const StageTime& stage : stages) {
        Json workers = Json::array();
        for (const ThreadTime& worker : stage.workers) {
            workers.push_back({{"thread", worker.thread}, {"cpu_seconds", worker.cpu_s}});
            all_workers.insert(worker.thread);
        }
        Json entry{{"stage", stage.stage},
                   {"seconds", stage.wall_s},
                   {"cpu_seconds", stage.cpu_s},
                   {"threads_that_worked", stage.workers.size()},
                   {"workers", workers}};
        const auto asked = std::ranges::find(work, stage.stage, &StageWork::stage);
        if (asked != work.end() && stage.wall_s > 0.0)
            entry["work"] = {{"unit", asked->unit}, {"count", asked->count}, {"per_second", asked->count / stage.wall_s}};
        list.push_back(std::move(entry));
        wall_s += stage.wall_s;
        cpu_s += stage.cpu_s;
    }
    return json_text({{"threads", result.options.threads},
                      {"threads_that_worked", all_workers.size()},
                      {"total_seconds", wall_s},
                      {"total_cpu_seconds", cpu_s},
                      {"peak_memory_bytes", peak_memory_bytes()},
                      {"stages", list}});
}

std::string comparison_json(const Scene& scene, const std::filesystem::path& scene_file,
                            const ComparedBackend& backend, const ComparedBackend& reference,
                            const std::vector<SensorSetDifference>& sets) {
    Json list = Json::array();
    for (const SensorSetDifference& set : sets)
        list.push_back({{"id", set.id},
                        {"points", set.points},
                        {"mean_reference_lx", set.mean_reference_lx},
                        {"mean_difference_lx", set.mean_lx},
                        {"root_mean_square_difference_lx", set.root_mean_square_lx},
                        {"worst_difference_lx", set.worst_lx},
                        {"worst_point", set.worst_point}});
    return json_text({{"naturel", NATUREL_VERSION},
                      {"scene", scene_json(scene, scene_file)},
                      {"backend", backend_json(backend)},
                      {"reference", backend_json(reference)},
                      {"sensor_sets", list}});
}

}  // namespace naturel
