#include "cli/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/vec2.hpp>
#include <nlohmann/json.hpp>

#include "cli/base64.h"
#include "cli/comparison_values.h"
#include "cli/little_endian.h"
#include "cli/page_template.h"
#include "cli/report_assets.h"
#include "cli/sensor_maps.h"
#include "cli/storeys.h"
#include "cli/svg_sheet.h"
#include "core/sky_models.h"
#include "core/tone_mapping.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

// A patch takes some 150 bytes of the page and several times that in a browser: pages with more would open slowly or not at all.
constexpr std::size_t most_patches_of_model = 1'000'000;

/// Numbers as base64 of little-endian bytes.
template <class Number>
std::string packed(const std::vector<Number>& numbers) {
    return base64(bytes_of(std::span<const Number>(numbers)));
}

/// One array per component of light.
Json light_json(std::span<const SurfaceLight> light) {
    const auto values = [&](const auto& value_of) {
        std::vector<float> numbers;
        numbers.reserve(light.size());
        for (const SurfaceLight& place : light) numbers.push_back(static_cast<float>(value_of(place)));
        return packed(numbers);
    };
    return {{"sky", values([](const SurfaceLight& place) { return place.parts.sky_lx; })},
            {"sun", values([](const SurfaceLight& place) { return place.parts.sun_lx; })},
            {"erc_ground", values([](const SurfaceLight& place) { return place.parts.erc_ground_lx; })},
            {"erc_buildings", values([](const SurfaceLight& place) { return place.parts.erc_buildings_lx; })},
            {"irc", values([](const SurfaceLight& place) { return place.parts.irc_lx; })},
            {"daylight_factor", values([](const SurfaceLight& place) { return place.daylight_factor_percent; })}};
}

Json mesh_json(const Result& result, const SurfaceMesh& mesh) {
    const PatchGrid& grid = result.grid;
    // Single precision near the scene: places are told from its first corner.
    const glm::dvec3 origin_m = mesh.positions_m.empty() ? glm::dvec3{} : mesh.positions_m.front();
    std::vector<float> positions;
    for (const glm::dvec3& place : mesh.positions_m)
        for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(place[axis] - origin_m[axis]));

    const double indoor_white = white_of_patches_cd_m2(result, mesh, 0, grid.indoor_patch_count);
    const double outdoor_white = white_of_patches_cd_m2(result, mesh, grid.gather_patch_count, grid.patches.size());
    std::vector<bool> outdoors(mesh.positions_m.size(), false);
    for (std::size_t k = mesh.first[grid.gather_patch_count]; k < mesh.outlines.size(); ++k) outdoors[mesh.outlines[k]] = true;
    std::vector<std::uint8_t> colours;
    for (std::size_t v = 0; v < mesh.light.size(); ++v)
        for (const std::uint8_t channel :
             srgb8(linear_srgb(result.primaries, 1.0 / (outdoors[v] ? outdoor_white : indoor_white) * mesh.light[v].luminance_cd_m2)))
            colours.push_back(channel);

    std::vector<std::uint32_t> faces;
    for (const Patch& patch : grid.patches) faces.push_back(static_cast<std::uint32_t>(index(patch.face)));
    Json names = Json::array();
    for (const Face& face : result.building.faces) names.push_back(face.name);
    return {{"origin_m", {origin_m.x, origin_m.y, origin_m.z}},
            {"nodes", grid.nodes.size()},
            {"indoor_patches", grid.indoor_patch_count},
            {"gather_patches", grid.gather_patch_count},
            {"white_cd_m2", indoor_white},
            {"face_names", names},
            {"faces", packed(faces)},
            {"first", packed(mesh.first)},
            {"outlines", packed(mesh.outlines)},
            {"positions", packed(positions)},
            {"colours", packed(colours)},
            {"light", light_json(mesh.light)},
            {"patch_light", light_json(std::span(mesh.patch_light).first(grid.gather_patch_count))}};
}

Json materials_json(const Result& result) {
    Json list = Json::array();
    for (const Material& material : result.scene.materials)
        list.push_back({{"name", material.name},
                        {"reflectance", result.primaries.luminous(material.reflectance)},
                        {"colour", srgb8(linear_srgb(result.primaries, material.reflectance))},
                        {"exitance_lm_m2", result.primaries.luminous(material.exitance_lm_m2)}});
    return list;
}

Json windows_json(const Result& result) {
    Json list = Json::array();
    for (const Aperture& aperture : result.building.apertures) {
        const Glazing& glazing = result.scene.glazings[index(aperture.glazing)];
        list.push_back({{"name", aperture.name},
                        {"area_m2", aperture.area_m2},
                        {"inner", aperture.inner},
                        {"glazing", glazing.name},
                        {"normal_transmittance", result.primaries.luminous(glazing.normal_transmittance)},
                        {"panes", glazing.panes},
                        {"inner_reflectance", result.primaries.luminous(glazing.inner_reflectance)},
                        {"maintenance", glazing.maintenance},
                        {"frame", glazing.frame}});
    }
    return list;
}

/// Rings or lines as lists of [x, y], m.
Json places_json(const std::vector<std::vector<glm::dvec3>>& lines) {
    Json list = Json::array();
    for (const std::vector<glm::dvec3>& line : lines) {
        Json places = Json::array();
        for (const glm::dvec3& place : line) places.push_back({place.x, place.y});
        list.push_back(places);
    }
    return list;
}

