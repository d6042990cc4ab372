#include "cli/stored_solution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "cli/choices.h"
#include "cli/file_reader.h"
#include "cli/little_endian.h"
#include "core/errors.h"
#include "core/ground_light.h"
#include "core/sha256.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view solution_magic = "naturel solution ";
constexpr int version = 1;
constexpr std::size_t digest_digits = 64;

/// The grid that a program makes of the stored scene has its nodes and patches within this of those of the run. Another processor may
/// round differently; another grid differs by much more.
constexpr double same_place_m = 1e-6;

/// An array of values that are made of doubles.
template <class T>
constexpr std::size_t doubles_in = sizeof(T) / sizeof(double);

template <class T>
std::string_view doubles_of(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(double) == 0);
    return bytes_of(std::span<const T>(values));
}

std::vector<glm::dvec3> node_places(const PatchGrid& grid) {
    std::vector<glm::dvec3> places;
    for (const Node& node : grid.nodes) places.push_back(node.position_m);
    return places;
}

std::vector<glm::dvec3> patch_places(const PatchGrid& grid) {
    std::vector<glm::dvec3> places;
    for (const Patch& patch : grid.patches) places.push_back(patch.centroid_m);
    return places;
}

// The arrays of a solution, each with its name. `visit` gets the name and the vector; the order is that of the file.
template <class Solution, class Visit>
void visit_arrays(Solution& solution, const Visit& visit) {
    visit("nodes", solution.nodes);
    visit("patch_direct", solution.patch_direct_lx);
    visit("patch_components", solution.patch_components);
    visit("patch_exitance", solution.radiosity.exitance_lm_m2);
    visit("patch_indirect", solution.radiosity.indirect_illuminance_lx);
    visit("outdoor_patches", solution.outdoors.patch_luminance_cd_m2);
    visit("outdoor_corners", solution.outdoors.corner_luminance_cd_m2);
    visit("ground_lattice", solution.outdoors.lattice_luminance_cd_m2);
    visit("sensors", solution.sensor_values);
}

Json numbers_of(const Band3& band) { return {band.r, band.g, band.b}; }

Band3 band_of(const Json& json) { return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()}; }

/// The value whose word stands in a key.
template <class Enum, std::size_t count>
Enum choice_of(const std::array<Choice<Enum>, count>& choices, const Json& word) {
    const auto found = std::ranges::find(choices, word.get<std::string>(), &Choice<Enum>::name);
    if (found == choices.end()) throw std::out_of_range("unknown word");
    return found->value;
}

Json options_json(const RunOptions& options) {
    const HemicubeOptions& hemicube = options.backends.hemicube;
    const EmbreeOptions& embree = options.backends.embree;
    const DaylightOptions& daylight = options.daylight;
    return {{"quality", options.quality.name},
            {"hemicube",
             {{"projection", name_of(projection_surfaces, hemicube.surface)},
              {"cells", hemicube.resolution},
              {"half_side_over_height", hemicube.half_side_over_height},
              {"cell_spacing", name_of(cell_spacings, hemicube.spacing)},
              {"rim", name_of(rim_shares, hemicube.rim)},
              {"viewpoints", hemicube.viewpoints},
              {"random_rotation", hemicube.random_rotation},
              {"seed", hemicube.seed}}},
            {"embree",
             {{"form_factors", name_of(form_factor_methods, embree.form_factors)},
              {"rays_per_patch", embree.rays_per_patch},
              {"rays_per_point", embree.rays_per_point},
              {"target_error", embree.target_error},
              {"most_rays_per_patch", embree.most_rays_per_patch},
              {"pair_tolerance", embree.pair_tolerance},
              {"seed", embree.seed}}},
            {"sensor_irc", name_of(indirect_methods, daylight.sensor_indirect)},
            {"node_irc", name_of(indirect_methods, daylight.node_indirect)},
            {"form_factor_repair", name_of(form_factor_repairs, daylight.form_factors.repair)},
            {"radiosity_tolerance", daylight.radiosity.tolerance},
            {"max_iterations", daylight.radiosity.max_iterations}};
}

