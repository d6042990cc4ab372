#include "core/scene_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "core/building.h"
#include "core/colour.h"
#include "core/errors.h"
#include "core/json_document.h"
#include "core/scene_keys.h"
#include "core/sha256.h"
#include "core/sun.h"
#include "core/units.h"
#include "tests/catch.h"

using namespace naturel;
namespace fs = std::filesystem;

namespace {

const fs::path source_dir = NATUREL_SOURCE_DIR;

std::string file_text(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    REQUIRE(stream);
    return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<fs::path> json_files(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() == ".json") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// What the reader says against a text; empty if it accepts it. Anything but InputError ends the test.
std::string complaint(std::string_view text) {
    try {
        read_scene_text(text, "t.json");
    } catch (const InputError& fault) {
        return fault.what();
    }
    return {};
}

bool says(const std::string& text, std::string_view part) {
    UNSCOPED_INFO(text);
    return text.find(part) != std::string::npos;
}

/// A small valid scene; members: more top-level members, each ended by a comma.
std::string scene_with(const std::string& members) {
    return R"({"naturel": 1, "materials": {"wall": {"reflectance": 0.5}}, )" + members + R"(
        "polyhedra": [{"id": "box", "kind": "parallelepiped", "effect": "fill", "material": "wall",
                       "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}],
        "sky": {"model": "uniform", "horizontal_illuminance_lx": 10000}})";
}

std::string polygon_scene(const std::string& vertices) {
    return R"({"naturel": 1, "materials": {"wall": {"reflectance": 0.5}}, "sky": {"model": "uniform", "zenith_luminance_cd_m2": 1},
        "polygons": [{"id": "p", "material": "wall", "vertices": [)" +
           vertices + "]}]}";
}

/// Every key of the format, each with a value that differs from the default. Longer than a line: it is one
/// text.
const char* const full_scene = R"(
// a comment
{
  "$schema": "scene.schema.json", "naturel": 1, "name": "everything", "description": "each key once",
  "site": {"latitude_deg": 47.2, "longitude_deg": -1.6, "time_zone_h": 1, "north_deg": 30},
  "materials": {
    "glass": {"glazing": {"normal_transmittance": [0.5, 0.6, 0.7], "panes": 3, "angular_law": "rivero",
                          "inner_reflectance": 0.2, "maintenance": 0.9, "frame": 0.8}},
    "lamp": {"reflectance": 0.8, "exitance_lm_m2": [100, 200, 300]},
    "band": {"rgb": [0.1, 0.2, 0.3]}, /* a glazing between surfaces */
    "plastic": {"glazing": {"normal_transmittance": 0.4, "angular_law": "constant"}},
    "leaf": {"xyY": [0.35, 0.45, 0.25]}
  },
  "ground": {"z": -1.5, "reflectance": {"xyY": [0.34, 0.36, 0.3]}},
  "polyhedra": [
    {"id": "box", "kind": "parallelepiped", "effect": "carve", "vertices": [[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]],
     "material": "band", "glazing": "glass",
     "faces": {"bottom": "lamp", "6": ["unglazed", "leaf"], "top": "plastic"}},
    {"id": "wedge", "kind": "prism", "effect": "fill", "vertices": [[5, 0, 0], [7, 0, 0], [5, 3, 0], [5, 0, 4]],
     "material": "leaf", "faces": {"slope": "band"}},
    {"id": "tip", "kind": "tetrahedron", "effect": "fill", "vertices": [[9, 0, 0], [10, 0, 0], [9, 1, 0], [9, 0, 1]],
     "material": "lamp"}
  ],
  "polygons": [
    {"id": "screen", "vertices": [[0, -5, 0], [4, -5, 0], [4, -5, 3], [0, -5, 3]],
     "holes": [[[1, -5, 1], [2, -5, 1], [2, -5, 2]]], "material": "lamp", "side": "outdoor", "two_sided": true}
  ],
  "apertures": [
    {"id": "pane", "vertices": [[0, -6, 0], [4, -6, 0], [4, -6, 3], [0, -6, 3]],
     "holes": [[[1, -6, 1], [2, -6, 1], [2, -6, 2]]], "material": "plastic"},
    {"id": "opening", "vertices": [[0, -7, 0], [4, -7, 0], [4, -7, 3]]}
  ],
  "sky": {"model": "cie_clear_polluted", "zenith_luminance_cd_m2": 4000},
  "sun": {"altitude_deg": 40, "azimuth_deg": 180, "direct_normal_illuminance_lx": 80000},
  "grid": {"spacing_m": 0.3, "outdoor_spacing_m": 2},
  "direct": {"method": "article", "tolerance": 0.01},
  "primaries": "srgb",
  "sensors": [
    {"id": "plane", "grid": {"z": 0.8, "spacing_m": 0.4, "margin_m": 0.1}},
    {"id": "eye", "points": [[1, 1, 1.2, 0, -2, 0], [1, 2, 1.2]]}
  ],
  "views": [
    {"id": "down", "kind": "perspective", "from": [1, 1, 3], "to": [1, 1, 0], "up": [0, 2, 0], "fov_deg": 90, "width": 640, "height": 480},
    {"id": "plan", "kind": "parallel", "from": [1, 1, 3], "to": [1, 1, 0], "up": [0, 2, 0], "width_m": 4.5}
  ]
})";

}  // namespace

TEST_CASE("the reader says of each broken scene what is wrong, where, and what would be right", "[reader]") {
    const fs::path folder = source_dir / "tests/data/broken";
    std::istringstream list(file_text(folder / "expected.txt"));
    std::set<std::string> listed;
    for (std::string line; std::getline(list, line);) {
        if (line.starts_with('#')) continue;
        std::istringstream fields(line);
        std::string name, exit_code, message;
        fields >> name >> exit_code >> std::ws;
        std::getline(fields, message);
        listed.insert(name);
        INFO(name);
        CHECK(exit_code == "3");
        try {
            read_scene(folder / name);
            FAIL("was accepted");
        } catch (const InputError& fault) {
            const std::string text = fault.what();
            const std::string directory = folder.string() + "/";
            REQUIRE(text.starts_with(directory));
            CHECK(text.substr(directory.size()) == message);
        }
    }
    for (const fs::path& file : json_files(folder)) {
        INFO(file.filename() << " is in the folder but not in expected.txt");
        CHECK(listed.contains(file.filename().string()));
    }
    CHECK(listed.size() >= 45);
}

TEST_CASE("what is not a readable scene file is refused by its name", "[reader]") {
    CHECK_THROWS_WITH(read_scene("no/such/room.json"),
                      "no/such/room.json: there is no such scene file (check the path)");
    CHECK_THROWS_WITH(read_scene(source_dir), source_dir.string() + ": this is a directory (a scene file is needed)");
    const std::string large(JsonDocument::max_bytes + 1, ' ');
    CHECK(complaint(large) == "t.json: the file is too large (at most 67108864 bytes are read)");
}

TEST_CASE("every key of a scene file arrives in the scene", "[reader]") {
    const Scene s = read_scene_text(full_scene, "full.json");

    CHECK(s.name == "everything");
    CHECK(s.north_rad == radians_from_degrees(30));
    CHECK(s.primaries.name == PrimariesName::srgb);
    const Primaries primaries(PrimariesName::srgb);

    REQUIRE(s.materials.size() == 3);
    CHECK(s.materials[0].name == "lamp");
    CHECK(s.materials[0].reflectance == grey(0.8));
    CHECK(s.materials[0].exitance_lm_m2 == Band3{100, 200, 300});
    CHECK(s.materials[1].reflectance == Band3{0.1, 0.2, 0.3});
    CHECK(s.materials[1].exitance_lm_m2 == Band3{});
    CHECK(s.materials[2].name == "leaf");
    CHECK(s.materials[2].reflectance == reflectance_from_xyY(primaries, 0.35, 0.45, 0.25, 0.99).band);

    REQUIRE(s.glazings.size() == 3);
    CHECK(s.glazings[0].name == "unglazed");
    CHECK(s.glazings[0].normal_transmittance == grey(1));
    CHECK(s.glazings[0].angular_law == AngularLaw::constant);
    CHECK(s.glazings[1].name == "glass");
    CHECK(s.glazings[1].normal_transmittance == Band3{0.5, 0.6, 0.7});
    CHECK(s.glazings[1].panes == 3);
    CHECK(s.glazings[1].angular_law == AngularLaw::rivero);
    CHECK(s.glazings[1].inner_reflectance == grey(0.2));
    CHECK(s.glazings[1].maintenance == 0.9);
    CHECK(s.glazings[1].frame == 0.8);
    CHECK(s.glazings[2].angular_law == AngularLaw::constant);

    CHECK(s.ground.z_m == -1.5);
    CHECK(s.ground.reflectance == reflectance_from_xyY(primaries, 0.34, 0.36, 0.3, 0.99).band);

    REQUIRE(s.polyhedra.size() == 3);
    const Polyhedron& box = s.polyhedra[0];
    CHECK(box.id == "box");
    CHECK(box.kind == PolyhedronKind::parallelepiped);
    CHECK(box.effect == Effect::carve);
    CHECK(box.vertices_m[3] == glm::dvec3(0, 0, 4));
    CHECK(box.material == MaterialId{1});
    CHECK(box.glazing == GlazingId{1});
    CHECK(box.faces[0].material == MaterialId{0});
    CHECK(box.faces[0].glazing == std::nullopt);
    CHECK(box.faces[1].glazing == GlazingId{2});
    CHECK(box.faces[2].material == std::nullopt);
    CHECK(box.faces[5].material == MaterialId{2});
    CHECK(box.faces[5].glazing == GlazingId{0});
    CHECK(s.polyhedra[1].kind == PolyhedronKind::prism);
    CHECK(s.polyhedra[1].effect == Effect::fill);
    CHECK(s.polyhedra[1].faces[4].material == MaterialId{1});
    CHECK(s.polyhedra[1].glazing == std::nullopt);
    CHECK(s.polyhedra[2].kind == PolyhedronKind::tetrahedron);

    REQUIRE(s.polygons.size() == 1);
    CHECK(s.polygons[0].vertices_m.size() == 4);
    REQUIRE(s.polygons[0].holes_m.size() == 1);
    CHECK(s.polygons[0].holes_m[0][2] == glm::dvec3(2, -5, 2));
    CHECK(s.polygons[0].side == Environment::outdoor);
    CHECK(s.polygons[0].two_sided);
    REQUIRE(s.apertures.size() == 2);
    CHECK(s.apertures[0].glazing == GlazingId{2});
    CHECK(s.apertures[0].holes_m.size() == 1);
    CHECK(s.apertures[1].glazing == GlazingId{0});

    CHECK(s.sky.model == SkyModel::cie_clear_polluted);
    CHECK(s.sky.zenith_luminance_cd_m2 == 4000.0);
    CHECK(s.sky.horizontal_illuminance_lx == std::nullopt);
    REQUIRE(s.sun);
    CHECK(s.sun->altitude_rad == radians_from_degrees(40));
    CHECK(std::abs(s.sun->azimuth_rad - radians_from_degrees(150)) < 1e-15);  // world 180, north 30; rounding
    CHECK(s.sun->direct_normal_illuminance_lx == 80000);

    CHECK(s.grid.spacing_m == 0.3);
    CHECK(s.grid.outdoor_spacing_m == 2);
    CHECK(s.direct.method == DirectMethod::article);
    CHECK(s.direct.tolerance == 0.01);

    REQUIRE(s.sensors.size() == 2);
    REQUIRE(s.sensors[0].grid);
    CHECK(s.sensors[0].grid->z_m == 0.8);
    CHECK(s.sensors[0].grid->spacing_m == 0.4);
    CHECK(s.sensors[0].grid->margin_m == 0.1);
    CHECK(!s.sensors[1].grid);
    REQUIRE(s.sensors[1].points.size() == 2);
    CHECK(s.sensors[1].points[0].normal == glm::dvec3(0, -1, 0));
    CHECK(s.sensors[1].points[1].normal == glm::dvec3(0, 0, 1));

    REQUIRE(s.views.size() == 2);
    CHECK(s.views[0].id == "down");
    CHECK(s.views[0].up == glm::dvec3(0, 1, 0));
    CHECK(s.views[0].field_of_view_rad == radians_from_degrees(90));
    CHECK(s.views[0].width == 640);
    CHECK(s.views[0].height == 480);
    CHECK(s.views[0].kind == ViewKind::perspective);
    CHECK(s.views[1].kind == ViewKind::parallel);
    CHECK(s.views[1].width_m == 4.5);
    CHECK(s.source_sha256 == sha256_hex(full_scene));
}

TEST_CASE("what a scene file leaves out takes the defaults of the documentation", "[reader]") {
    const Scene s = read_scene_text(scene_with(R"("sensors": [{"id": "s", "grid": {}}],
        "views": [{"id": "v", "from": [0, 0, 1], "to": [1, 0, 1]}],)"),
                                    "folder/small room.json");
    CHECK(s.name == "small room");
    CHECK(s.north_rad == 0);
    CHECK(s.ground.z_m == 0);
    CHECK(s.ground.reflectance == grey(0.2));
    CHECK(!s.sun);
    CHECK(s.grid.spacing_m == 0.25);
    CHECK(s.grid.outdoor_spacing_m == 1);
    CHECK(s.direct.method == DirectMethod::adaptive);
    CHECK(s.direct.tolerance == 1e-3);
    CHECK(s.primaries.name == PrimariesName::ebu);
    CHECK(s.sensors[0].grid->z_m == 0.85);
    CHECK(s.sensors[0].grid->spacing_m == 0.5);
    CHECK(s.sensors[0].grid->margin_m == 0.5);
    CHECK(s.views[0].up == glm::dvec3(0, 0, 1));
    CHECK(s.views[0].field_of_view_rad == radians_from_degrees(70));
    CHECK(s.views[0].width == 1280);
    CHECK(s.views[0].height == 960);
}

TEST_CASE("a date and a time put the sun where sun_position finds it, turned into the model",
          "[reader][sun]") {
    const Scene s = read_scene_text(
        scene_with(
            R"("site": {"latitude_deg": 39.742476, "longitude_deg": -105.1786, "time_zone_h": -7, "north_deg": 200},
                      "sun": {"date": "2003-10-17", "time": "12:30:30", "direct_normal_illuminance_lx": 1},)"),
        "t.json");
    // NREL's SPA example: altitude 39.872046, azimuth 194.340241 degrees; the method is good to 0.0123
    // degrees.
    CHECK(std::abs(degrees_from_radians(s.sun->altitude_rad) - 39.872046) < 0.0123);
    CHECK(std::abs(degrees_from_radians(s.sun->azimuth_rad) - (194.340241 - 200 + 360)) < 0.0123);

    const Scene whole_minutes = read_scene_text(
        scene_with(R"("site": {"latitude_deg": 39.742476, "longitude_deg": -105.1786, "time_zone_h": -7},
                      "sun": {"date": "2003-10-17", "time": "12:30"},)"),
        "t.json");
    CHECK(whole_minutes.sun->altitude_rad > s.sun->altitude_rad);
}

TEST_CASE("a sun below the horizon keeps the illuminance it was given", "[reader][sun]") {
    const Scene s = read_scene_text(
        scene_with(R"("sun": {"altitude_deg": -1, "azimuth_deg": -90, "direct_normal_illuminance_lx": 5},)"),
        "t.json");
    CHECK(s.sun->direct_normal_illuminance_lx == 5);  // core/outdoors.h decides that it sends no light
    CHECK(s.sun->azimuth_rad == radians_from_degrees(270));
}

TEST_CASE("a material remembers how far its colour was drawn towards grey", "[reader][colour]") {
    // The cyan of the Macbeth chart leaves the sRGB primaries: docs/method.md, (Colour 5).
    std::string text = scene_with(R"("primaries": "srgb",)");
    const std::string grey_wall = R"("wall": {"reflectance": 0.5})";
    text.replace(text.find(grey_wall), grey_wall.size(), grey_wall + R"(, "cyan": {"xyY": [0.2, 0.27, 0.19]})");
    const Scene s = read_scene_text(text, "t.json");
    CHECK(s.materials[0].desaturation.saturation_kept == 1.0);
    CHECK(s.materials[0].desaturation.chromaticity_shift == 0.0);
    const Desaturation& cyan = s.materials[1].desaturation;
    CHECK(cyan.saturation_kept < 1.0);
    CHECK(cyan.saturation_kept > 0.5);
    // On the way to white, as long as the colour is kept apart from it: at most the part that was given up.
    const double to_white = std::hypot(0.2 - 0.3127, 0.27 - 0.3290);
    CHECK(cyan.chromaticity_shift > 0.0);
    CHECK(cyan.chromaticity_shift < (1.0 - cyan.saturation_kept) * 1.5 * to_white);
    const Primaries srgb(PrimariesName::srgb);
    const glm::dvec3 shown = xyY_from_xyz(srgb.xyz(s.materials[1].reflectance));
    CHECK(std::abs(std::hypot(shown.x - 0.2, shown.y - 0.27) - cyan.chromaticity_shift) < 1e-12);
}

TEST_CASE("a polygon may have as many vertices as documented, and no more", "[reader]") {
    const auto round = [](int n) {
        std::string text;
        for (int i = 0; i < n; ++i) {
            const double angle = 2 * pi * i / n;
            text += (i ? "," : "") + ("[" + std::to_string(std::cos(angle) * 5) + "," +
                                      std::to_string(std::sin(angle) * 5) + ",0]");
        }
        return text;
    };
    CHECK(complaint(polygon_scene(round(2000))).empty());
    CHECK(says(complaint(polygon_scene(round(2001))), "2001 vertices with the holes (at most 2000"));
}

TEST_CASE("a polygon may be off its plane by a millionth of its size", "[reader]") {
    // Lifting one of four corners of a square by h takes each corner h/4 off the best plane; the size is its
    // diagonal.
    const auto lifted = [](double h) {
        return polygon_scene("[0,0,0],[100,0,0],[100,100," + std::to_string(h) + "],[0,100,0]");
    };
    CHECK(complaint(lifted(4 * 140e-6)).empty());
    CHECK_FALSE(complaint(lifted(4 * 145e-6)).empty());
}

TEST_CASE("a hostile file is refused without delay", "[reader]") {
    std::string many_keys = "{";
    for (int i = 0; i < 100000; ++i)
        many_keys += "\"k" + std::to_string(i) + "\":0,";
    CHECK(says(complaint(many_keys + "\"k7\":0}"), "/k7: this key is already in the object"));
    CHECK(says(complaint(std::string(1000000, '[')), "nested too deep"));
    CHECK(says(complaint("{\"" + std::string(1000000, 'a') + "\": 1}"), "unknown key \"aaaa"));
    CHECK(says(complaint("{\"a\": " + std::string(100000, '9') + "}"), "too large to be read"));
    CHECK(complaint("{\"a\": " + std::string(100000, '9') + "}").size() < 300);
}

TEST_CASE("the JSON schema knows the same keys as the reader", "[reader]") {
    const JsonDocument schema(file_text(source_dir / "docs/scene.schema.json"), "scene.schema.json");
    const auto member = [](const JsonValue& object, std::string_view key) -> std::optional<JsonValue> {
        for (const JsonMember& m : object.members()) {
            if (m.key.text() == key) return m.value;
        }
        return std::nullopt;
    };
    const JsonValue definitions = *member(schema.root(), "$defs");
    std::set<std::string> objects_of_reader;
    for (const SceneObjectKeys& keys : scene_keys::all) {
        INFO(keys.name);
        objects_of_reader.emplace(keys.name);
        const auto definition = keys.name == "scene" ? schema.root() : member(definitions, keys.name);
        REQUIRE(definition);
        std::set<std::string_view> known(keys.required.begin(), keys.required.end()), described, required;
        for (const JsonMember& m : member(*definition, "properties")->members())
            described.insert(m.key.text());
        if (const auto list = member(*definition, "required")) {
            for (const JsonValue& key : list->items())
                required.insert(key.text());
        }
        known.erase("");
        CHECK(required == known);
        known.insert(keys.optional.begin(), keys.optional.end());
        known.erase("");
        CHECK(described == known);
        REQUIRE(member(*definition, "additionalProperties"));
        CHECK_FALSE(member(*definition, "additionalProperties")->boolean());
    }
    for (const JsonMember& definition : definitions.members()) {
        if (!member(definition.value, "properties")) continue;
        INFO(definition.key.text());
        CHECK(objects_of_reader.contains(definition.key.text()));
    }
}

TEST_CASE("the format's description names every key of the reader", "[reader]") {
    const std::string text = file_text(source_dir / "docs/scene_format.md");
    for (const SceneObjectKeys& keys : scene_keys::all) {
        for (const auto& list : {std::vector(keys.required.begin(), keys.required.end()),
                                 std::vector(keys.optional.begin(), keys.optional.end())}) {
            for (const std::string_view key : list) {
                INFO(keys.name << "." << key);
                CHECK((key.empty() || text.find("`" + std::string(key) + "`") != std::string::npos));
            }
        }
    }
}

TEST_CASE("the shipped scenes assemble to the rooms that scenes/README.md describes", "[reader][assembly]") {
    struct Expected {
        double volume_m3;
        std::map<std::string, double> apertures_m2;
    };
    // Room + reveals. The L: two boxes, the attic 0.5 x 4 x 1.4 x 8, reveals 0.65 + 0.6, roof window 2 x 1 x
    // 0.3. The office: the room and reveals without pillar, desk and cupboard.
    const std::map<std::string, Expected> expected{
        {"test_room.json", {56 + 0.48, {{"window", 2.4}}}},
        {"colour_chart.json", {16.8 - 24 * 0.2 * 0.2 * 0.01, {}}},
        {"test_room_coloured.json", {56 + 0.48, {{"window", 2.4}}}},
        {"furnished_office.json",
         {84 + 2 * 0.72 - 0.448 - 0.0512 - 2 * 0.02272 - 1.512,
          {{"west window", 2.4}, {"east window", 2.4}}}},
        {"l_shaped_rooflight.json",
         {83.2 + 52 + 22.4 + 0.65 + 0.6 + 0.6,
          {{"south window", 2.6}, {"court window", 2.4}, {"roof window", 2 * std::sqrt(1.49)}}}}};
    const std::vector<fs::path> files = json_files(source_dir / "scenes");
    CHECK(files.size() == expected.size());
    for (const fs::path& file : files) {
        INFO(file.filename());
        const Expected& right = expected.at(file.filename().string());
        const Scene scene = read_scene(file);
        const Building building = assemble(scene);
        // Outlines are rounded to 1 nm: some 100 m of edges move by 1 nm.
        CHECK(std::abs(building.indoor_air_volume_m3 - right.volume_m3) < 1e-6);
        std::map<std::string, double> apertures;
        for (const Aperture& aperture : building.apertures)
            apertures[aperture.name] += aperture.area_m2;
        REQUIRE(apertures.size() == right.apertures_m2.size());
        for (const auto& [name, area] : right.apertures_m2)
            CHECK(std::abs(apertures[name] - area) < 1e-6);
        CHECK_FALSE(scene.sensors.empty());
        for (const View& view : scene.views)
            CHECK((!view.cut_planes.empty() || medium_at(scene, view.from_m) == Medium::indoor_air));
        for (const SensorSet& set : scene.sensors) {
            for (const SensorPoint& p : set.points)
                CHECK(medium_at(scene, p.position_m) == Medium::indoor_air);
        }
    }
}

TEST_CASE("a scene cut short anywhere is refused", "[reader]") {
    for (const fs::path& file : json_files(source_dir / "scenes")) {
        std::string text = file_text(file);
        while (text.back() != '}')
            text.pop_back();
        for (std::size_t length = 0; length < text.size(); length += 7) {
            INFO(file.filename() << " cut after " << length << " bytes");
            CHECK_THAT(complaint(std::string_view(text).substr(0, length)),
                       Catch::Matchers::StartsWith("t.json:"));
        }
    }
}

TEST_CASE("whatever bytes change in a scene, the reader accepts it or says why not", "[reader]") {
    // splitmix64 (Vigna 2015) as a counter-based hash.
    const auto hash = [](std::uint64_t n) {
        n += 0x9e3779b97f4a7c15u;
        n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9u;
        n = (n ^ (n >> 27)) * 0x94d049bb133111ebu;
        return n ^ (n >> 31);
    };
    constexpr std::string_view likely = "{}[]\",:-0123456789eE.+/*\\ \n\tnull";
    constexpr std::uint64_t mutations = 2000;
    std::uint64_t counter = 0, accepted = 0;
    for (const fs::path& file : json_files(source_dir / "scenes")) {
        const std::string original = file_text(file);
        for (std::uint64_t m = 0; m < mutations; ++m) {
            std::string text = original;
            for (std::uint64_t changes = 1 + hash(counter++) % 3; changes > 0; --changes) {
                const std::size_t at = hash(counter++) % text.size();
                const std::uint64_t random = hash(counter++);
                const char any = static_cast<char>(random & 0xff),
                           usual = likely[(random >> 8) % likely.size()];
                switch (random >> 61) {
                    case 0:
                        text[at] = any;
                        break;
                    case 1:
                        text.erase(at, 1 + (random >> 16) % 8);
                        break;
                    case 2:
                        text.insert(at, 1, usual);
                        break;
                    case 3:
                        text.insert(at, text.substr((random >> 16) % text.size(), 20));
                        break;
                    default:
                        text[at] = usual;
                }
            }
            INFO(file.filename() << ", mutation " << m);
            accepted += complaint(text).empty();  // throws on, and so fails, if it is not an InputError
        }
    }
    // Digits and comments change often, so some must still be scenes; most must not.
    CHECK(accepted > mutations / 10);
    CHECK(accepted < 4 * mutations / 2);
}

TEST_CASE("SHA-256 gives the digests of FIPS 180-4", "[reader]") {
    CHECK(sha256_hex("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
          "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    CHECK(sha256_hex(std::string(1000000, 'a')) ==
          "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}
