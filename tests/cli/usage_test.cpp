#include <algorithm>

#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

/// A message is for people: it starts with the program's name and fits on a line or two.
void check_failure(const Outcome& outcome, int exit_code, const std::string& message) {
    INFO("stdout: " << outcome.output << "\nstderr: " << outcome.errors);
    CHECK(outcome.exit_code == exit_code);
    CHECK(outcome.output.empty());
    CHECK(outcome.errors.starts_with("naturel: "));
    CHECK(outcome.errors.find(message) != std::string::npos);
    CHECK(std::ranges::count(outcome.errors, '\n') <= 2);
}

}  // namespace

TEST_CASE("help names every command and option on stdout", "[cli]") {
    const Outcome general = run_naturel({"--help"});
    CHECK(general.exit_code == 0);
    CHECK(general.errors.empty());
    for (const char* word : {"run", "check", "formfactors", "zones", "sky", "--version"}) {
        INFO(word);
        CHECK(general.output.find(word) != std::string::npos);
    }
    const Outcome run = run_naturel({"run", "--help"});
    CHECK(run.exit_code == 0);
    for (const char* word :
         {"--backend", "--out", "--threads", "--seed", "--quiet", "--irc", "--form-factor-repair", "--form-factors", "--pair-tolerance", "--rays",
          "--rays-per-point", "--projection", "--cells", "--half-side-over-height", "--spacing",
          "--fixed-rotation", "--grid-spacing", "--direct", "--tolerance"}) {
        INFO(word);
        CHECK(run.output.find(word) != std::string::npos);
    }
}

TEST_CASE("the version names the program and its backends", "[cli]") {
    const Outcome outcome = run_naturel({"--version"});
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.output.starts_with("naturel "));
    for (const std::string& backend : backend_names()) {
        INFO(backend);
        CHECK(outcome.output.find(backend) != std::string::npos);
    }
}

TEST_CASE("wrong usage ends with exit code 2 and says what would be right", "[cli]") {
    check_failure(run_naturel({}), 2, "known: run, render, check, formfactors, compare, timing, zones, sky, batch, merge");
    check_failure(run_naturel({"paint"}), 2, "unknown command \"paint\" (known: run, render, check, formfactors, compare, timing, zones, sky, batch, merge)");
    check_failure(run_naturel({"run"}), 2, "SCENE is required");
    check_failure(run_naturel({"run", "room.json", "--backend", "crystal_ball"}), 2,
                  "unknown backend \"crystal_ball\" (known: hemicube");
    check_failure(run_naturel({"run", "room.json", "--threads", "0"}), 2, "--threads");
    check_failure(run_naturel({"run", "room.json", "--tolerance", "nan"}), 2, "--tolerance");
    check_failure(run_naturel({"run", "room.json", "--viewpoints", "0"}), 2, "\"0\" is not a whole number from 1 to 4096");
    check_failure(run_naturel({"run", "room.json", "--seed", "-1"}), 2, "--seed");
    check_failure(run_naturel({"run", "room.json", "--seed", "99999999999999999999999"}), 2,
                  "from 0 to 18446744073709551615");
    check_failure(run_naturel({"run", "room.json", "--rays", "100000001"}), 2, "from 1 to 100000000");
    check_failure(run_naturel({"run", "room.json", "--rays-per-point", "100000001"}), 2, "from 1 to 100000000");
    check_failure(run_naturel({"run", "room.json", "--half-side-over-height", "0.09"}), 2, "its rim");
    check_failure(run_naturel({"run", "room.json", "--irc", "guess"}), 2,
                  "unknown word \"guess\" (known: patch, gather)");
    check_failure(run_naturel({"run", "room.json", "--colour"}), 2, "--colour");
}

TEST_CASE("a scene that cannot be read ends with exit code 3 and leaves no output folder", "[cli]") {
    const TemporaryFolder folder;
    const std::string out = (folder / "out").string();
    const std::string missing = (folder / "missing.json").string();
    check_failure(run_naturel({"run", missing, "--out", out}), 3, "missing.json");
    check_failure(run_naturel({"check", missing}), 3, "missing.json");
    check_failure(run_naturel({"run", folder.path().string(), "--out", out}), 3, folder.path().string());

    const std::string broken = (folder / "broken.json").string();
    write(broken, "{ \"naturel\": 1,\n  \"name\": }");
    check_failure(run_naturel({"run", broken, "--out", out}), 3, "broken.json:2:");

    const std::string misspelt = (folder / "misspelt.json").string();
    write(misspelt, "{ \"naturel\": 1, \"materails\": {} }");
    check_failure(run_naturel({"run", misspelt, "--out", out}), 3, "materails");
    CHECK_FALSE(std::filesystem::exists(out));
}