RunOptions options_of(const Json& json) {
    RunOptions options;
    const auto quality = std::ranges::find(quality_presets, json.at("quality").get<std::string>(), &QualityPreset::name);
    if (quality == quality_presets.end()) throw std::out_of_range("unknown quality");
    options.quality = *quality;
    HemicubeOptions& hemicube = options.backends.hemicube;
    const Json& cube = json.at("hemicube");
    hemicube.surface = choice_of(projection_surfaces, cube.at("projection"));
    hemicube.resolution = cube.at("cells").get<int>();
    hemicube.half_side_over_height = cube.at("half_side_over_height").get<double>();
    hemicube.spacing = choice_of(cell_spacings, cube.at("cell_spacing"));
    hemicube.rim = choice_of(rim_shares, cube.at("rim"));
    hemicube.viewpoints = cube.at("viewpoints").get<int>();
    hemicube.random_rotation = cube.at("random_rotation").get<bool>();
    hemicube.seed = cube.at("seed").get<std::uint64_t>();
    EmbreeOptions& embree = options.backends.embree;
    const Json& rays = json.at("embree");
    embree.form_factors = choice_of(form_factor_methods, rays.at("form_factors"));
    embree.rays_per_patch = rays.at("rays_per_patch").get<int>();
    embree.rays_per_point = rays.at("rays_per_point").get<int>();
    embree.target_error = rays.at("target_error").get<double>();
    embree.most_rays_per_patch = rays.at("most_rays_per_patch").get<int>();
    embree.pair_tolerance = rays.at("pair_tolerance").get<double>();
    embree.seed = rays.at("seed").get<std::uint64_t>();
    DaylightOptions& daylight = options.daylight;
    daylight.sensor_indirect = choice_of(indirect_methods, json.at("sensor_irc"));
    daylight.node_indirect = choice_of(indirect_methods, json.at("node_irc"));
    daylight.form_factors.repair = choice_of(form_factor_repairs, json.at("form_factor_repair"));
    daylight.radiosity.tolerance = json.at("radiosity_tolerance").get<double>();
    daylight.radiosity.max_iterations = json.at("max_iterations").get<int>();
    return options;
}

Json picture_json(const PictureOptions& picture) {
    return {{"exposure", name_of(exposure_modes, picture.exposure.mode)},
            {"exposure_value", picture.exposure.value},
            {"tone_mapping", name_of(tone_mappings, picture.tone_mapping)},
            {"white_point", name_of(white_points, picture.white_point)}};
}

PictureOptions picture_of(const Json& json) {
    return {.exposure = {choice_of(exposure_modes, json.at("exposure")), json.at("exposure_value").get<double>()},
            .tone_mapping = choice_of(tone_mappings, json.at("tone_mapping")),
            .white_point = choice_of(white_points, json.at("white_point"))};
}

/// What options of the command line may have replaced in the scene.
Json replaced_json(const Scene& scene) {
    Json pictures = Json::array();
    for (const View& view : scene.views) pictures.push_back(picture_json(view.picture));
    return {{"grid_spacing_m", scene.grid.spacing_m},
            {"direct_method", name_of(direct_methods, scene.direct.method)},
            {"direct_tolerance", scene.direct.tolerance},
            {"picture", picture_json(scene.picture)},
            {"pictures", pictures}};
}

void replace(const Json& json, Scene& scene) {
    scene.grid.spacing_m = json.at("grid_spacing_m").get<double>();
    scene.direct.method = choice_of(direct_methods, json.at("direct_method"));
    scene.direct.tolerance = json.at("direct_tolerance").get<double>();
    const Json& pictures = json.at("pictures");
    if (pictures.size() != scene.views.size()) throw std::out_of_range("another number of views");
    for (std::size_t k = 0; k < scene.views.size(); ++k) scene.views[k].picture = picture_of(pictures[k]);
    scene.picture = picture_of(json.at("picture"));
}

Json radiosity_json(const RadiositySolution& radiosity) {
    return {{"iterations", radiosity.iterations},
            {"relative_residual", radiosity.relative_residual},
            {"converged", radiosity.converged},
            {"flux_in_lm", numbers_of(radiosity.flux_in_lm)},
            {"flux_absorbed_lm", numbers_of(radiosity.flux_absorbed_lm)},
            {"flux_lost_lm", numbers_of(radiosity.flux_lost_lm)}};
}

