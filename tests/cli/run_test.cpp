#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/catch.h"
#include "tests/cli/program.h"
#include "tests/cli/tables.h"

using namespace naturel::tests;

namespace {

/// Few rays and cells: the tests below look at files, not at accuracy. Each backend refuses what is for another.
std::vector<std::string> coarse(const std::string& backend) {
    if (backend == "hemicube") return {"--cells", "32"};
    if (backend == "embree") return {"--rays", "256", "--rays-per-point", "256"};
    return {"--rays", "256", "--rays-per-point", "256", "--cells", "32"};
}

class SmallRoom {
public:
    SmallRoom() { write(scene(), small_room); }

    std::string scene() const { return (folder_ / "room.json").string(); }
    std::filesystem::path out() const { return folder_ / "out"; }

    Outcome run(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), {"run", scene(), "--out", out().string()});
        const auto named = std::ranges::find(arguments, "--backend");
        const auto few = coarse(named == arguments.end() ? backend_names().back() : *(named + 1));
        arguments.insert(arguments.end(), few.begin(), few.end());
        return run_naturel(arguments);
    }

private:
    TemporaryFolder folder_;
};

const std::string point_columns =
    "x_m,y_m,z_m,nx,ny,nz,sky_lx,sun_lx,erc_lx,irc_lx,total_lx,total_r_lx,total_g_lx,total_b_lx,"
    "daylight_factor_percent";

}  // namespace

TEST_CASE("a run leaves every file of every backend, and nothing else", "[cli]") {
    const SmallRoom room;
    const auto backends = backend_names();
    const Outcome outcome = room.run({"--backend", backends.size() > 1 ? "both" : backends.front()});
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    const auto files = files_below(room.out());

    std::vector<std::string> expected{"zones.json"};
    for (const std::string& backend : backends)
        for (const char* name : {"nodes.csv", "patches.csv", "report.html", "scene.glb", "scene.vtp", "sensors.csv",
                                 "sensors/daylight_factor/work_plane.svg", "sensors/illuminance/work_plane.svg", "solution.bin",
                                 "summary.json", "timings.json",
                                 "views/to__window.exr", "views/to__window.png", "views/to__Window_2.exr",
                                 "views/to__Window_2.png"})
            expected.push_back(backend + "/" + name);
    if (backends.size() > 1) expected.push_back("hemicube_minus_embree.json");
    std::ranges::sort(expected);
    std::vector<std::string> found;
    for (const auto& [name, content] : files)
        found.push_back(name);
    CHECK(found == expected);

    for (const std::string& backend : backends) {
        INFO(backend);
        const auto sensors = lines_of(files.at(backend + "/sensors.csv"));
        const auto nodes = lines_of(files.at(backend + "/nodes.csv"));
        const auto patches = lines_of(files.at(backend + "/patches.csv"));
        CHECK(sensors.front() == "id,set," + point_columns + ",medium,erc_ground_lx,erc_buildings_lx");
        CHECK(nodes.front() == "id,face," + point_columns + ",erc_ground_lx,erc_buildings_lx");
        CHECK(patches.front() ==
              "id,face,area_m2,x_m,y_m,z_m,nx,ny,nz,reflectance_r,reflectance_g,reflectance_b,sky_lx,sun_lx,"
              "erc_lx,"
              "irc_lx,total_lx,total_r_lx,total_g_lx,total_b_lx,exitance_lm_m2,exitance_r_lm_m2,exitance_g_"
              "lm_m2,"
              "exitance_b_lm_m2,erc_ground_lx,erc_buildings_lx");
        for (const auto* table : {&sensors, &nodes, &patches})
            for (const std::string& line : *table)
                if (cells_of(line).size() != cells_of(table->front()).size()) FAIL_CHECK(line);
        CHECK(cells_of(sensors.back())[1] == "eye, \"left\"");

        const auto summary = nlohmann::json::parse(files.at(backend + "/summary.json"));
        CHECK(summary["backend"]["name"] == backend);
        CHECK(summary["scene"]["name"] == "small room");
        CHECK(summary["scene"]["sha256"].get<std::string>().size() == 64);
        CHECK(summary["counts"]["sensors"] == sensors.size() - 1);
        CHECK(summary["counts"]["nodes"] == nodes.size() - 1);
        CHECK(summary["outdoors"]["horizontal_illuminance_lx"].get<double>() == 10000.0);
        CHECK(summary["quality"]["radiosity"]["converged"] == true);
        // What comes in is absorbed or lost; the gap is what the iteration leaves, 1e-6 by default.
        CHECK(summary["quality"]["flux"]["relative_gap"].get<double>() < 1e-5);
        // Beside the "summary.json" itself, a summary names the files that belong to it.
        for (const auto& file : summary["files"]) {
            INFO(file);
            CHECK(files.contains(backend + "/" + file.get<std::string>()));
        }
        CHECK(summary["files"].size() + 1 == 15);
        CHECK(nlohmann::json::parse(files.at(backend + "/timings.json"))["threads"].get<int>() >= 1);
    }
}

