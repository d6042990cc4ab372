#include "cli/comparison_report.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "cli/comparison_figures.h"
#include "cli/comparison_values.h"
#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel;

namespace {

using Json = nlohmann::ordered_json;

Json sample() {
    return Json::parse(tests::content_of(NATUREL_SOURCE_DIR "/tests/data/comparison_sample.json"));
}

/// What stands in the page as data.
std::string embedded(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"comparison\">", end = "</script>";
    const std::size_t from = page.find(begin);
    REQUIRE(from != std::string::npos);
    return page.substr(from + begin.size(), page.find(end, from) - from - begin.size());
}

std::size_t count(const std::string& text, const std::string& piece) {
    std::size_t found = 0;
    for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1))
        ++found;
    return found;
}

const std::regex no_number("\\b(nan|inf)\\b");

}  // namespace

TEST_CASE("the report of a comparison holds its data unchanged", "[cli][report]") {
    const Json comparison = sample();
    CHECK(Json::parse(embedded(comparison_report(comparison))) == comparison);
}

TEST_CASE("the report of a comparison loads nothing", "[cli][report]") {
    const std::string page = comparison_report(sample());
    // What makes a browser fetch; the one link is an empty icon, so that none is asked for.
    const std::regex fetching(
        R"re((<[^>]*\b(src|href|srcset|action)\s*=\s*["']?\s*(https?:|//|file:))|(@import)|(url\(\s*["']?(https?:|//))|(sourceMappingURL=))re",
        std::regex::icase);
    std::smatch found;
    const bool any = std::regex_search(page, found, fetching);
    INFO("found: " << (any ? found.str() : ""));
    CHECK_FALSE(any);
    CHECK(count(page, "default-src 'none'") == 1);  // and the browser is told not to
    CHECK(count(page, "<link") == 1);
    CHECK(count(page, "<link rel=\"icon\" href=\"data:,\">") == 1);
    CHECK(page.find("Chart.js Contributors") != std::string::npos);
    CHECK(page.find("Permission is hereby granted") != std::string::npos);
}

TEST_CASE("no mark of the template is left in the report", "[cli][report]") {
    const std::string page = comparison_report(sample());
    for (const char* mark :
         {"@TITLE@", "@SCENE@", "@HEADLINE@", "@DATA@", "@CHART@", "@CHART_LICENCE@", "@SCRIPT@"})
        CHECK(page.find(mark) == std::string::npos);
}

TEST_CASE("names in a comparison can't become markup of the report or its figures", "[cli][report]") {
    const std::string hostile = "</script><script>alert(1)</script><!--@DATA@ \"'&\xff";
    Json comparison = sample();
    comparison["scene"]["name"] = hostile;
    comparison["sets"][0]["id"] = hostile;
    for (Json& point : comparison["points"])
        if (point["set"] == "work plane") point["set"] = hostile, point["id"] = hostile;
    for (Json& ingredient : comparison["ingredients"]) {
        ingredient["name"] = hostile;
        for (const char* group : {"sets", "alone_sets"})
            ingredient[group][hostile] = ingredient[group]["work plane"];
    }
    for (const char* part : {"total", "reference_error"})
        comparison[part]["sets"][hostile] = comparison[part]["sets"]["work plane"];
    comparison["sweeps"][0]["parameter"] = hostile;

    const std::string page = comparison_report(comparison), plain = comparison_report(sample());
    CHECK(page.find("alert(1)</script>") == std::string::npos);
    CHECK(count(page, "<script") == count(plain, "<script"));
    CHECK(count(page, "</script") == count(plain, "</script"));
    CHECK(count(page, "<!--") == count(plain, "<!--"));
    CHECK(embedded(page).find('<') == std::string::npos);
    CHECK(page.find("&lt;/script&gt;") != std::string::npos);  // the heading shows the name

    const auto figures = comparison_figures(comparison);
    CHECK(figures.size() == comparison_figures(sample()).size());
    for (const auto& [name, svg] : figures) {
        INFO(name);
        CHECK(std::regex_match(name, std::regex("[a-z0-9_]+\\.svg")));
        CHECK(svg.find("<script") == std::string::npos);
    }
}

TEST_CASE("the headline of a comparison tells the total, its largest ingredient and the reference's error",
          "[cli][report]") {
    const Json comparison = Json::parse(R"({"sets": [{"id": "desk", "points": 1}],
        "ingredients": [
            {"name": "cells", "resolved": true, "sets": {"desk": {"total": {"mean_lx": 0.5, "rms_lx": 2, "mean_percent": 0.1, "rms_percent": 0.4}}}},
            {"name": "truncation", "resolved": true, "sets": {"desk": {"total": {"mean_lx": -4.5, "rms_lx": 5, "mean_percent": -0.9, "rms_percent": 1}}}},
            {"name": "nearness", "resolved": false, "sets": {"desk": {"total": {"mean_lx": 7, "rms_lx": 9, "mean_percent": 1.4, "rms_percent": 1.8}}}}],
        "total": {"sets": {"desk": {"total": {"mean_lx": -4, "rms_lx": 6, "worst_lx": -12, "mean_percent": -0.8, "rms_percent": 1.2}}}},
        "reference_error": {"sets": {"desk": {"total": {"rms_lx": 0.5, "rms_percent": 0.1}}}}})");
    std::string words = std::regex_replace(comparison_headline(comparison), std::regex("\u00a0"), " ");
    CHECK(words ==
          "On “desk”, the method differs from the reference by 1.2 % RMS and is 0.80 % too dark on average; "
          "at the worst place by "
          "−12 lx. The largest ingredient is truncation with 1.0 % RMS and a mean of −0.90 %. The "
          "reference's own error is 0.10 % RMS.");

    Json coarse = comparison;
    coarse["reference_error"]["sets"]["desk"]["total"]["rms_lx"] = 7;
    words = comparison_headline(coarse);
    CHECK(words.find("not resolved") != std::string::npos);
    CHECK(words.find("largest ingredient") == std::string::npos);  // none exceeds 7 lx and is resolved
}

