// Scenes without light, or with as little absorption as can be, through the program.
#include <nlohmann/json.hpp>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

const std::string sky_of_room = R"({"model": "moon_spencer", "horizontal_illuminance_lx": 10000})";
const std::string sun_of_room = R"("sun": {"altitude_deg": 40, "azimuth_deg": 180, "direct_normal_illuminance_lx": 50000},)";

std::string replaced(std::string text, const std::string& before, const std::string& after) {
    const std::size_t position = text.find(before);
    REQUIRE(position != std::string::npos);
    return text.replace(position, before.size(), after);
}

/// The small room under another sky, with or without its sun.
std::string room_under(const std::string& sky, bool sun) {
    const std::string room = replaced(std::string(small_room), sky_of_room, sky);
    return sun ? room : replaced(room, sun_of_room, "");
}

struct Run {
    Outcome outcome;
    std::map<std::string, std::string> files;
    nlohmann::json summary;
};

/// hemicube, few cells; zeros.txt and holes.txt lie beside the scene.
Run run_room(const std::string& scene, const std::vector<std::string>& more = {}) {
    const TemporaryFolder folder;
    std::string zeros;
    for (int patch = 0; patch < 145; ++patch) zeros += "0\n";
    write(folder / "zeros.txt", zeros);
    write(folder / "holes.txt", zeros.substr(0, 100) + "\n# here values are missing\n" + zeros.substr(0, 10));
    write(folder / "word.txt", "1 2\n3 none 5\n");
    write(folder / "room.json", scene);
    std::vector<std::string> arguments{"run", (folder / "room.json").string(), "--out", (folder / "out").string(),
                                       "--backend", "hemicube", "--cells", "32", "--false-colour", "luminance"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Run run{run_naturel(arguments), {}, {}};
    if (std::filesystem::exists(folder / "out")) run.files = files_below(folder / "out");
    if (run.files.contains("hemicube/summary.json")) run.summary = nlohmann::json::parse(run.files.at("hemicube/summary.json"));
    return run;
}

void check_complete(const Run& run) {
    INFO(run.outcome.errors);
    CHECK(run.outcome.exit_code == 0);
    for (const char* name : {"nodes.csv", "patches.csv", "sensors.csv", "summary.json", "views/to__window.png", "views/to__window.exr",
                             "views/false_colour/to__window.png"})
        CHECK(run.files.contains(std::string("hemicube/") + name));
    for (const auto& [name, content] : run.files) {
        if (!name.ends_with(".csv")) continue;
        INFO(name);
        for (const char* word : {",nan", ",-nan", ",inf", ",-inf"}) CHECK(content.find(word) == std::string::npos);
    }
    // JSON has no word for what is not a number but null.
    for (const char* part : {"sensor_sets", "outdoors", "quality", "views"}) CHECK(run.summary.at(part).dump().find("null") == std::string::npos);
    CHECK(run.outcome.output.find(" nan") == std::string::npos);
}

double mean_lx(const Run& run) { return run.summary.at("sensor_sets").at(0).at("illuminance_lx").at("mean").get<double>(); }

}  // namespace

TEST_CASE("a sky without light gives a run of zeros and no daylight factor", "[cli][extremes]") {
    const std::string sky = GENERATE(as<std::string>(), R"({"model": "moon_spencer", "horizontal_illuminance_lx": 0})",
                                     R"({"model": "uniform", "zenith_luminance_cd_m2": 0})",
                                     R"({"model": "table", "table": {"subdivision": "tregenza", "file": "zeros.txt"}})",
                                     R"({"model": "expression", "luminance": "0"})");
    INFO(sky);
    const Run run = run_room(room_under(sky, false));
    check_complete(run);
    CHECK(mean_lx(run) == 0.0);
    CHECK_FALSE(run.summary["sensor_sets"][0].contains("daylight_factor_percent"));
    CHECK(run.summary["outdoors"]["horizontal_illuminance_lx"] == 0.0);
    CHECK(run.summary["quality"]["flux"]["in_lm"] == 0.0);
}

TEST_CASE("under a black sky the sun still shines", "[cli][extremes]") {
    const Run run = run_room(room_under(R"({"model": "perez", "direct_normal_irradiance_w_m2": 0, "diffuse_horizontal_irradiance_w_m2": 0})", true));
    check_complete(run);
    CHECK(run.summary["outdoors"]["horizontal_illuminance_lx"] == 0.0);
    CHECK(run.summary["outdoors"]["sun"]["direct_normal_illuminance_lx"] == 50000.0);
    CHECK(mean_lx(run) > 100.0);
}