TEST_CASE("an output folder that cannot be written is refused before anything is computed", "[cli]") {
    const TemporaryFolder folder;
    write(folder / "room.json", small_room);
    write(folder / "file", "keep me");
    const std::string scene = (folder / "room.json").string();
    const std::string below_a_file = (folder / "file/out").string();
    check_failure(run_naturel({"run", scene, "--out", below_a_file}), 3, below_a_file);
    check_failure(run_naturel({"run", scene, "--out", (folder / "file").string()}), 3,
                  (folder / "file").string());
    CHECK(content_of(folder / "file") == "keep me");
}

TEST_CASE("a grid too fine for any machine is refused", "[cli]") {
    const TemporaryFolder folder;
    write(folder / "room.json", small_room);
    check_failure(run_naturel({"run", (folder / "room.json").string(), "--out", (folder / "out").string(),
                               "--grid-spacing", "0.001"}),
                  3, "\"spacing_m\" of \"grid\" larger");
}

TEST_CASE("no command writes over the scene that it reads", "[cli]") {
    struct Danger {
        std::string scene;                   // its name
        std::vector<std::string> arguments;  // OUT stands for the folder of the scene
    };
    std::vector<Danger> dangers{{"zones.json", {"zones", "OUT/zones.json", "--out", "OUT"}},
                                {"zones.json", {"zones", "OUT/zones.json", "--svg", "--out", "OUT"}},
                                {"floor_1_plan.svg", {"zones", "OUT/floor_1_plan.svg", "--svg", "--out", "OUT"}},
                                {"sky.png", {"sky", "OUT/sky.png", "--out", "OUT"}},
                                {"zones.json", {"run", "OUT/zones.json", "--out", "OUT"}},
                                {"trace.json", {"run", "OUT/trace.json", "--out", "OUT/run", "--trace", "OUT/trace.json"}},
                                {"timing.json", {"timing", "OUT/timing.json", "--out", "OUT"}}};
    for (const std::string& backend : backend_names())
        dangers.push_back({backend + "/summary.json", {"run", "OUT/" + backend + "/summary.json", "--out", "OUT", "--backend", backend}});
    if (backend_names().size() > 1) {
        dangers.push_back({"hemicube_minus_embree.json", {"run", "OUT/hemicube_minus_embree.json", "--out", "OUT"}});
        dangers.push_back({"comparison.json", {"compare", "OUT/comparison.json", "--out", "OUT"}});
        dangers.push_back({"points.csv", {"compare", "OUT/points.csv", "--out", "OUT", "--no-sweeps", "--quality", "draft"}});
    }
    for (const Danger& danger : dangers) {
        const TemporaryFolder folder;
        std::filesystem::create_directories((folder / danger.scene).parent_path());
        write(folder / danger.scene, small_room);
        std::vector<std::string> arguments = danger.arguments;
        for (std::string& argument : arguments)
            if (argument.starts_with("OUT")) argument.replace(0, 3, folder.path().string());
        INFO(danger.arguments[0] << ' ' << danger.scene);
        check_failure(run_naturel(arguments), 3, "would be written over it");
        CHECK(files_below(folder.path()) == std::map<std::string, std::string>{{danger.scene, std::string(small_room)}});
    }
}

TEST_CASE("a number that is not whole is answered with the range", "[cli]") {
    check_failure(run_naturel({"run", "room.json", "--rays", "1e3"}), 2, "\"1e3\" is not a whole number of rays from 1 to 100000000");
    check_failure(run_naturel({"formfactors", "room.json", "--cells", "64.5"}), 2, "\"64.5\" is not a whole number from 1 to 4096");
    check_failure(run_naturel({"run", "room.json", "--threads", "2.0"}), 2, "\"2.0\" is not a whole number from 1 to 1024");
}
