#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "cli/base64.h"
#include "tests/catch.h"
#include "tests/cli/packed.h"
#include "tests/cli/program.h"
#include "tests/cli/tables.h"

using namespace naturel::tests;

namespace {

using Json = nlohmann::json;

/// What would end the data, start another script, or be filled in by the template.
const std::string hostile = "</script><script>alert(1)</script><!--@DATA@ \\\"'& \u05d0\u0416";

/// Files of a run of a scene.
std::map<std::string, std::string> run_scene(const std::string& scene, const std::vector<std::string>& more = {}) {
    const TemporaryFolder folder;
    write(folder / "room.json", scene);
    std::vector<std::string> arguments{"run",        (folder / "room.json").string(), "--out",   (folder / "out").string(),
                                       "--backend",  "hemicube",                      "--cells", "32",
                                       "--no-error-estimate"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run_naturel(arguments);
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    return files_below(folder / "out/hemicube");
}

/// The small room with one view; `name` stands for its names.
std::string small_room_named(const std::string& name) {
    std::string scene(small_room);
    // An id is a part of file names: it has no slash.
    scene = std::regex_replace(scene, std::regex("eye, ..left.."), std::regex_replace(name, std::regex("/"), ""));
    scene = std::regex_replace(scene, std::regex("small room"), name);
    scene.erase(scene.find(",\n    {\"id\": \"to? Window\""));
    return scene + "\n  ]\n}";
}

std::map<std::string, std::string> run_room(const std::string& name, const std::vector<std::string>& more = {}) {
    return run_scene(small_room_named(name), more);
}

/// The small room with other words in place of some.
std::string changed_room(const std::string& words, const std::string& others) {
    std::string scene = small_room_named("small room");
    const std::size_t at = scene.find(words);
    REQUIRE(at != std::string::npos);
    return scene.replace(at, words.size(), others);
}

const std::map<std::string, std::string>& plain_room() {
    static const auto files = run_room("small room");
    return files;
}

std::string data_of(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"report\">", end = "</script>";
    const std::size_t from = page.find(begin);
    REQUIRE(from != std::string::npos);
    return page.substr(from + begin.size(), page.find(end, from) - from - begin.size());
}

std::size_t count(const std::string& text, const std::string& piece) {
    std::size_t found = 0;
    for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1)) ++found;
    return found;
}

/// The numbers beside the colours of a map, from below.
std::vector<std::string> legend_of(const std::string& map) {
    std::vector<std::string> numbers;
    const std::regex tick("<text class=\"tick\"[^>]*>([^<]*)</text>");
    for (std::sregex_iterator found(map.begin(), map.end(), tick), end; found != end; ++found) numbers.push_back((*found)[1]);
    return numbers;
}

}  // namespace

TEST_CASE("the report holds the summary, the bytes of sensors.csv and the pictures", "[cli][report]") {
    const auto& files = plain_room();
    const Json data = Json::parse(data_of(files.at("report.html")));
    CHECK(data["summary"] == Json::parse(files.at("summary.json")));
    CHECK(data["sensors_csv"] == naturel::base64(files.at("sensors.csv")));
    REQUIRE(data["pictures"].size() == 1);
    CHECK(data["pictures"][0]["png"] == naturel::base64(files.at(data["pictures"][0]["file"])));
}

TEST_CASE("the surfaces of the report are those of the tables", "[cli][report]") {
    const auto& files = plain_room();
    const Json mesh = Json::parse(data_of(files.at("report.html")))["mesh"];
    const auto check = [&](const std::string& light, const std::string& name, const std::string& table, std::size_t column) {
        INFO(light << " " << name);
        const auto rows = lines_of(files.at(table));
        const std::string bytes = from_base64(mesh[light][name]);
        for (std::size_t k = 1; k < rows.size(); ++k) {
            const double expected = std::stod(cells_of(rows[k])[column]);
            // Single precision.
            if (std::abs(number_at<float>(bytes, 4 * (k - 1)) - expected) > 1e-6 * expected) FAIL_CHECK("row " << k);
        }
    };
    CHECK(mesh["nodes"] == lines_of(files.at("nodes.csv")).size() - 1);
    CHECK(mesh["gather_patches"] == lines_of(files.at("patches.csv")).size() - 1);
    check("light", "sky", "nodes.csv", 8);
    check("light", "irc", "nodes.csv", 11);
    check("light", "daylight_factor", "nodes.csv", 16);
    check("patch_light", "sky", "patches.csv", 12);
    check("patch_light", "irc", "patches.csv", 15);
}

