#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

#ifdef NATUREL_HAS_EMBREE

TEST_CASE("compare writes a budget whose parts add up, the same for any number of threads", "[cli][compare]") {
    const TemporaryFolder folder;
    write(folder / "room.json", small_room);
    const auto run = [&](const std::string& threads) {
        const std::string out = (folder / ("study" + threads)).string();
        const Outcome outcome = run_naturel({"compare", (folder / "room.json").string(), "--out", out, "--quiet", "--no-sweeps",
                                             "--grid-spacing", "1", "--threads", threads});
        INFO(outcome.errors);
        REQUIRE(outcome.exit_code == 0);
        CHECK(outcome.output.find("all together") != std::string::npos);
        CHECK(outcome.output.find("reference's own") != std::string::npos);
        return files_below(out);
    };
    const auto files = run("1");
    for (const char* name : {"comparison.json", "points.csv", "ingredients.csv", "patches.csv"}) CHECK(files.count(name) == 1);
    const auto json = nlohmann::json::parse(files.at("comparison.json"));
    REQUIRE(json.at("points").size() > 0);
    for (std::size_t p = 0; p < json.at("points").size(); ++p) {
        const auto& point = json.at("points")[p];
        double sum = 0.0;
        for (const auto& ingredient : json.at("ingredients")) sum += ingredient.at("total_lx")[p].get<double>();
        const double reference = point.at("reference")[4], method = point.at("method")[4];  // total
        CHECK(std::abs(sum - (method - reference)) <= 1e-9 * (1.0 + reference));  // rounding
        CHECK(reference > 0.0);
    }
    // What the machine and its threads are is told in comparison.json, and differs; the tables must not.
    const auto again = run("2");
    for (const char* name : {"points.csv", "ingredients.csv", "patches.csv"}) CHECK(files.at(name) == again.at(name));
}

TEST_CASE("compare asks for sensors", "[cli][compare]") {
    const TemporaryFolder folder;
    auto scene = nlohmann::json::parse(small_room, nullptr, true, true);
    scene.erase("sensors");
    write(folder / "room.json", scene.dump());
    const Outcome outcome = run_naturel({"compare", (folder / "room.json").string(), "--out", (folder / "study").string()});
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.errors.find("/sensors") != std::string::npos);
    CHECK(files_below(folder / "study").empty());
}

#endif