TEST_CASE("a sun below the horizon changes nothing but what is said of it", "[cli][extremes]") {
    const Run night = run_room(replaced(std::string(small_room), "\"altitude_deg\": 40", "\"altitude_deg\": -5"));
    check_complete(night);
    CHECK(night.summary["outdoors"]["sun"]["direct_normal_illuminance_lx"] == 0.0);
    const Run without = run_room(room_under(sky_of_room, false));
    check_complete(without);
    for (const char* name : {"hemicube/sensors.csv", "hemicube/nodes.csv", "hemicube/patches.csv"})
        CHECK(night.files.at(name) == without.files.at(name));
}

TEST_CASE("glazing that transmits nothing gives a dark room under a bright sky", "[cli][extremes]") {
    const Run run = run_room(replaced(std::string(small_room), "\"normal_transmittance\": 0.88", "\"normal_transmittance\": 0"));
    check_complete(run);
    CHECK(mean_lx(run) == 0.0);
    CHECK(run.summary["sensor_sets"][0]["daylight_factor_percent"]["max"] == 0.0);
    CHECK(run.summary["outdoors"]["horizontal_illuminance_lx"] == 10000.0);
}

TEST_CASE("rooms of reflectance 0 and 0.99 are computed, and one of 1 is refused", "[cli][extremes]") {
    const auto room = [](const std::string& reflectance) {
        const std::string painted = replaced(std::string(small_room), R"("wall": {"reflectance": 0.5})", R"("wall": {"reflectance": )" + reflectance + "}");
        return replaced(painted, R"("floor": {"rgb": [0.4, 0.2, 0.1]})", R"("floor": {"reflectance": )" + reflectance + "}");
    };
    const Run black = run_room(room("0")), white = run_room(room("0.99"));
    check_complete(black);
    check_complete(white);
    CHECK(white.summary["quality"]["radiosity"]["converged"] == true);
    CHECK(white.summary["quality"]["flux"]["relative_gap"].get<double>() < 1e-4);  // 1e-6 of the iteration, up to 1 / (1 - rho) times
    // The same light comes in. A black room absorbs it where it falls; from a white one most finds out again, after some ten
    // reflections: 45 m2 of surface share it with 3 m2 of window.
    CHECK(black.summary["quality"]["flux"]["in_lm"] == white.summary["quality"]["flux"]["in_lm"]);
    CHECK(mean_lx(white) > 5.0 * mean_lx(black));
    const Run mirror = run_room(room("1"));
    CHECK(mirror.outcome.exit_code == 3);
    CHECK(mirror.outcome.errors.find("/materials/wall/reflectance: 1 is out of range (0 to 0.99 would be right)") != std::string::npos);
    CHECK(mirror.files.empty());
}

TEST_CASE("a table of the sky with a hole is refused before anything is computed", "[cli][extremes]") {
    const auto refused = [](const std::string& table, const std::string& message) {
        const Run run = run_room(room_under(R"({"model": "table", "table": )" + table + "}", false));
        INFO(run.outcome.errors);
        CHECK(run.outcome.exit_code == 3);
        CHECK(run.outcome.errors.find(message) != std::string::npos);
        CHECK(run.files.empty());
    };
    refused(R"({"subdivision": "tregenza", "file": "holes.txt"})", "holes.txt");
    refused(R"({"subdivision": "tregenza", "file": "word.txt"})", "word.txt:2:3: \"none\" is not a number");
    refused(R"({"subdivision": "raster", "altitudes_deg": [10, 60], "values": [[1, 2, 3], [4, null, 6]]})", "the table has a hole here");
    refused(R"({"subdivision": "raster", "altitudes_deg": [10, 60], "values": [[1, 2, 3], [4, 5]]})", "the table has a hole");
}

TEST_CASE("the command sky draws a dome without light", "[cli][sky][extremes]") {
    const TemporaryFolder folder;
    const Outcome outcome = run_naturel({"sky", "uniform", "--horizontal-illuminance", "0", "--size", "64", "--out", folder.path().string()});
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.output.find("zenith luminance 0.0 cd/m2") != std::string::npos);
    CHECK(outcome.output.find(" nan") == std::string::npos);
    CHECK(content_of(folder / "sky.png").starts_with("\x89PNG"));
}