std::size_t count_of(const Json& json) {
    if (!json.is_number_unsigned()) throw std::out_of_range("not a count");
    return json.get<std::size_t>();
}

/// Takes the parts of a file off its front. What is missing is std::out_of_range.
class Parts {
public:
    explicit Parts(std::string_view rest) : rest_(rest) {}

    std::string_view take(std::size_t bytes) {
        if (bytes > rest_.size()) throw std::out_of_range("the end is missing");
        const std::string_view part = rest_.substr(0, bytes);
        rest_.remove_prefix(bytes);
        return part;
    }
    template <class T>
    std::vector<T> take_array(const Json& count) {
        const std::size_t n = count_of(count);
        if (n > rest_.size() / sizeof(T)) throw std::out_of_range("the end is missing");
        std::vector<T> values(n);
        if (n > 0) std::memcpy(static_cast<void*>(values.data()), take(n * sizeof(T)).data(), n * sizeof(T));
        return values;
    }

private:
    std::string_view rest_;
};

/// The first line says what the file is and how the rest of it must look. Returns the rest.
std::string_view checked_rest(std::string_view bytes, const std::string& file) {
    if (!bytes.starts_with(solution_magic))
        throw InputError(file, fmt::format("this is not a stored solution (\"naturel run\" writes {})", stored_solution_name));
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    const std::string_view words = bytes.substr(solution_magic.size(), end - solution_magic.size());
    const std::size_t blank = std::min(words.find(' '), words.size());
    if (words.substr(0, blank) != fmt::format("{}", version))
        throw InputError(file, fmt::format("the stored solution has another version of the format ({} would be right: run the scene again)", version));
    const std::string_view rest = bytes.substr(std::min(end + 1, bytes.size()));
    if (words.substr(std::min(blank + 1, words.size())) != sha256_hex(rest))
        throw InputError(file, "the stored solution is damaged or cut off (run the scene again)");
    return rest;
}

bool same_places(const std::vector<glm::dvec3>& a, const std::vector<glm::dvec3>& b) {
    return std::ranges::equal(a, b, [](const glm::dvec3& p, const glm::dvec3& q) { return glm::distance(p, q) <= same_place_m; });
}

}  // namespace

std::string stored_solution(const Result& result, std::span<const SourceFile> sources) {
    const std::vector<glm::dvec3> nodes = node_places(result.grid), patches = patch_places(result.grid);
    Json files = Json::array(), arrays = Json::array();
    std::string texts, numbers;
    for (const SourceFile& source : sources) {
        files.push_back({{"name", source.name}, {"bytes", source.text.size()}});
        texts += source.text;
    }
    const auto add = [&](const char* name, const auto& values) {
        using T = typename std::remove_cvref_t<decltype(values)>::value_type;
        arrays.push_back({{"name", name}, {"count", values.size()}, {"doubles", doubles_in<T>}});
        numbers += doubles_of(values);
    };
    add("node_places", nodes);
    add("patch_places", patches);
    visit_arrays(result.solution, add);
    const Json header{{"naturel", NATUREL_VERSION},
                      {"backend", result.visibility.name()},
                      {"options", options_json(result.options)},
                      {"scene", replaced_json(result.scene)},
                      {"radiosity", radiosity_json(result.solution.radiosity)},
                      {"sources", files},
                      {"arrays", arrays}};
    const std::string words = header.dump();
    std::string rest;
    append_bytes(rest, static_cast<std::uint64_t>(words.size()));
    rest += words;
    rest += texts;
    rest += numbers;
    return fmt::format("{}{} {}\n", solution_magic, version, sha256_hex(rest)) + rest;
}

