#include <algorithm>
#include <cmath>
#include <functional>
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
    for (const auto& [option, value] : {std::pair{"--target-error", "0.01"}, {"--rays-per-point", "512"}}) {
        const Outcome outcome = room.run({"--form-factors", "pairwise", option, value});
        CHECK(outcome.exit_code == 2);
        CHECK(outcome.errors.find("--form-factors hemisphere") != std::string::npos);
    }
    const Outcome most = room.run({"--most-rays", "4096"});
    CHECK(most.exit_code == 2);
    CHECK(most.errors.find("--target-error") != std::string::npos);
    const Outcome fewer = room.run({"--target-error", "0.01", "--rays", "4096", "--most-rays", "1024"});
    CHECK(fewer.exit_code == 2);
    CHECK(fewer.errors.find("1024 are fewer than the 4096 rays") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(room.folder / "out"));
}

TEST_CASE("options of another backend are refused with the name of their own", "[cli][quality]") {
    const Room room;
    struct Foreign {
        const char* backend;
        std::vector<std::string> option;
        const char* owner;
    };
    const std::vector<Foreign> all{{"hemicube", {"--form-factors", "pairwise"}, "embree"}, {"hemicube", {"--pair-tolerance", "1e-3"}, "embree"},
                                   {"hemicube", {"--rays", "512"}, "embree"}, {"hemicube", {"--target-error", "0.01"}, "embree"},
                                   {"hemicube", {"--most-rays", "512"}, "embree"}, {"embree", {"--cells", "64"}, "hemicube"},
                                   {"embree", {"--projection", "hemicube"}, "hemicube"}, {"embree", {"--viewpoints", "4"}, "hemicube"},
                                   {"embree", {"--fixed-rotation"}, "hemicube"}, {"embree", {"--rim", "strip"}, "hemicube"},
                                   {"embree", {"--spacing", "uniform"}, "hemicube"}, {"embree", {"--half-side-over-height", "14"}, "hemicube"}};
    for (const Foreign& foreign : all) {
        for (const char* command : {"run", "check", "formfactors", "timing"}) {
            INFO(command << ' ' << foreign.backend << ' ' << foreign.option[0]);
            std::vector<std::string> arguments{command, (room.folder / "room.json").string(), "--backend", foreign.backend};
            arguments.insert(arguments.end(), foreign.option.begin(), foreign.option.end());
            const Outcome outcome = run_naturel(arguments);
            CHECK(outcome.exit_code == 2);
            CHECK(outcome.errors.find(foreign.option[0] + ": is for the backend " + foreign.owner) != std::string::npos);
        }
    }
    CHECK(run_naturel({"formfactors", (room.folder / "room.json").string(), "--rays-per-point", "512"}).exit_code == 2);
    // Both backends, each with its own.
    CHECK(room.run({"--backend", "both", "--rays", "512", "--cells", "64", "--dry-run"}).exit_code == 0);
    CHECK(room.run({"--backend", "hemicube", "--quality", "reference", "--dry-run"}).exit_code == 0);
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

TEST_CASE("no setting of a finer preset is coarser, in rooms of any size", "[cli][quality]") {
    // Numbers of the table in --help, where smaller or larger is finer.
    const std::string help = run_naturel({"run", "--help"}).output;
    const auto numbers = [&](const std::string& row) {
        const std::size_t at = help.find("  " + row + " ", help.find("\nQuality"));
        REQUIRE(at != std::string::npos);
        std::istringstream line(help.substr(at + 2 + row.size(), help.find('\n', at) - at - 2 - row.size()));
        std::vector<double> values;
        for (double value = 0.0; line >> value;) values.push_back(value);
        REQUIRE(values.size() == 4);
        return values;
    };
    for (const char* row : {"grid indoors, m", "grid outdoors, m", "direct light, tolerance", "radiosity, tolerance", "  pairwise: tolerance"}) {
        INFO(row);
        CHECK(std::ranges::is_sorted(numbers(row), std::greater()));
    }
    for (const char* row : {"  but patches at most about", "  hemisphere: rays per patch", "  and rays per point", "hemicube: cells along side"}) {
        INFO(row);
        CHECK(std::ranges::is_sorted(numbers(row)));
    }

    const TemporaryFolder folder;
    // From a closet to a hall; the reference takes pairs up to 156 m2: 144 m2 at 6 m, 182 m2 at 7 m.
    for (const int side_m : {2, 5, 6, 7, 20, 60}) {
        INFO("a room of " << side_m << " m");
        const int end_m = side_m + 1;
        std::ostringstream text;
        text << R"({"naturel": 1, "materials": {"w": {"reflectance": 0.5}}, "polyhedra": [
            {"id": "shell", "kind": "parallelepiped", "effect": "fill", "material": "w",
             "vertices": [[0, 0, 0], [)" << end_m + 1 << R"(, 0, 0], [0, )" << end_m + 1 << R"(, 0], [0, 0, 5]]},
            {"id": "room", "kind": "parallelepiped", "effect": "carve", "material": "w",
             "vertices": [[1, 1, 1], [)" << end_m << R"(, 1, 1], [1, )" << end_m << R"(, 1], [1, 1, 4]]}],
            "sky": {"model": "uniform", "horizontal_illuminance_lx": 10000}, "grid": {"zones": false}})";
        write(folder / "room.json", text.str());
        double coarser_m = 1e9, fewer_rays = 0.0;
        for (const std::string quality : {"draft", "normal", "fine", "reference"}) {
            const std::string told = run_naturel({"formfactors", (folder / "room.json").string(), "--quality", quality, "--dry-run"}).output;
            INFO(told);
            const auto number_after = [&](const std::string& word) {
                REQUIRE(told.find(word) != std::string::npos);
                return std::stod(told.substr(told.find(word) + word.size()));
            };
            const double spacing_m = number_after(", grid ");
            CHECK(spacing_m <= coarser_m);
            coarser_m = spacing_m;
            if (backend_names().back() != "embree") continue;
            const bool pairs = told.find("form_factors pairwise") != std::string::npos;
            CHECK(pairs == (quality == "reference" && side_m <= 6));
            if (pairs) continue;
            CHECK(number_after("rays_per_patch ") > fewer_rays);
            fewer_rays = number_after("rays_per_patch ");
        }
    }
#ifdef NATUREL_HAS_EMBREE
    // Who asks for pairs gets them.
    for (const char* option : {"--form-factors=pairwise", "--pair-tolerance=1e-4"})
        CHECK(run_naturel({"formfactors", (folder / "room.json").string(), "--quality", "reference", option, "--dry-run"})
                  .output.find("form_factors pairwise") != std::string::npos);
#endif
}
