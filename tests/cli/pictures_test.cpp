// What the options of pictures and false colour do to the files of a run.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

using Files = std::map<std::string, std::string>;

/// The files of the only backend that is run. keys: at the top of the scene.
Files pictures_of(const std::string& keys, const std::vector<std::string>& options) {
    const TemporaryFolder folder;
    std::string scene(small_room);
    scene.insert(scene.find("\"materials\""), keys);
    // A warm sky, so that it matters which light looks white.
    const std::string level = "\"horizontal_illuminance_lx\": 10000";
    scene.insert(scene.find(level) + level.size(), ", \"colour\": {\"cct_k\": 4000}");
    write(folder / "room.json", scene);
    std::vector<std::string> arguments{"run", (folder / "room.json").string(), "--out", (folder / "out").string(),
                                       "--backend", "hemicube", "--cells", "32", "--no-error-estimate"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = run_naturel(arguments);
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    return files_below(folder / "out/hemicube");
}

nlohmann::json first_view(const Files& files) { return nlohmann::json::parse(files.at("summary.json"))["views"][0]; }

double white_cd_m2(const Files& files) { return first_view(files)["png_white_cd_m2"].get<double>(); }

struct Size {
    unsigned width, height;
    bool operator==(const Size&) const = default;
};

/// Of a PNG file, from its header (ISO/IEC 15948, 11.2.2).
Size size_of(const std::string& png) {
    REQUIRE(png.starts_with("\x89PNG"));
    const auto number = [&](std::size_t at) {
        unsigned value = 0;
        for (std::size_t k = at; k < at + 4; ++k) value = 256 * value + static_cast<unsigned char>(png.at(k));
        return value;
    };
    return {number(16), number(20)};
}

/// The run ends before it reads a scene, and says why.
void refused(const std::vector<std::string>& options, const std::string& message) {
    std::vector<std::string> arguments{"run", "room.json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = run_naturel(arguments);
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.errors.find(message) != std::string::npos);
}

const std::string png = "views/to__window.png", exr = "views/to__window.exr", mapped = "views/false_colour/to__window.png";

}  // namespace

TEST_CASE("options of pictures say what the scene's keys say, and go before them", "[cli][picture]") {
    const Files by_keys = pictures_of(
        R"("picture": {"exposure": {"white_cd_m2": 300}, "tone_mapping": "reinhard", "white_point": "sky"}, )", {});
    const Files by_options = pictures_of(R"("picture": {"exposure": {"ev100": 3}}, )",
                                         {"--exposure", "white=300", "--tone-mapping", "reinhard", "--white-point", "sky"});
    const nlohmann::json view = first_view(by_options);
    CHECK(view == first_view(by_keys));
    CHECK(view["png_white_cd_m2"] == 300.0);
    CHECK(view["png_exposure"] == "white");
    CHECK(view["png_tone_mapping"] == "reinhard");
    CHECK(view["png_white_point"] == "sky");
}

TEST_CASE("the exposure is the luminance it asks for, and leaves what is measured alone", "[cli][picture]") {
    const Files automatic = pictures_of("", {}), camera = pictures_of("", {"--exposure", "ev100=10"}),
                median = pictures_of("", {"--exposure", "percentile=50"}), brightest = pictures_of("", {"--exposure", "percentile=100"});
    CHECK(first_view(automatic)["png_exposure"] == "auto");
    CHECK(std::abs(white_cd_m2(camera) - 1.2 * 1024.0) <= 1e-9 * 1228.8);  // docs/method.md eq. (Pictures 1)
    CHECK(white_cd_m2(median) < white_cd_m2(automatic));
    CHECK(white_cd_m2(automatic) <= white_cd_m2(brightest));
    for (const Files* files : {&camera, &median, &brightest}) {
        CHECK((files->at(png) != automatic.at(png)));
        for (const char* same : {"views/to__window.exr", "sensors.csv", "nodes.csv", "patches.csv"}) {
            INFO(same);
            CHECK((files->at(same) == automatic.at(same)));
        }
    }
}