TEST_CASE("a comparison without one of its parts still gives a report and figures", "[cli][report]") {
    const Json whole = sample();
    for (const auto& [key, value] : whole.items()) {
        INFO("without " << key);
        Json comparison = whole;
        comparison.erase(key);
        CHECK_NOTHROW(comparison_figures(comparison));
        CHECK(Json::parse(embedded(comparison_report(comparison))) == comparison);
        comparison[key] = nullptr;
        CHECK_NOTHROW(comparison_figures(comparison));
        CHECK_NOTHROW(comparison_report(comparison));
    }
    CHECK(comparison_figures(Json::object()).empty());
    CHECK(comparison_headline(Json::object()) == "The comparison holds no total error.");
    CHECK_NOTHROW(comparison_report(Json::object()));
}

TEST_CASE("a set of points without single values has its budget and no maps", "[cli][report]") {
    Json comparison = sample();
    comparison["sets"].push_back({{"id", "nodes"}, {"nodes", true}, {"points", 1800}});
    for (const char* part : {"total", "reference_error"})
        comparison[part]["sets"]["nodes"] = comparison[part]["sets"]["board"];
    for (Json& ingredient : comparison["ingredients"])
        ingredient["sets"]["nodes"] = ingredient["sets"]["board"];
    std::set<std::string> names;
    for (const auto& [name, svg] : comparison_figures(comparison))
        names.insert(name);
    CHECK(names.contains("budget_nodes.svg"));
    CHECK_FALSE(names.contains("maps_nodes.svg"));
    CHECK_FALSE(names.contains("histogram_nodes.svg"));
    CHECK(comparison_headline(comparison) ==
          comparison_headline(sample()));  // of points that can be looked at
}

TEST_CASE("points that stand in one line or alone have maps", "[cli][report]") {
    const std::size_t kept = GENERATE(std::size_t{1}, std::size_t{5});
    Json comparison = sample();
    Json few = Json::array();
    for (std::size_t k = 0; k < kept; ++k)
        few.push_back(comparison["points"][k]);
    comparison["points"] = few;
    const auto figures = comparison_figures(comparison);
    const auto map =
        std::ranges::find(figures, "maps_work_plane.svg", [](const auto& figure) { return figure.first; });
    REQUIRE(map != figures.end());
    CHECK_FALSE(std::regex_search(map->second, no_number));
    CHECK(count(map->second, "crispEdges") == 3 * kept);
}

TEST_CASE("a comparison without light or differences still has figures", "[cli][report]") {
    Json comparison = sample();
    for (Json& point : comparison["points"])
        for (const char* way : {"reference", "method", "again"})
            point[way] = {0, 0, 0, 0, 0};
    for (const auto& [name, svg] : comparison_figures(comparison)) {
        INFO(name);
        CHECK(name.find("histogram") == std::string::npos);  // no share of nothing
        CHECK_FALSE(std::regex_search(svg, no_number));
    }
}

TEST_CASE("every figure of a comparison has a name of its own and what it needs", "[cli][report]") {
    Json comparison = sample();
    std::set<std::string> names;
    for (const auto& [name, svg] : comparison_figures(comparison)) {
        INFO(name);
        CHECK(names.insert(name).second);
        CHECK(svg.rfind("<?xml", 0) == 0);
        CHECK(svg.find("<desc") != std::string::npos);
        CHECK_FALSE(std::regex_search(svg, no_number));
    }
    CHECK(names == std::set<std::string>{"budget_board.svg", "budget_work_plane.svg", "convergence.svg",
                                         "histogram_board.svg", "histogram_work_plane.svg", "maps_board.svg",
                                         "maps_work_plane.svg"});

    // Sets that differ by characters no file name keeps.
    comparison["sets"] = Json::parse(R"([{"id": "board"}, {"id": "Board!"}])");
    for (Json& point : comparison["points"])
        if (point["set"] == "work plane") point["set"] = "Board!";
    const auto figures = comparison_figures(comparison);
    CHECK(std::ranges::count_if(
              figures, [](const auto& figure) { return figure.first.starts_with("maps_board"); }) == 2);
    CHECK(figures[0].first != figures[3].first);
}

TEST_CASE("the total of the sample is the sum of its ingredients", "[cli][report]") {
    // The sample must be as consistent as a real comparison, or the page is judged by impossible figures.
    const Json comparison = sample();
    const auto& points = comparison["points"];
    for (std::size_t k = 0; k < points.size(); ++k) {
        double sum = 0.0;
        for (const Json& ingredient : comparison["ingredients"])
            sum += ingredient["total_lx"][k].get<double>();
        const double total = points[k]["method"][4].get<double>() - points[k]["reference"][4].get<double>();
        // Six digits of up to 23 000 lx twice, four of up to 100 lx eight times.
        CHECK(std::abs(sum - total) <= 2 * 0.05 + 8 * 0.005 + 1e-9);
    }
}