/// Walls and windows of the plan of a set: rings; segments where the grid cuts windows, outlines where they are above or below.
Json plan_json(const Result& result, std::size_t set_number) {
    const SensorGrid& grid = *result.scene.sensors[set_number].grid;
    const PlaneFrame plane = plan_frame(grid.z_m);
    const Region indoor = indoor_air_at_height(result.scene, grid.z_m);
    std::vector<std::vector<glm::dvec3>> rings, cuts, outlines;
    for (const Ring& ring : indoor) {
        std::vector<glm::dvec3>& places = rings.emplace_back();
        for (const PlanePoint& point : ring) places.push_back(plane.to_world(point));
    }
    for (const MapWindow& window : map_windows(result.building, grid.z_m, map_extent(result, set_number, indoor))) {
        cuts.insert(cuts.end(), window.cuts.begin(), window.cuts.end());
        outlines.insert(outlines.end(), window.outlines.begin(), window.outlines.end());
    }
    return {{"rings", places_json(rings)}, {"windows", places_json(cuts)}, {"windows_above_or_below", places_json(outlines)}};
}

/// The room of each sensor of a grid; -1 where a sensor is in none.
Json rooms_json(const Result& result, std::size_t set_number) {
    const SensorGrid& grid = *result.scene.sensors[set_number].grid;
    const PlaneFrame plan = plan_frame(grid.z_m);
    const std::vector<Region> rooms = rooms_of(indoor_air_at_height(result.scene, grid.z_m), grid);
    Json numbers = Json::array();
    for (const Sensor& sensor : result.solution.sensors) {
        if (sensor.set != set_number) continue;
        const PlanePoint place = plan.to_plane(sensor.point.position_m);
        const auto room = std::ranges::find_if(rooms, [&](const Region& part) { return contains(part, place); });
        numbers.push_back(room == rooms.end() ? -1 : static_cast<int>(room - rooms.begin()));
    }
    return numbers;
}

Json sets_json(const Result& result) {
    Json list = Json::array();
    for (std::size_t s = 0; s < result.scene.sensors.size(); ++s) {
        const SensorSet& set = result.scene.sensors[s];
        Json entry{{"id", set.id}};
        if (set.grid) {
            entry["grid"] = {{"z_m", set.grid->z_m}, {"spacing_m", set.grid->spacing_m}, {"margin_m", set.grid->margin_m}};
            entry["plan"] = plan_json(result, s);
            entry["rooms"] = rooms_json(result, s);
        }
        list.push_back(entry);
    }
    return list;
}

/// What the largest set of sensors shows, in two sentences.
std::string headline(const Json& summary) {
    const Json* largest = nullptr;
    for (const Json& set : value_below(summary, {"sensor_sets"}))
        if (largest == nullptr || set["points"] > (*largest)["points"]) largest = &set;
    if (largest == nullptr) return "The scene has no sensors: see the surfaces.";
    std::string words = fmt::format("On “{}”", text_below(*largest, {"id"}));
    const auto factor = number_below(*largest, {"daylight_factor_percent", "mean"});
    const auto illuminance = number_below(*largest, {"illuminance_lx", "mean"});
    if (!illuminance) return words + " no point is in the air.";
    if (factor)
        words += fmt::format(" the mean daylight factor is {}\u00a0% (median {}\u00a0%, minimum {}\u00a0%) and",
                             report_number(*factor, false, 2), report_number(*number_below(*largest, {"daylight_factor_percent", "median"}), false, 2),
                             report_number(*number_below(*largest, {"daylight_factor_percent", "min"}), false, 2));
    return words + fmt::format(" the mean illuminance {}{}\u00a0lx.", factor ? "" : "is ", report_number(*illuminance));
}

}  // namespace

std::string report_html(const Result& result, const SurfaceMesh& mesh, std::string_view summary_text, std::string_view sensors,
                        const std::vector<ReportPicture>& pictures) {
    const Json summary = Json::parse(summary_text);
    Json pictures_json = Json::array();
    for (const ReportPicture& picture : pictures)
        pictures_json.push_back({{"view", picture.view}, {"file", picture.file}, {"png", base64(picture.png)}});
    const bool has_model = result.grid.patches.size() <= most_patches_of_model;
    const std::string data = script_text({{"summary", summary},
                                          {"sky_words", sky_model(result.scene.sky).summary},
                                          {"north_rad", result.scene.north_rad},
                                          {"ground_reflectance", result.primaries.luminous(result.scene.ground.reflectance)},
                                          {"materials", materials_json(result)},
                                          {"windows", windows_json(result)},
                                          {"sets", sets_json(result)},
                                          {"sensors_csv", base64(sensors)},
                                          {"pictures", pictures_json},
                                          {"mesh", has_model ? mesh_json(result, mesh) : Json()},
                                          {"most_patches_of_model", most_patches_of_model}});
    const std::string scene = xml_text(text_below(summary, {"scene", result.scene.name.empty() ? "file" : "name"}));
    const std::string backend = xml_text(result.visibility.name());
    const std::string words = xml_text(headline(summary)), title = scene + " · naturel";
    return fill_template(report_page, {{"TITLE", title},
                                       {"SCENE", scene},
                                       {"BACKEND", backend},
                                       {"HEADLINE", words},
                                       {"STYLE", page_style},
                                       {"REPORT_STYLE", report_style},
                                       {"DATA", data},
                                       {"THREE_LICENCE", three_licence},
                                       {"THREE", three_script},
                                       {"ORBIT", orbit_script},
                                       {"PAGE", page_script},
                                       {"SURFACES", report_surfaces},
                                       {"SENSORS", report_sensors},
                                       {"SCRIPT", report_script}});
}

}  // namespace naturel
