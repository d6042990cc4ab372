#include <regex>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

/// Model and the options it needs besides a sun.
struct Model {
    std::string name, sky_keys;
    std::vector<std::string> options;
};

std::vector<Model> every_model(const TemporaryFolder& folder) {
    std::vector<Model> models{{"uniform", "", {}},          {"moon_spencer", "", {}},
                              {"cie_clear", "", {}},        {"cie_clear_polluted", "", {}},
                              {"intermediate", "", {}},
                              {"perez",
                               R"(, "direct_normal_irradiance_w_m2": 500, "diffuse_horizontal_irradiance_w_m2": 120)",
                               {"--direct-irradiance", "500", "--diffuse-irradiance", "120"}},
                              {"expression", R"x(, "luminance": "3000 + 100*cos(azimuth)")x",
                               {"--luminance", "3000 + 100*cos(azimuth)"}}};
    for (int type = 1; type <= 16; ++type)
        models.push_back({"cie_general_" + std::to_string(type), "", {}});
    std::string values;
    for (int patch = 0; patch < 145; ++patch)
        values += std::to_string(1000 + patch) + "\n";
    write(folder / "values.txt", values);
    models.push_back({"table", R"(, "table": {"subdivision": "tregenza", "file": "values.txt"})",
                      {"--subdivision", "tregenza", "--table", (folder / "values.txt").string()}});
    return models;
}

}  // namespace

TEST_CASE("the command sky knows every model and draws its dome", "[cli][sky][slow]") {
    const TemporaryFolder folder;
    for (const Model& model : every_model(folder)) {
        INFO(model.name);
        const auto out = folder / model.name;
        std::vector<std::string> arguments{"sky",  model.name, "--altitude",  "40",    "--azimuth",
                                           "200", "--size",   "64", "--out", out.string()};
        arguments.insert(arguments.end(), model.options.begin(), model.options.end());
        const Outcome outcome = run_naturel(arguments);
        INFO(outcome.errors << outcome.output);
        CHECK(outcome.exit_code == 0);
        CHECK(outcome.output.starts_with(model.name + ": "));
        CHECK(outcome.output.find(" nan") == std::string::npos);
        CHECK(content_of(out / "sky.png").starts_with("\x89PNG"));
    }
}

TEST_CASE("a scene runs under every model of the sky", "[cli][sky][slow]") {
    const TemporaryFolder folder;
    const std::string known = R"("sky": {"model": "moon_spencer", "horizontal_illuminance_lx": 10000})";
    for (const Model& model : every_model(folder)) {
        INFO(model.name);
        std::string scene(small_room);
        scene.replace(scene.find(known), known.size(), R"("sky": {"model": ")" + model.name + "\"" + model.sky_keys + "}");
        write(folder / "room.json", scene);
        const auto out = folder / ("run_" + model.name);
        const Outcome outcome = run_naturel({"run", (folder / "room.json").string(), "--backend", "hemicube", "--cells", "32",
                                             "--quiet", "--out", out.string()});
        INFO(outcome.errors);
        CHECK(outcome.exit_code == 0);
        CHECK(content_of(out / "hemicube" / "summary.json").find("\"" + model.name + "\"") != std::string::npos);
    }
}

TEST_CASE("the command sky prints the illuminances of an overcast sky", "[cli][sky]") {
    const TemporaryFolder folder;
    const Outcome outcome = run_naturel(
        {"sky", "moon_spencer", "--horizontal-illuminance", "10000", "--size", "64", "--out", folder.path().string()});
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.output.find("zenith luminance 4092.6 cd/m2") != std::string::npos);
    CHECK(std::regex_search(outcome.output, std::regex("facing north +3961.8 +0.0 +3961.8")));  // 3/14 + 4/(7 pi)
}

TEST_CASE("the command sky turns a scene's sun back to true north", "[cli][sky]") {
    const TemporaryFolder folder;
    std::string scene(small_room);
    scene.insert(scene.find("\"ground\""), R"("site": {"north_deg": 30}, )");
    write(folder / "room.json", scene);
    const Outcome outcome =
        run_naturel({"sky", (folder / "room.json").string(), "--size", "64", "--out", folder.path().string()});
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.output.find("altitude 40.00 deg, azimuth 180.00 deg") != std::string::npos);
    CHECK(std::regex_search(outcome.output, std::regex("facing east +3961.8 +0.0")));
    CHECK(std::regex_search(outcome.output, std::regex("facing south +3961.8 +38302.2")));  // 50000 cos 40
}

TEST_CASE("the command sky refuses what it cannot draw", "[cli][sky]") {
    const TemporaryFolder folder;
    const auto refused = [&](std::vector<std::string> arguments, const std::string& message) {
        arguments.insert(arguments.end(), {"--out", (folder / "out").string()});
        const Outcome outcome = run_naturel(arguments);
        INFO(outcome.errors);
        CHECK(outcome.exit_code == 3);
        CHECK(outcome.errors.find(message) != std::string::npos);
        CHECK(!std::filesystem::exists(folder / "out"));
    };
    refused({"sky", "moonspencer"}, "(did you mean \"moon_spencer\"?)");
    refused({"sky", "cie_clear", "--altitude", "0", "--azimuth", "10"}, "needs it above the horizon");
    refused({"sky", "moon_spencer"}, "one is needed, or a \"sun\"");
    refused({"sky", "expression", "--luminance", "1 +"}, "character 5 of the formula");
    refused({"sky", "uniform", "--horizontal-illuminance", "bright"}, "stands where a number belongs");
    write(folder / "holes.txt", "# one value is missing\n1 2 x\n");
    refused({"sky", "table", "--subdivision", "tregenza", "--table", (folder / "holes.txt").string()},
            "holes.txt:2:5: \"x\" is not a number");
    write(folder / "raster.txt", "10 0 5\n10 180 6\n60 0 7\n");
    refused({"sky", "table", "--subdivision", "raster", "--table", (folder / "raster.txt").string()},
            "a hole at altitude 60 and azimuth 180");
}