TEST_CASE("the summary's statistics are those of the table of sensors", "[cli]") {
    const SmallRoom room;
    std::string scene(small_room);
    scene.insert(scene.find(R"({"id": "building")"), R"({"id": "opposite", "kind": "parallelepiped", "effect": "fill",
        "vertices": [[2, -6, 0], [8, -6, 0], [2, -5, 0], [2, -6, 4]], "material": "facade"}, )");
    write(room.scene(), scene);
    REQUIRE(room.run({"--backend", "hemicube"}).exit_code == 0);
    const auto summary = nlohmann::json::parse(content_of(room.out() / "hemicube/summary.json"));
    const auto lines = lines_of(content_of(room.out() / "hemicube/sensors.csv"));
    double sum_lx = 0.0, sum_factor = 0.0, least_factor = 1e300;
    std::map<std::string, double> component_sums;
    int points = 0;
    for (const std::string& line : lines) {
        const auto cells = cells_of(line);
        if (cells[1] != "work plane") continue;
        const double sky_lx = std::stod(cells[8]), sun_lx = std::stod(cells[9]),
                     erc_lx = std::stod(cells[10]), irc_lx = std::stod(cells[11]),
                     total_lx = std::stod(cells[12]), factor = std::stod(cells[16]);
        // Nine digits are printed.
        CHECK(std::abs(sky_lx + sun_lx + erc_lx + irc_lx - total_lx) <= 1e-7 * total_lx);
        CHECK(factor <= 100.0 * total_lx / 10000.0 * (1.0 + 1e-7));
        sum_lx += total_lx;
        component_sums["sky"] += sky_lx, component_sums["sun"] += sun_lx, component_sums["irc"] += irc_lx;
        component_sums["erc_ground"] += std::stod(cells[18]), component_sums["erc_buildings"] += std::stod(cells[19]);
        sum_factor += factor;
        least_factor = std::min(least_factor, factor);
        ++points;
    }
    REQUIRE(points > 0);
    const auto& set = summary["sensor_sets"][0];
    CHECK(set["points"] == points);
    CHECK(std::abs(set["illuminance_lx"]["mean"].get<double>() * points - sum_lx) <= 1e-7 * sum_lx);
    const auto& means = set["mean_components_lx"];
    CHECK(means.size() == component_sums.size());
    double all_lx = 0.0;
    for (const auto& [name, component_lx] : component_sums) {
        INFO(name);
        CHECK(std::abs(means.at(name).get<double>() * points - component_lx) <= 1e-7 * component_lx);
        all_lx += means.at(name).get<double>() * points;
    }
    CHECK(std::abs(all_lx - sum_lx) <= 1e-7 * sum_lx);
    CHECK(means["erc_ground"] == 0.0);  // a level plane below the sill sees no ground
    CHECK(means["erc_buildings"].get<double>() > 0.0);
    CHECK(summary["sensor_sets"][1]["mean_components_lx"]["erc_ground"].get<double>() > 0.0);
    CHECK(std::abs(set["daylight_factor_percent"]["mean"].get<double>() * points - sum_factor) <=
          1e-7 * sum_factor);
    CHECK(std::abs(set["daylight_factor_percent"]["min"].get<double>() - least_factor) <=
          1e-7 * least_factor);
}

TEST_CASE("files have the same bytes for any number of threads and on a second run", "[cli]") {
    const SmallRoom room;
    const auto backends = backend_names();
    std::map<std::string, std::string> first;
    for (const char* threads : {"1", "2", "3", "2"}) {
        INFO(threads << " threads");
        const Outcome outcome =
            room.run({"--backend", backends.size() > 1 ? "both" : backends.front(), "--threads", threads});
        INFO(outcome.errors);
        REQUIRE(outcome.exit_code == 0);
        auto files = files_below(room.out());
        for (const std::string& backend : backends)
            REQUIRE(files.erase(backend + "/timings.json") == 1);
        if (first.empty()) {
            first = files;
            // Time stamps count seconds: a second run in the same one would prove nothing about them.
            std::this_thread::sleep_for(std::chrono::milliseconds(1100));
        }
        REQUIRE(files.size() == first.size());
        for (const auto& [name, content] : files) {
            INFO(name);
            CHECK((content == first.at(name)));  // in brackets: the bytes of a picture are not for a screen
        }
    }
}

TEST_CASE("options replace what the scene says and are recorded", "[cli]") {
    const SmallRoom room;
    REQUIRE(room.run({"--backend", "hemicube", "--grid-spacing", "0.75", "--direct", "article", "--irc",
                      "patch", "--form-factor-repair", "none"})
                .exit_code == 0);
    const auto options = nlohmann::json::parse(content_of(room.out() / "hemicube/summary.json"))["options"];
    CHECK(options["grid_spacing_m"] == 0.75);
    CHECK(options["direct_method"] == "article");
    CHECK(options["sensor_irc"] == "patch");
    CHECK(options["form_factor_repair"] == "none");
}

