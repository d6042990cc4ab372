#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

/// The small room in a folder of its own. With `named` its file says how long cells are, else the preset does.
struct Room {
    explicit Room(bool named = true) {
        std::string text(small_room);
        const std::string spacing = "\"grid\": {\"spacing_m\": 1},";
        if (!named) text.erase(text.find(spacing), spacing.size());
        write(folder / "room.json", text);
    }
    Outcome run(std::vector<std::string> arguments, const std::string& out = "out") const {
        arguments.insert(arguments.begin(), {"run", (folder / "room.json").string(), "--out", (folder / out).string()});
        return run_naturel(arguments);
    }
    nlohmann::json summary(const std::string& out = "out") const {
        return nlohmann::json::parse(content_of(folder / out / backend_names().back() / "summary.json"));
    }
    /// Illuminance of every sensor.
    std::vector<double> total_lx(const std::string& out) const {
        std::istringstream table(content_of(folder / out / backend_names().back() / "sensors.csv"));
        std::string line;
        std::getline(table, line);
        std::vector<double> values;
        while (std::getline(table, line)) {
            // Counted from the end: an id may hold commas.
            std::vector<std::string> cells;
            std::istringstream row(line);
            for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
            values.push_back(std::stod(cells[cells.size() - 6]));
        }
        return values;
    }

    TemporaryFolder folder;
};

}  // namespace

TEST_CASE("a preset chooses what neither the scene nor the command line names", "[cli][quality]") {
    const Room unnamed(false), named(true);
    REQUIRE(unnamed.run({"--quality", "draft", "--radiosity-tolerance", "1e-7", "--no-error-estimate"}).exit_code == 0);
    const auto chosen = unnamed.summary();
    CHECK(chosen["options"]["quality"] == "draft");
    CHECK(chosen["options"]["grid_spacing_m"] == 0.5);
    CHECK(chosen["options"]["direct_tolerance"] == 0.01);
    CHECK(chosen["options"]["radiosity_tolerance"] == 1e-7);
    CHECK(chosen["estimated_error"].is_null());
    REQUIRE(named.run({"--quality", "draft", "--tolerance", "0.1", "--no-error-estimate"}).exit_code == 0);
    CHECK(named.summary()["options"]["grid_spacing_m"] == 1.0);
    CHECK(named.summary()["options"]["direct_tolerance"] == 0.1);
}

TEST_CASE("an unknown quality is answered with the known ones", "[cli][quality]") {
    const Outcome outcome = Room().run({"--quality", "best"});
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.errors.find("known: draft, normal, fine, reference") != std::string::npos);
}

TEST_CASE("a dry run tells what would be done and writes nothing", "[cli][quality]") {
    const Room room(false);
    const Outcome outcome = room.run({"--dry-run", "--quality", "fine"});
    REQUIRE(outcome.exit_code == 0);
    for (const char* part : {"quality fine", "grid 0.125 m indoors", "facets", "nodes", "sensors", "memory at most", "work:", "time about"})
        CHECK(outcome.output.find(part) != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(room.folder / "out"));
}

TEST_CASE("19 sensors of 20 are within the estimated error, and it is not many times as large", "[cli][quality]") {
    const Room room(false);
    REQUIRE(room.run({"--quality", "normal", "--rays", "2048", "--seed", "50", "--no-error-estimate", "--backend", backend_names().back()}, "finer")
                .exit_code == 0);
    const std::vector<double> truth = room.total_lx("finer");
    REQUIRE(truth.size() > 3);
    std::size_t sensors = 0, within = 0;
    for (int seed = 1; seed <= 4; ++seed) {
        REQUIRE(room.run({"--quality", "draft", "--seed", std::to_string(seed), "--backend", backend_names().back()}).exit_code == 0);
        const std::vector<double> found = room.total_lx("out");
        REQUIRE(found.size() == truth.size());
        // Here cells of draft are so large that no coarser grid would differ: the grid part comes from a finer one.
        CHECK_FALSE(room.summary()["estimated_error"]["grid"].is_null());
        const double estimated = room.summary()["estimated_error"]["relative_error"];
        double squares = 0.0;
        for (std::size_t k = 0; k < found.size(); ++k) {
            const double error = std::abs(found[k] / truth[k] - 1.0);
            squares += error * error;
            ++sensors;
            within += error <= estimated;
        }
        // 95 % of a normal distribution are below twice its RMS; a few sensors tell their noise within a half, and the estimate is on
        // the safe side of that.
        CHECK(estimated < 6.0 * std::sqrt(squares / static_cast<double>(found.size())));
    }
    INFO(within << " of " << sensors);
    CHECK(20 * within >= 19 * sensors);
}