TEST_CASE("tone mapping and white point change what a picture looks like", "[cli][picture]") {
    const auto with = [](std::vector<std::string> more) {
        more.insert(more.end(), {"--exposure", "white=300"});
        return pictures_of("", more);
    };
    const Files plain = with({});
    CHECK(size_of(plain.at(png)) == Size{32, 24});
    CHECK((with({"--tone-mapping", "linear", "--white-point", "d65"}).at(png) == plain.at(png)));  // the defaults
    CHECK((with({"--tone-mapping", "reinhard"}).at(png) != plain.at(png)));
    CHECK((with({"--white-point", "sky"}).at(png) != plain.at(png)));
}

TEST_CASE("false colour is drawn when it is asked for, beside the field a legend", "[cli][picture]") {
    const Files without = pictures_of("", {});
    CHECK_FALSE(without.contains(mapped));
    const Files luminance = pictures_of("", {"--false-colour", "luminance"});
    REQUIRE(luminance.contains(mapped));
    const auto files = nlohmann::json::parse(luminance.at("summary.json"))["files"];
    CHECK(std::count(files.begin(), files.end(), mapped) == 1);
    const Size size = size_of(luminance.at(mapped));
    CHECK(size.width > 32);
    CHECK(size.height > 24);
    CHECK((luminance.at(png) == without.at(png)));
    CHECK((luminance.at(exr) == without.at(exr)));
}

TEST_CASE("quantity, scale, end and lines of false colour change its picture and no other", "[cli][picture]") {
    const Files luminance = pictures_of("", {"--false-colour", "luminance"});
    const std::vector<std::vector<std::string>> variations{
        {"--false-colour", "illuminance"},
        {"--false-colour", "luminance", "--false-colour-scale", "logarithmic"},
        {"--false-colour", "luminance", "--false-colour-max", "77"},
        {"--false-colour", "luminance", "--contours", "50,200"}};
    for (const auto& options : variations) {
        INFO(options.back());
        const Files varied = pictures_of("", options);
        CHECK((varied.at(mapped) != luminance.at(mapped)));
        CHECK((varied.at(png) == luminance.at(png)));
    }
}

TEST_CASE("exposures that make no sense are refused with what would be right", "[cli][picture]") {
    const std::string ways = "is not an exposure (auto, white=CD_M2, ev100=EV or percentile=PERCENT)";
    for (const char* text : {"white", "white=much", "auto=3"})
        refused({"--exposure", text}, "\"" + std::string(text) + "\" " + ways);
    refused({"--exposure", "white=0"}, "\"white=0\" is out of range (");
    refused({"--exposure", "percentile=nan"}, "\"percentile=nan\" is out of range (");
}

TEST_CASE("options of pictures that make no sense are refused with what would be right", "[cli][picture]") {
    refused({"--tone-mapping", "filmic"}, "unknown word \"filmic\" (known: linear, reinhard)");
    refused({"--white-point", "d50"}, "unknown word \"d50\" (known: d65, sky)");
    refused({"--false-colour", "heat"}, "unknown word \"heat\" (known: none, luminance, illuminance, daylight_factor)");
    refused({"--false-colour-scale", "cubic"}, "unknown word \"cubic\" (known: linear, logarithmic)");
    refused({"--false-colour-max", "0"}, "--false-colour-max");
    refused({"--contours", "10,-5"}, "--contours");
    for (const std::vector<std::string>& idle : {std::vector<std::string>{"--contours", "1,2"}, {"--false-colour-max", "5"}, {"--false-colour-scale", "logarithmic"}}) {
        refused(idle, idle.front() + ": nothing is drawn in false colour (give \"--false-colour luminance\"");
        refused({"--false-colour", "none", idle[0], idle[1]}, idle.front() + ": nothing is drawn in false colour");
    }
}
