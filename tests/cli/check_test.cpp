#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

struct Change {
    std::string_view before, after;
};

/// What check says of the small room after replacing pieces of its text.
std::string report_with(const std::vector<Change>& changes) {
    std::string scene(small_room);
    for (const auto& [before, after] : changes) {
        const std::size_t position = scene.find(before);
        REQUIRE(position != std::string::npos);
        scene.replace(position, before.size(), after);
    }
    const TemporaryFolder folder;
    write(folder / "room.json", scene);
    const Outcome outcome = run_naturel({"check", (folder / "room.json").string()});
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    return outcome.output;
}

void check_says(const std::string& report, const std::string& text) {
    INFO(report);
    CHECK(report.find(text) != std::string::npos);
}

}  // namespace

TEST_CASE("check counts what a scene contains and finds nothing suspicious in a sound room", "[cli]") {
    const std::string report = report_with({});
    check_says(report, "3 polyhedra");
    // The room of 3 x 3 x 2.5 m and the window's way through the wall, 2 x 0.5 x 1.5 m.
    check_says(report, "indoor air 24.000 m3");
    check_says(report, "material \"floor\": 9.000 m2 indoors, 0.000 m2 outdoors");
    check_says(report, "3.000 m2, facing south, tilt 90 deg, glazing \"glass\"");
    check_says(report, "sensors \"eye, \"left\"\": 1 points");
    check_says(report, "nothing suspicious");
}

TEST_CASE("check warns of materials, a sun, sensors and views that are probably not meant", "[cli]") {
    const std::string report =
        report_with({{"\"wall\": {\"reflectance\": 0.5}", "\"wall\": {\"reflectance\": 0.97}"},
                     {"\"altitude_deg\": 40", "\"altitude_deg\": -10"},
                     {"[[2, 3, 1.2, 0, -1, 0]]", "[[2, 0.2, 0.5, 0, -1, 0], [2, -3, 0.5, 0, -1, 0]]"},
                     {"\"from\": [2, 3, 1.5]", "\"from\": [2, 3.8, 1.5]"}});
    check_says(report, "warning: material \"wall\" reflects 0.970");
    check_says(report, "not above the horizon");
    check_says(report, "1 of 2 points inside a solid");
    check_says(report, "1 of 2 points outdoors");
    check_says(report, "view \"to: window\" looks from inside a solid");
}

TEST_CASE("check warns of a black sky and of glazing that transmits nothing", "[cli]") {
    const std::string report = report_with({{"\"horizontal_illuminance_lx\": 10000", "\"horizontal_illuminance_lx\": 0"},
                                            {"\"normal_transmittance\": 0.88", "\"normal_transmittance\": 0"}});
    check_says(report, "warning: the sky is black: it gives no light");
    check_says(report, "warning: aperture \"window\" lets no light pass: its glazing \"glass\" transmits nothing");
}

TEST_CASE("check warns of a window that stops short of the facade", "[cli]") {
    const std::string report =
        report_with({{"[[1, -0.5, 1], [3, -0.5, 1], [1, 1, 1], [1, -0.5, 2.5]]",
                      "[[1, 0.25, 1], [3, 0.25, 1], [1, 1, 1], [1, 0.25, 2.5]]"},
                     {"\"direct_normal_illuminance_lx\": 50000", "\"direct_normal_illuminance_lx\": 0"}});
    check_says(report, "warning: no aperture");
    check_says(report, "no direct_normal_illuminance_lx");
}

TEST_CASE("check warns of a window that sees no sky", "[cli]") {
    // A hill stands 1 cm before the facade.
    check_says(
        report_with(
            {{"\"polyhedra\": [",
              "\"polyhedra\": [\n"
              "{\"id\": \"hill\", \"kind\": \"parallelepiped\", \"effect\": \"fill\", \"vertices\": "
              "[[-20, -1, 0], [24, -1, 0], [-20, -0.01, 0], [-20, -1, 30]], \"material\": \"facade\"},"}}),
        "sees no sky (does it look into the ground");
}

