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

/// Files of a run of the small room with one view; `name` stands for its names.
std::map<std::string, std::string> run_room(const std::string& name, const std::vector<std::string>& more = {}) {
    const TemporaryFolder folder;
    std::string scene(small_room);
    // An id is a part of file names: it has no slash.
    scene = std::regex_replace(scene, std::regex("eye, ..left.."), std::regex_replace(name, std::regex("/"), ""));
    scene = std::regex_replace(scene, std::regex("small room"), name);
    scene.erase(scene.find(",\n    {\"id\": \"to? Window\""));
    scene += "\n  ]\n}";
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
