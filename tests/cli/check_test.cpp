#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

/// What check says of the small room after replacing one piece of its text.
std::string report_with(std::string_view before, std::string_view after) {
    std::string scene(small_room);
    const std::size_t position = scene.find(before);
    REQUIRE(position != std::string::npos);
    scene.replace(position, before.size(), after);
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
    const std::string report = report_with("small room", "small room");
    check_says(report, "3 polyhedra");
    // The room of 3 x 3 x 2.5 m and the window's way through the wall, 2 x 0.5 x 1.5 m.
    check_says(report, "indoor air 24.000 m3");
    check_says(report, "material \"floor\": 9.000 m2 indoors, 0.000 m2 outdoors");
    check_says(report, "3.000 m2, facing south, tilt 90 deg, glazing \"glass\"");
    check_says(report, "sensors \"eye, \"left\"\": 1 points");
    check_says(report, "nothing suspicious");
}

TEST_CASE("check warns of what is probably not meant", "[cli]") {
    check_says(report_with("\"wall\": {\"reflectance\": 0.5}", "\"wall\": {\"reflectance\": 0.97}"),
               "warning: material \"wall\" reflects 0.970");
    check_says(report_with("\"altitude_deg\": 40", "\"altitude_deg\": -10"), "below the horizon");
    check_says(report_with("\"direct_normal_illuminance_lx\": 50000", "\"direct_normal_illuminance_lx\": 0"),
               "it gives no light");
    check_says(report_with("[[2, 3, 1.2, 0, -1, 0]]", "[[2, 0.2, 0.5, 0, -1, 0]]"),
               "1 of 1 points inside a solid");
    check_says(report_with("[[2, 3, 1.2, 0, -1, 0]]", "[[2, -3, 0.5, 0, -1, 0]]"), "1 of 1 points outdoors");
    check_says(report_with("\"from\": [2, 3, 1.5]", "\"from\": [2, 3.8, 1.5]"), "looks from inside a solid");
    // The window stops short of the facade.
    check_says(report_with("[[1, -0.5, 1], [3, -0.5, 1], [1, 1, 1], [1, -0.5, 2.5]]",
                           "[[1, 0.25, 1], [3, 0.25, 1], [1, 1, 1], [1, 0.25, 2.5]]"),
               "warning: no aperture");
    // A wall right in front of the facade hides the sky: it touches the house.
    check_says(report_with(
                   "\"polyhedra\": [",
                   "\"polyhedra\": [\n"
                   "{\"id\": \"hill\", \"kind\": \"parallelepiped\", \"effect\": \"fill\", \"vertices\": "
                   "[[-20, -1, 0], [24, -1, 0], [-20, -0.01, 0], [-20, -1, 30]], \"material\": \"facade\"},"),
               "sees no sky");
}

TEST_CASE("check warns of a room in millimetres", "[cli]") {
    std::string scene(small_room);
    const std::string before = "[[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 3]]";
    const std::string after = "[[0, 0, 0], [4000, 0, 0], [0, 4000, 0], [0, 0, 3000]]";
    scene.replace(scene.find(before), before.size(), after);
    const std::string room_before = "[[0.5, 0.5, 0.2], [3.5, 0.5, 0.2], [0.5, 3.5, 0.2], [0.5, 0.5, 2.7]]";
    const std::string room_after = "[[500, 500, 200], [3500, 500, 200], [500, 3500, 200], [500, 500, 2700]]";
    scene.replace(scene.find(room_before), room_before.size(), room_after);
    const std::string grid_before = "\"grid\": {\"spacing_m\": 1}";
    scene.replace(scene.find(grid_before), grid_before.size(),
                  "\"grid\": {\"spacing_m\": 500, \"outdoor_spacing_m\": 500}");
    const TemporaryFolder folder;
    write(folder / "room.json", scene);
    const Outcome outcome = run_naturel({"check", (folder / "room.json").string()});
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 0);
    check_says(outcome.output, "is the scene in millimetres?");
}