TEST_CASE("a comparison says what was compared, and does not outlive the run it belongs to", "[cli]") {
    if (backend_names().size() < 2) return;
    const SmallRoom room;
    REQUIRE(room.run({"--backend", "both"}).exit_code == 0);
    const auto file = room.out() / "hemicube_minus_embree.json";
    const auto comparison = nlohmann::json::parse(content_of(file));
    for (const auto& [key, backend] : {std::pair{"backend", "hemicube"}, {"reference", "embree"}}) {
        const auto summary = nlohmann::json::parse(content_of(room.out() / backend / "summary.json"));
        CHECK(comparison[key] == summary["backend"]);
        CHECK(comparison["naturel"] == summary["naturel"]);
        CHECK(comparison["scene"] == summary["scene"]);
    }
    // Not even where the next run ends before it has results.
    REQUIRE(std::filesystem::exists(room.out() / "zones.json"));
    REQUIRE(room.run({"--backend", "hemicube", "--grid-spacing", "0.001"}).exit_code == 3);
    CHECK_FALSE(std::filesystem::exists(file));
    CHECK_FALSE(std::filesystem::exists(room.out() / "zones.json"));
}

TEST_CASE("sensors inside a solid have no values, and a run says so", "[cli]") {
    const SmallRoom room;
    std::string scene(small_room);
    const std::string points = "[[2, 3, 1.2, 0, -1, 0]]";
    scene.replace(scene.find(points), points.size(),
                  "[[2, 3, 1.2, 0, -1, 0], [2, 0.2, 0.5, 0, -1, 0], [2, -3, 0.5, 0, -1, 0]]");
    write(room.scene(), scene);
    const std::string warning = "of 3 points 1 inside a solid (left empty in sensors.csv), 1 outdoors";

    const Outcome outcome = room.run({"--backend", "hemicube"});
    REQUIRE(outcome.exit_code == 0);
    INFO(outcome.errors);
    CHECK(outcome.errors.find(warning) != std::string::npos);
    CHECK(outcome.errors.find("work plane") == std::string::npos);
    const auto lines = lines_of(content_of(room.out() / "hemicube/sensors.csv"));
    const std::size_t first = lines.size() - 3;
    const char* const media[] = {"indoor_air", "solid", "outdoor_air"};
    for (std::size_t k = 0; k < 3; ++k) {
        const auto cells = cells_of(lines[first + k]);
        REQUIRE(cells.size() == 20);
        CHECK(cells[17] == media[k]);
        for (std::size_t value = 8; value < 17; ++value)
            CHECK(cells[value].empty() == (k == 1));
    }
    CHECK(room.run({"--backend", "hemicube", "--quiet"}).errors.empty());
}

TEST_CASE("a run that does not converge writes its results and ends with exit code 4", "[cli]") {
    const SmallRoom room;
    const Outcome outcome = room.run({"--backend", "hemicube", "--max-iterations", "1"});
    CHECK(outcome.exit_code == 4);
    CHECK(outcome.output.find("NOT converged") != std::string::npos);
    const auto summary = nlohmann::json::parse(content_of(room.out() / "hemicube/summary.json"));
    CHECK(summary["quality"]["radiosity"]["converged"] == false);
}

TEST_CASE("a result file that cannot be replaced ends the run with exit code 3", "[cli]") {
    const SmallRoom room;
    const auto obstacle = room.out() / "hemicube/sensors.csv";
    std::filesystem::create_directories(obstacle);
    const Outcome outcome = room.run({"--backend", "hemicube"});
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.errors.find(obstacle.string()) != std::string::npos);
    CHECK(files_below(room.out()).empty());  // no temporary file, no summary
}

TEST_CASE("a run with views leaves no results where the module that writes pictures is missing", "[cli]") {
    const SmallRoom room;
    const TemporaryFolder folder;
    std::filesystem::copy_file(NATUREL_PROGRAM, folder / "naturel");
    for (const char* threads : {"1", "2"}) {
        const Outcome outcome = run_naturel({"run", room.scene(), "--out", room.out().string(), "--threads", threads}, folder / "naturel");
        INFO(outcome.errors);
        CHECK(outcome.exit_code == 1);
        CHECK(outcome.errors.find("cannot load the writer of pictures") != std::string::npos);
        CHECK(files_below(room.out()).empty());
    }
}

TEST_CASE("a signal stops a run with exit code 130 and no half-written file", "[cli]") {
    const SmallRoom room;
    const int signal = GENERATE(SIGINT, SIGTERM);
    // Enough work for minutes.
    RunningProgram program({"run", room.scene(), "--out", room.out().string(), "--backend", "hemicube",
                            "--grid-spacing", "0.05", "--cells", "1024"});
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!std::filesystem::exists(room.out() / "hemicube/views") &&
           std::chrono::steady_clock::now() < deadline)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    program.send(signal);
    const Outcome outcome = program.wait();
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 130);
    CHECK(outcome.errors == "naturel: interrupted\n");
    CHECK(files_below(room.out()).empty());
}