TEST_CASE("the estimated error has the same bits for any number of threads", "[cli][quality]") {
    const Room room;
    REQUIRE(room.run({"--quality", "draft", "--threads", "1"}, "one").exit_code == 0);
    REQUIRE(room.run({"--quality", "draft", "--threads", "3"}, "three").exit_code == 0);
    CHECK_FALSE(room.summary("one")["estimated_error"].is_null());
    CHECK(room.summary("one") == room.summary("three"));
}

#ifdef NATUREL_HAS_EMBREE
TEST_CASE("the reference takes pairs of patches, and says so", "[cli][quality]") {
    const Room room;
    REQUIRE(room.run({"--quality", "reference", "--node-irc", "patch", "--pair-tolerance", "1e-3", "--no-error-estimate"})
                .exit_code == 0);
    const auto settings = room.summary()["backend"]["settings"];
    CHECK(settings["form_factors"] == "pairwise");
    CHECK(settings["pair_tolerance"] == "0.001");
    REQUIRE(room.run({"--quality", "draft", "--no-error-estimate"}).exit_code == 0);
    CHECK(room.summary()["backend"]["settings"]["form_factors"] == "hemisphere");
}

TEST_CASE("options that the method of form factors would ignore are refused", "[cli][quality]") {
    const Room room;
    const Outcome rays = room.run({"--quality", "reference", "--rays", "256"});
    CHECK(rays.exit_code == 2);
    CHECK(rays.errors.find("--form-factors hemisphere") != std::string::npos);
    const Outcome tolerance = room.run({"--pair-tolerance", "1e-3"});
    CHECK(tolerance.exit_code == 2);
    CHECK(tolerance.errors.find("--form-factors pairwise") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(room.folder / "out"));
}
#endif

TEST_CASE("check forecasts what a run takes, more for a finer quality", "[cli][quality]") {
    const Room room(false);
    const auto forecast = [&](const std::string& quality) {
        const Outcome outcome = run_naturel({"check", (room.folder / "room.json").string(), "--quality", quality});
        REQUIRE(outcome.exit_code == 0);
        const std::string start = "quality " + quality + ": memory up to about ";
        const std::size_t at = outcome.output.find(start);
        REQUIRE(at != std::string::npos);
        CHECK(outcome.output.find("of one core", at) != std::string::npos);
        return std::stod(outcome.output.substr(at + start.size()));  // MB
    };
    CHECK(forecast("normal") > forecast("draft"));
    CHECK(forecast("fine") > forecast("normal"));
}

TEST_CASE("without zones in the grid a run neither finds nor writes them", "[cli][quality]") {
    const Room room;
    std::string text = content_of(room.folder / "room.json");
    const std::string spacing = "\"grid\": {\"spacing_m\": 1}";
    text.replace(text.find(spacing), spacing.size(), "\"grid\": {\"spacing_m\": 1, \"zones\": false}");
    REQUIRE(room.run({"--quality", "draft", "--no-error-estimate"}, "with").exit_code == 0);
    write(room.folder / "room.json", text);
    REQUIRE(room.run({"--quality", "draft", "--no-error-estimate"}, "without").exit_code == 0);
    const auto has_zones = [&](const std::string& out) {
        const auto stages = nlohmann::json::parse(content_of(room.folder / out / backend_names().back() / "timings.json"))["stages"];
        const bool found = std::ranges::any_of(stages, [](const auto& stage) { return stage["stage"] == "zones"; });
        CHECK(found == std::filesystem::exists(room.folder / out / "zones.json"));
        return found;
    };
    CHECK(has_zones("with"));
    CHECK_FALSE(has_zones("without"));
}
