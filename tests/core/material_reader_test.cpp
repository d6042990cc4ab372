#include "core/material_reader.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/errors.h"
#include "core/glazing.h"
#include "core/scene_reader.h"
#include "core/units.h"
#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
namespace fs = std::filesystem;

namespace {

/// A folder that goes away with its files.
class Folder {
public:
    Folder() : path_(fs::temp_directory_path() / fs::path("naturel_material_reader_test")) {
        fs::remove_all(path_);
        fs::create_directories(path_);
    }
    ~Folder() { fs::remove_all(path_); }
    void write(const std::string& name, const std::string& text) const { std::ofstream(path_ / name, std::ios::binary) << text; }
    std::string scene_file() const { return (path_ / "t.json").string(); }
    std::string file(const std::string& name) const { return (path_ / name).string(); }

private:
    fs::path path_;
};

std::string scene_text(const std::string& materials, const std::string& members = {}) {
    return R"({"naturel": 1, "materials": {"wall": {"reflectance": 0.5}, )" + materials + R"(}, )" + members + R"(
        "polyhedra": [{"id": "box", "kind": "parallelepiped", "effect": "fill", "material": "wall",
                       "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}],
        "sky": {"model": "uniform", "horizontal_illuminance_lx": 10000}})";
}

Scene read(const std::string& materials, const std::string& members = {}) {
    return read_scene_text(scene_text(materials, members), "t.json");
}

std::string complaint(const std::string& materials, const std::string& file_name = "t.json") {
    try {
        read_scene_text(scene_text(materials), file_name);
    } catch (const InputError& fault) {
        return fault.what();
    }
    return {};
}

bool says(const std::string& text, std::string_view part) {
    UNSCOPED_INFO(text);
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("transmissivity is Radiance's: 0.958415 makes 88 %", "[reader][glazing]") {
    for (const std::string key : {"transmissivity", "internal_transmittance"}) {
        const Scene s = read(R"("g": {"glazing": {")" + key + R"(": 0.958415}})");
        CHECK_THAT(s.glazings[1].normal_transmittance.g, WithinAbs(0.88, 0.5e-6));
    }
    const Scene two = read(R"("g": {"glazing": {"internal_transmittance": 0.958415, "panes": 2, "refractive_index": 1.6}})");
    CHECK_THAT(two.glazings[1].normal_transmittance.g,
               WithinAbs(multi_pane_transmittance(1.0, 0.958415, 2, 1.6), 1e-15));
}

TEST_CASE("panes get the diffuse reflectance of clear glass unless the scene gives one", "[reader][glazing]") {
    const Scene s = read(R"("single": {"glazing": {"normal_transmittance": 0.88}},
        "framed": {"glazing": {"normal_transmittance": 0.88, "frame": 0.5}},
        "given": {"glazing": {"normal_transmittance": 0.88, "inner_reflectance": 0.03}},
        "hole": {"glazing": {"normal_transmittance": 0.88, "angular_law": "constant"}},
        "shut": {"glazing": {"normal_transmittance": 0}})");
    CHECK_THAT(s.glazings[1].inner_reflectance.g, WithinAbs(0.148, 0.51e-3));
    CHECK_THAT(s.glazings[2].inner_reflectance.g, WithinAbs(0.5 * s.glazings[1].inner_reflectance.g, 1e-15));
    CHECK(s.glazings[3].inner_reflectance == grey(0.03));
    CHECK(s.glazings[4].inner_reflectance == grey(0.0));
    CHECK(GlazingTransmission(s.glazings[5]).diffuse_transmittance() == grey(0.0));
    CHECK(s.glazings[5].inner_reflectance.g < 0.1);  // the front face of black glass
}

TEST_CASE("a table of angles goes to nothing at 90 degrees by itself", "[reader][glazing]") {
    const Scene s = read(R"("g": {"glazing": {"angular_transmittance": [[0, 0.8], [40, [0.8, 0.7, 0.6]], [80, 0.4]]}})");
    const Glazing& g = s.glazings[1];
    CHECK(g.angular_law == AngularLaw::table);
    REQUIRE(g.angular_table.size() == 4);
    CHECK(g.angular_table[3].transmittance == grey(0.0));
    CHECK(g.normal_transmittance == grey(0.8));
    const GlazingTransmission transmission(g);
    CHECK_THAT(transmission.transmittance(std::cos(radians_from_degrees(40))).b, WithinAbs(0.6, 1e-5));
    CHECK(transmission.transmittance(0.0).g == 0.0);
}

TEST_CASE("a spectrum is read inline and from a column beside the scene alike", "[reader][colour]") {
    const Folder folder;
    folder.write("glass.csv", "\xef\xbb\xbf# measured\nwavelength_nm;clear;amber\r\n380; 0.9 ;0.05\r\n550;0.9;0.7\r\n\r\n780;0.8;0.9\r\n");
    const auto read_beside = [&](const std::string& materials) {
        return read_scene_text(scene_text(materials, R"("primaries": "srgb",)"), folder.scene_file());
    };
    const Scene s = read_beside(R"("a": {"glazing": {"spectral_transmittance": {"file": "glass.csv", "column": "amber"}}},
        "b": {"glazing": {"spectral_transmittance": [[380, 0.05], [550, 0.7], [780, 0.9]]}},
        "c": {"spectral_reflectance": {"file": "glass.csv", "column": "amber"}})");
    CHECK(s.glazings[1].normal_transmittance == s.glazings[2].normal_transmittance);
    CHECK(s.materials[1].reflectance == s.glazings[1].normal_transmittance);
    CHECK(s.glazings[1].normal_transmittance.r > s.glazings[1].normal_transmittance.b);

    // What a file says is part of what identifies the scene.
    folder.write("glass.csv", "380 ,0.05\n780,0.9\n");
    const std::string two_columns = R"("c": {"spectral_reflectance": {"file": "glass.csv"}})";
    const std::string before = read_beside(two_columns).source_sha256;
    folder.write("glass.csv", "380,0.06\n780,0.9\n");
    CHECK(read_beside(two_columns).source_sha256 != before);
}

TEST_CASE("a fault in a spectrum's file is told with its line and column", "[reader][colour]") {
    const Folder folder;
    const auto complaint_about = [&](const std::string& csv, const std::string& column = "t") {
        folder.write("s.csv", csv);
        return complaint(R"("m": {"spectral_reflectance": {"file": "s.csv", "column": ")" + column + R"("}})",
                         folder.scene_file());
    };
    const std::string at = folder.file("s.csv");
    CHECK(says(complaint_about("nm,t\n380,0.5\n390,\n780,0.5\n"), at + ":3:5: the cell is empty (0 to 1 would be right)"));
    CHECK(says(complaint_about("nm,t\n380,0.5\n390, n/a\n"), at + ":3:6: \"n/a\" is not a number (0 to 1 would be right)"));
    CHECK(says(complaint_about("nm,t\n380,0.5\n390,85\n"), at + ":3:5: 85 is out of range (0 to 1 would be right)"));
    CHECK(says(complaint_about("nm,t\n380,0.5\n390,nan\n"), at + ":3:5: \"nan\" is not a number"));
    CHECK(says(complaint_about("nm,t\n390,0.5\n380,0.5\n"), at + ":3:1: the wavelength 380 nm does not follow 390 nm"));
    CHECK(says(complaint_about("nm,t\n380,0.5\n390\n"), at + ":3:1: the line has 1 cells (2 as in the first line would be right)"));
    CHECK(says(complaint_about("nm,t\n450,0.5\n780,0.5\n"), "the spectrum reaches from 450 to 780 nm (it must cover 400 to 700 nm)"));
    CHECK(says(complaint_about("nm,t\n380,0.5\n780,0.5\n", "tt"), "there is no column \"tt\" in \"s.csv\" (known: \"t\")"));
    CHECK(says(complaint_about(""), "the spectrum is empty"));
    CHECK(says(complaint(R"("m": {"spectral_reflectance": {"file": "none.csv"}})", folder.scene_file()),
               "/materials/m/spectral_reflectance/file: there is no file \"none.csv\""));
    CHECK(says(complaint(R"("m": {"spectral_reflectance": {"file": "."}})", folder.scene_file()), "is not a plain file"));
}

TEST_CASE("custom primaries and the colours of sky and sun are read", "[reader][colour]") {
    const Scene s = read(R"("m": {"xyY": [0.40, 0.36, 0.30]})",
                         R"("primaries": {"red": [0.64, 0.33], "green": [0.30, 0.60], "blue": [0.15, 0.06]},
                            "sun": {"altitude_deg": 30, "azimuth_deg": 0, "colour": {"cct_k": 5000}},)");
    CHECK(s.primaries.name == PrimariesName::custom);
    CHECK(s.sky.colour.band == grey(1.0));
    CHECK(s.sun->colour.band.r > s.sun->colour.band.b);
    const Primaries primaries(s.primaries);
    const glm::dvec3 xyY = xyY_from_xyz(primaries.xyz(s.sun->colour.band));
    const Chromaticity locus = daylight_chromaticity(5000.0);
    CHECK_THAT(xyY.x, WithinAbs(locus.x, 1e-9));
    CHECK_THAT(xyY.y, WithinAbs(locus.y, 1e-9));
}

TEST_CASE("pictures take the options of their view before those of the scene", "[reader][picture]") {
    const Scene s = read(R"("m": {"reflectance": 0.5})", R"("picture": {"exposure": {"ev100": 10}, "tone_mapping": "reinhard"},
        "views": [{"id": "a", "from": [0, 0, 1], "to": [1, 0, 1]},
                  {"id": "b", "from": [0, 0, 1], "to": [1, 0, 1], "picture": {"exposure": "auto", "white_point": "sky"}}],)");
    CHECK(s.views[0].picture.exposure.mode == ExposureMode::ev100);
    CHECK(s.views[0].picture.exposure.value == 10);
    CHECK(s.views[0].picture.tone_mapping == ToneMapping::reinhard);
    CHECK(s.views[0].picture.white_point == WhitePoint::d65);
    CHECK(s.views[1].picture.exposure.mode == ExposureMode::automatic);
    CHECK(s.views[1].picture.tone_mapping == ToneMapping::reinhard);
    CHECK(s.views[1].picture.white_point == WhitePoint::sky);
}