TEST_CASE("the report of a run loads nothing, and no mark of its template is left", "[cli][report]") {
    const std::string& page = plain_room().at("report.html");
    const std::regex fetching(R"re((<(img|script|link|iframe)[^>]*\b(src|href|srcset)\s*=\s*["']?\s*(https?:|//|file:))|(@import)|(sourceMappingURL=))re", std::regex::icase);
    // The libraries alone are long: line by line keeps the expression's stack small.
    for (const std::string& line : lines_of(page))
        if (line.size() < 10'000 && std::regex_search(line, fetching)) FAIL_CHECK(line);
    CHECK(count(page, "default-src 'none'") == 1);
    CHECK(count(page, "<link") == 1);
    CHECK(page.find("three.js authors") != std::string::npos);
    CHECK(page.find("Permission is hereby granted") != std::string::npos);
    for (const char* mark : {"TITLE", "SCENE", "BACKEND", "HEADLINE", "STYLE", "REPORT_STYLE", "DATA", "THREE_LICENCE", "THREE",
                             "ORBIT", "PAGE", "SURFACES", "SENSORS", "SCRIPT"})
        CHECK(page.find("@" + std::string(mark) + "@") == std::string::npos);
    CHECK(std::regex_search(page.substr(page.find("class=\"headline\""), 300),
                            std::regex("On “work plane” the mean daylight factor is [0-9.]+\u00a0% .*illuminance [0-9.]+\u00a0lx")));
}

TEST_CASE("names in a scene can't become markup of its report", "[cli][report]") {
    const std::string& plain = plain_room().at("report.html");
    const std::string page = run_room(hostile).at("report.html");
    CHECK(page.find("alert(1)</script>") == std::string::npos);
    for (const char* piece : {"<script", "</script", "<!--"}) CHECK(count(page, piece) == count(plain, piece));
    const std::string data = data_of(page);
    CHECK(data.find('<') == std::string::npos);
    CHECK(Json::parse(data)["summary"]["scene"]["name"] == "</script><script>alert(1)</script><!--@DATA@ \"'& \u05d0\u0416");
    CHECK(page.find("<h1>&lt;/script&gt;") != std::string::npos);
}

TEST_CASE("--no-report leaves the report out, and an earlier one does not stay", "[cli][report]") {
    const auto files = run_room("small room", {"--no-report"});
    CHECK_FALSE(files.contains("report.html"));
    const auto named = Json::parse(files.at("summary.json"))["files"];
    CHECK(std::ranges::find(named, "report.html") == named.end());
}

TEST_CASE("rooms whose points stand in one lattice are two in the report", "[cli][report]") {
    const auto files = run_scene(content_of(NATUREL_SOURCE_DIR "/tests/reports/two_rooms.json"), {"--quality", "draft"});
    const Json rooms = Json::parse(data_of(files.at("report.html")))["sets"][0]["rooms"];
    const auto rows = lines_of(files.at("sensors.csv"));
    REQUIRE(rooms.size() == rows.size() - 1);
    std::map<bool, std::vector<int>> numbers;  // by whether the point is east of the wall
    for (std::size_t k = 1; k < rows.size(); ++k) numbers[std::stod(cells_of(rows[k])[2]) > 3.7].push_back(rooms[k - 1]);
    REQUIRE(numbers.size() == 2);
    for (const auto& [east, of_room] : numbers) {
        CHECK(of_room.front() >= 0);
        CHECK(std::ranges::count(of_room, of_room.front()) == static_cast<std::ptrdiff_t>(of_room.size()));
    }
    CHECK(numbers[false].front() != numbers[true].front());
}

TEST_CASE("windows above a grid are in its plan, in the report as in the map", "[cli][report]") {
    const auto plan_of = [](const std::map<std::string, std::string>& files) {
        return Json(Json::parse(data_of(files.at("report.html")))["sets"][0]["plan"]);
    };
    const std::string map_name = "sensors/illuminance/work_plane.svg";
    // The sill is at 1 m, the grid at 0.85 m: the pane is an upright line over it.
    const Json above = plan_of(plain_room());
    CHECK(above["windows"].empty());
    REQUIRE(above["windows_above_or_below"].size() == 1);
    const Json& ends = above["windows_above_or_below"][0];
    REQUIRE(ends.size() == 2);
    CHECK(std::abs(std::abs(ends[0][0].get<double>() - ends[1][0].get<double>()) - 2.0) < 1e-6);
    CHECK(std::abs(ends[0][1].get<double>() - ends[1][1].get<double>()) < 1e-6);
    CHECK(count(plain_room().at(map_name), "class=\"window-above\"") == 1);

    const auto files = run_scene(changed_room("\"z\": 0.85", "\"z\": 1.2"));
    const Json cut = plan_of(files);
    CHECK(cut["windows"].size() == 1);
    CHECK(cut["windows_above_or_below"].empty());
    CHECK(count(files.at(map_name), "class=\"window-above\"") == 0);
    CHECK(count(files.at(map_name), "class=\"window\"") == 1);
}

TEST_CASE("the legend of a map tells both ends, and whether values are beyond", "[cli][report]") {
    const auto largest_lx = [](const std::map<std::string, std::string>& files) {
        double largest = 0.0;
        const auto rows = lines_of(files.at("sensors.csv"));
        for (std::size_t k = 1; k < rows.size(); ++k)
            if (const auto cells = cells_of(rows[k]); cells[1] == "work plane") largest = std::max(largest, std::stod(cells[12]));
        return largest;
    };
    const std::string map_name = "sensors/illuminance/work_plane.svg", beyond = "\u2265 ";
    // The sun falls on few of the points.
    const auto sunny = legend_of(plain_room().at(map_name));
    REQUIRE(sunny.size() >= 2);
    CHECK(sunny.front() == "0");
    REQUIRE(sunny.back().starts_with(beyond));
    CHECK(std::stod(sunny.back().substr(beyond.size())) < largest_lx(plain_room()));
    // One point is the brightest hundredth: the scale ends above it.
    const auto files = run_scene(changed_room("\"spacing_m\": 1, \"margin_m\": 0.4", "\"spacing_m\": 3, \"margin_m\": 0.4"));
    const auto one = legend_of(files.at(map_name));
    REQUIRE(one.size() >= 2);
    CHECK(one.front() == "0");
    INFO(one.back());
    CHECK(std::stod(one.back()) >= largest_lx(files));
}

TEST_CASE("numbers in a map neither run together nor into the values of its lines", "[cli][report]") {
    std::string scene = content_of(NATUREL_SOURCE_DIR "/tests/reports/two_rooms.json");
    scene.replace(scene.find("\"spacing_m\": 0.5, \"margin_m\": 0"), 16, "\"spacing_m\": 0.2");
    const auto files = run_scene(scene, {"--quality", "draft"});
    const std::string& map = files.at("sensors/illuminance/work_plane.svg");
    struct Number {
        double x_mm, y_mm, width_mm;
    };
    const auto numbers = [&](const std::string& css_class) {
        std::vector<Number> found;
        const std::regex text("<text class=\"" + css_class + "\" x=\"([0-9.]+)\" y=\"([0-9.]+)\">([0-9.]+)</text>");
        // A digit of 2.1 mm is about 0.56 times as wide as high.
        for (std::sregex_iterator at(map.begin(), map.end(), text), end; at != end; ++at)
            found.push_back({std::stod((*at)[1]), std::stod((*at)[2]), 0.56 * 2.1 * static_cast<double>((*at)[3].length())});
        return found;
    };
    const std::vector<Number> values = numbers("value(?: on-dark)?"), levels = numbers("small middle");
    REQUIRE(values.size() > 50);
    REQUIRE(levels.size() > 4);
    CHECK(map.find("numbers at one sensor in 2 x 2") != std::string::npos);
    const auto check = [&](const Number& a, const Number& b, double gap_mm) {
        if (std::abs(a.x_mm - b.x_mm) < 0.5 * (a.width_mm + b.width_mm) + gap_mm && std::abs(a.y_mm - b.y_mm) < 2.1)
            FAIL_CHECK(a.x_mm << " " << a.y_mm << " and " << b.x_mm << " " << b.y_mm);
    };
    for (std::size_t k = 0; k < values.size(); ++k)
        for (std::size_t n = 0; n < k; ++n) check(values[n], values[k], 0.5);
    for (std::size_t k = 0; k < levels.size(); ++k) {
        for (std::size_t n = 0; n < k; ++n) check(levels[n], levels[k], 0.0);
        for (const Number& value : values) check(levels[k], value, 0.0);
    }
}

TEST_CASE("the summary tells the glare of a view and what its false colours mean", "[cli][report]") {
    std::string scene = changed_room("\"kind\": \"perspective\"", "\"kind\": \"fisheye\"");
    scene = std::regex_replace(scene, std::regex("\"fov_deg\": 70,\\s*\"width\": 32, \"height\": 24"), "\"fov_deg\": 180, \"width\": 32, \"height\": 32");
    const auto files = run_scene(scene, {"--false-colour", "illuminance", "--contours", "100,500"});
    const Json view = Json::parse(files.at("summary.json"))["views"][0];
    Json glare = Json::parse(files.at("glare.json"))["views"][0];
    CHECK(glare["view"] == view["id"]);
    CHECK(glare["vertical_illuminance_lx"].get<double>() > 0.0);
    glare.erase("view");
    glare.erase("sources");
    CHECK(view["glare"] == glare);
    CHECK(view["false_colour"]["quantity"] == "illuminance");
    CHECK(view["false_colour"]["unit"] == "lx");
    CHECK(view["false_colour"]["scale"] == "linear");
    CHECK(view["false_colour"]["maximum"].get<double>() > 0.0);
    CHECK(view["false_colour"]["contours"] == Json{100.0, 500.0});
    CHECK_FALSE(Json::parse(plain_room().at("summary.json"))["views"][0].contains("glare"));
}