StoredRun read_stored_solution(const std::filesystem::path& result, const Progress& progress) {
    std::error_code error;
    const std::filesystem::path file = std::filesystem::is_directory(result, error) ? result / stored_solution_name : result;
    if (!std::filesystem::exists(file, error))
        throw InputError(file.string(), "there is no such file (give the folder that \"naturel run\" wrote for a backend, e.g. out/embree)");
    const std::string bytes = file_content(file);
    Parts parts(checked_rest(bytes, file.string()));
    try {
        std::uint64_t header_bytes = 0;
        std::memcpy(&header_bytes, parts.take(sizeof header_bytes).data(), sizeof header_bytes);
        const Json header = Json::parse(parts.take(header_bytes));
        RunOptions options = options_of(header.at("options"));
        options.backend = header.at("backend").get<std::string>();

        std::vector<SourceFile> sources;
        for (const Json& source : header.at("sources"))
            sources.push_back({source.at("name").get<std::string>(), std::string(parts.take(count_of(source.at("bytes"))))});
        if (sources.empty()) throw std::out_of_range("no scene");
        options.scene = sources.front().name;
        Scene read = read_scene_sources(sources, scene_defaults(options.quality));
        replace(header.at("scene"), read);
        PreparedScene prepared = prepare_scene(std::move(read), options.quality, progress);
        const auto& [scene, building, sun, zones, grid] = prepared;

        std::size_t next_array = 0;
        const Json& arrays = header.at("arrays");
        const auto take = [&](const char* name, auto& values) {
            using T = typename std::remove_cvref_t<decltype(values)>::value_type;
            const Json& array = arrays.at(next_array++);
            if (array.at("name").get<std::string>() != name || array.at("doubles").get<std::size_t>() != doubles_in<T>)
                throw std::out_of_range("another array");
            values = parts.take_array<T>(array.at("count"));
        };
        std::vector<glm::dvec3> nodes, patches;
        take("node_places", nodes);
        take("patch_places", patches);
        DaylightSolution solution{.outdoors = outdoor_sources(scene)};
        visit_arrays(solution, take);
        if (scene.ground.shadows)
            solution.outdoors.ground_lattice = make_ground_lattice(scene, building, scene.grid.outdoor_spacing_m);
        solution.sensors = place_sensors(scene, building);
        solution.repair = options.daylight.form_factors.repair;

        const std::size_t exchanging = grid.gather_patch_count;
        const bool fits = same_places(nodes, node_places(grid)) && same_places(patches, patch_places(grid)) &&
                          solution.nodes.size() == nodes.size() && solution.patch_direct_lx.size() == exchanging &&
                          solution.patch_components.size() == exchanging && solution.radiosity.exitance_lm_m2.size() == exchanging &&
                          solution.radiosity.indirect_illuminance_lx.size() == exchanging &&
                          solution.outdoors.patch_luminance_cd_m2.size() == patches.size() &&
                          solution.outdoors.corner_luminance_cd_m2.size() == grid.corner_positions_m.size() &&
                          solution.outdoors.lattice_luminance_cd_m2.size() == solution.outdoors.ground_lattice.nodes.size() &&
                          solution.sensor_values.size() == solution.sensors.size();
        if (!fits)
            throw InputError(file.string(), fmt::format("naturel {} makes another grid of this scene than naturel {}, which stored the solution (run the scene again)",
                                                        NATUREL_VERSION, header.at("naturel").get<std::string>()));
        const Json& radiosity = header.at("radiosity");
        solution.radiosity.iterations = radiosity.at("iterations").get<int>();
        solution.radiosity.relative_residual = radiosity.at("relative_residual").get<double>();
        solution.radiosity.converged = radiosity.at("converged").get<bool>();
        solution.radiosity.flux_in_lm = band_of(radiosity.at("flux_in_lm"));
        solution.radiosity.flux_absorbed_lm = band_of(radiosity.at("flux_absorbed_lm"));
        solution.radiosity.flux_lost_lm = band_of(radiosity.at("flux_lost_lm"));
        return {std::move(options), std::move(prepared), std::move(solution)};
    } catch (const Json::exception&) {
        throw InputError(file.string(), "the stored solution has no header that can be read (run the scene again)");
    } catch (const std::out_of_range&) {
        throw InputError(file.string(), "the parts of the stored solution do not fit together (run the scene again)");
    }
}

}  // namespace naturel