TEST_CASE("check warns of a gap between polygons", "[cli]") {
    const std::string report = report_with(
        {{"\"polyhedra\": [",
          "\"polygons\": [{\"id\": \"table\", \"side\": \"indoor\", \"material\": \"wall\","
          "\"vertices\": [[10, 10, 1], [11, 10, 1], [11, 11, 1], [10, 11, 1]]}],\n\"polyhedra\": ["}});
    check_says(report, "warning: a leak");
    check_says(report, "face \"table\"");
}

TEST_CASE("check warns of a room in millimetres", "[cli]") {
    check_says(
        report_with(
            {{"[[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 3]]",
              "[[0, 0, 0], [4000, 0, 0], [0, 4000, 0], [0, 0, 3000]]"},
             {"[[0.5, 0.5, 0.2], [3.5, 0.5, 0.2], [0.5, 3.5, 0.2], [0.5, 0.5, 2.7]]",
              "[[500, 500, 200], [3500, 500, 200], [500, 3500, 200], [500, 500, 2700]]"},
             {"\"grid\": {\"spacing_m\": 1}", "\"grid\": {\"spacing_m\": 500, \"outdoor_spacing_m\": 500}"},
             {"\"spacing_m\": 1, \"margin_m\": 0.4", "\"spacing_m\": 500, \"margin_m\": 400"}}),
        "is the scene in millimetres?");
}

TEST_CASE("check warns of a window that stops less than 10 mm before the room or the facade", "[cli]") {
    // The room begins at y = 0.5.
    const std::string inside =
        report_with({{"[[1, -0.5, 1], [3, -0.5, 1], [1, 1, 1], [1, -0.5, 2.5]]",
                      "[[1, -0.5, 1], [3, -0.5, 1], [1, 0.4996, 1], [1, -0.5, 2.5]]"}});
    check_says(inside, "warning: only 0.4 mm of solid behind face \"window/");
    const std::string outside =
        report_with({{"[[1, -0.5, 1], [3, -0.5, 1], [1, 1, 1], [1, -0.5, 2.5]]",
                      "[[1, 0.008, 1], [3, 0.008, 1], [1, 1, 1], [1, 0.008, 2.5]]"}});
    check_says(outside, "warning: only 8 mm of solid behind face \"window/");
    // A sheet that is thin on purpose.
    const std::string shelf = report_with(
        {{"\"material\": \"wall\", \"glazing\": \"glass\"}",
          "\"material\": \"wall\", \"glazing\": \"glass\"},\n"
          "{\"id\": \"shelf\", \"kind\": \"parallelepiped\", \"effect\": \"fill\", \"vertices\": "
          "[[1, 2, 1], [2, 2, 1], [1, 2.5, 1], [1, 2, 1.008]], \"material\": \"wall\"}"}});
    check_says(shelf, "nothing suspicious");
}

TEST_CASE("check warns of colours that the primaries cannot show", "[cli]") {
    const std::string report =
        report_with({{"\"floor\": {\"rgb\": [0.4, 0.2, 0.1]}", "\"floor\": {\"xyY\": [0.1, 0.7, 0.3]}"},
                     {"\"ground\": {\"z\": 0, \"reflectance\": 0.2}",
                      "\"ground\": {\"z\": 0, \"reflectance\": {\"xyY\": [0.1, 0.7, 0.3]}}"}});
    check_says(report, "cannot show the colour of material \"floor\": it is drawn towards grey by 0.");
    check_says(report, "cannot show the colour of the ground");
}

TEST_CASE("check tells a sun at the horizon from a sun without illuminance", "[cli]") {
    const std::string horizon = report_with({{"\"altitude_deg\": 40", "\"altitude_deg\": 0"}});
    check_says(horizon, "not above the horizon: it gives no light");
    INFO(horizon);
    CHECK(horizon.find("no direct_normal_illuminance_lx") == std::string::npos);
    // What the reader itself asks for.
    check_says(report_with({{"\"moon_spencer\"", "\"cie_clear\""},
                            {", \"direct_normal_illuminance_lx\": 50000", ""}}),
               "nothing suspicious");
}
