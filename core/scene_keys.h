#pragma once
#include <array>
#include <string_view>

namespace naturel {

/// The keys of one kind of object in a scene file. The reader refuses any other key; docs/scene.schema.json
/// lists the same ones (a test compares them). Objects whose keys are the user's names ("materials", "faces")
/// are not here.
struct SceneObjectKeys {
    std::string_view name;                       ///< in "$defs" of the schema; "scene" is the schema itself
    std::array<std::string_view, 8> required{};  // unused places are empty
    std::array<std::string_view, 16> optional{};
};

namespace scene_keys {

inline constexpr SceneObjectKeys scene{
    "scene",
    {"naturel", "materials", "sky"},
    {"$schema", "name", "description", "site", "ground", "polyhedra", "polygons", "apertures", "sun", "grid",
     "direct", "primaries", "sensors", "views", "picture", "outdoors"}};
inline constexpr SceneObjectKeys site{
    "site", {}, {"latitude_deg", "longitude_deg", "time_zone_h", "north_deg"}};
inline constexpr SceneObjectKeys material{
    "material", {}, {"reflectance", "xyY", "rgb", "spectral_reflectance", "exitance_lm_m2", "glazing"}};
inline constexpr SceneObjectKeys glazing{
    "glazing",
    {},
    {"normal_transmittance", "internal_transmittance", "transmissivity", "spectral_transmittance",
     "angular_transmittance", "panes", "angular_law", "refractive_index", "spectral_reflectance",
     "inner_reflectance", "maintenance", "frame"}};
inline constexpr SceneObjectKeys spectrum_file{"spectrum_file", {"file"}, {"column"}};
inline constexpr SceneObjectKeys light_colour{"light_colour", {}, {"cct_k", "xy"}};
inline constexpr SceneObjectKeys custom_primaries{"custom_primaries", {"red", "green", "blue"}, {}};
inline constexpr SceneObjectKeys ground{"ground", {}, {"z", "reflectance", "shadows"}};
inline constexpr SceneObjectKeys outdoors{"outdoors", {}, {"interreflections"}};
inline constexpr SceneObjectKeys ground_colour{"ground_colour", {"xyY"}, {}};
inline constexpr SceneObjectKeys polyhedron{
    "polyhedron", {"id", "kind", "effect", "vertices", "material"}, {"glazing", "faces"}};
inline constexpr SceneObjectKeys polygon{
    "polygon", {"id", "vertices", "material"}, {"holes", "side", "two_sided"}};
inline constexpr SceneObjectKeys aperture{"aperture", {"id", "vertices"}, {"holes", "material"}};
inline constexpr SceneObjectKeys sky{
    "sky",
    {"model"},
    {"zenith_luminance_cd_m2", "horizontal_illuminance_lx", "turbidity", "highest_sun_deg",
     "direct_normal_irradiance_w_m2", "diffuse_horizontal_irradiance_w_m2", "direct_normal_illuminance_lx",
     "diffuse_horizontal_illuminance_lx", "dew_point_c", "day_of_year", "normalisation", "table", "luminance", "colour"}};
inline constexpr SceneObjectKeys sky_table{
    "sky_table", {"subdivision"}, {"values", "file", "altitudes_deg", "interpolation"}};
inline constexpr SceneObjectKeys sun{
    "sun", {}, {"altitude_deg", "azimuth_deg", "date", "time", "summer_time", "refraction",
                "direct_normal_illuminance_lx", "colour"}};
/// Part of a scene: what `naturel sky MODEL` makes of its options.
inline constexpr SceneObjectKeys sky_and_sun{"sky_and_sun", {"sky"}, {"site", "sun"}};
inline constexpr SceneObjectKeys grid{
    "grid", {}, {"spacing_m", "outdoor_spacing_m", "zones", "sliver_area", "sliver_aspect", "refine"}};
inline constexpr SceneObjectKeys refine{"refine", {"levels"}, {"contrast"}};
inline constexpr SceneObjectKeys direct{"direct", {}, {"method", "tolerance"}};
inline constexpr SceneObjectKeys sensor{"sensor", {"id"}, {"grid", "points"}};
inline constexpr SceneObjectKeys sensor_grid{"sensor_grid", {}, {"z", "spacing_m", "margin_m"}};
inline constexpr SceneObjectKeys view{
    "view",
    {"id"},
    {"kind", "from", "to", "up", "fov_deg", "projection", "width_m", "z", "line", "width", "height", "cut_planes", "see_through",
     "samples", "quality", "picture"}};
inline constexpr SceneObjectKeys cut_plane{"cut_plane", {"point", "normal"}, {}};
inline constexpr SceneObjectKeys picture{"picture", {}, {"exposure", "tone_mapping", "white_point"}};
inline constexpr SceneObjectKeys exposure{"exposure", {}, {"white_cd_m2", "ev100", "percentile"}};

inline constexpr std::array all{scene,      site,    material,    glazing, ground, ground_colour, outdoors,
                                polyhedron, polygon, aperture,    sky,     sky_table, sun,    grid,   refine,
                                direct,     sensor,  sensor_grid, view,    cut_plane, spectrum_file, light_colour,
                                custom_primaries, picture, exposure};

}  // namespace scene_keys
}  // namespace naturel
