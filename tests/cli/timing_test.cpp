#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "cli/timing_report.h"
#include "cli/timing_study.h"
#include "cli/timing_writer.h"
#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel;
using namespace naturel::tests;

namespace {

using Json = nlohmann::json;

MeasuredRun a_run(int threads, std::size_t repeat, double wall_s, double cpu_s) {
    return {.backend = "embree", .threads = threads, .repeat = repeat,
            .stages = {{"form factors", 0.8 * wall_s, 0.8 * cpu_s, threads, 1e6, "rays"}, {whole_run, wall_s, cpu_s, threads}},
            .patches = 100, .load = ForeignLoad{}};
}

/// Two threads take half the time of one, on a machine that slows down to a half meanwhile.
TimingStudy drifting_study(std::size_t repeats) {
    TimingStudy study;
    study.scene = "room.json";
    study.machine.processors = study.machine.usable_processors = 2;
    study.machine.load = 0.0;
    study.threads = {1, 2};
    study.repeats = repeats;
    for (std::size_t k = 0; k < repeats; ++k) {
        const double drift = 1.0 + static_cast<double>(k) / static_cast<double>(repeats);
        study.runs.push_back(a_run(1, k, 2.0 * drift, 2.0 * drift));
        study.runs.push_back(a_run(2, k, 1.0 * drift, 2.2 * drift));
    }
    return study;
}

bool warns_of(const TimingStudy& study, const std::string& words) {
    return std::ranges::any_of(timing_figures(study).warnings, [&](const std::string& warning) { return warning.find(words) != std::string::npos; });
}

/// A folder that looks like a system.
class FakeSystem {
public:
    FakeSystem() {
        file("proc/cpuinfo", "processor\t: 0\nmodel name\t: Example 9000\nmodel\t\t: 1\ncpu MHz\t\t: 2400.5\nflags\t\t: fpu avx2 sse4_2 hypervisor\n");
        file("proc/loadavg", "3.25 1.00 0.50 1/200 12345\n");
        file("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
    }
    void file(const std::string& name, const std::string& text) const {
        std::filesystem::create_directories((folder_ / name).parent_path());
        write(folder_ / name, text);
    }
    const std::filesystem::path& root() const { return folder_.path(); }

private:
    TemporaryFolder folder_;
};

std::vector<std::string> with_room(const TemporaryFolder& folder, std::vector<std::string> arguments) {
    Json room = Json::parse(small_room);
    room.erase("views");  // pictures are not what is tested, and the module that writes them takes its time to load
    write(folder / "room.json", room.dump());
    arguments.insert(arguments.begin() + 1, (folder / "room.json").string());
    for (const char* argument : {"--quality", "draft", "--no-error-estimate"}) arguments.emplace_back(argument);
    return arguments;
}

std::size_t lines_of(const std::string& text) {
    return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

}  // namespace

TEST_CASE("the interval of a median covers the truth as often as it says", "[cli][timing][analytic]") {
    // Of the exponential distribution, skewed as times are, the median is ln 2. With 150 samples 95 % scatter by 1.8 %.
    const std::size_t repeats = GENERATE(7u, 12u);
    constexpr int samples = 150;
    std::mt19937_64 random(repeats);
    std::exponential_distribution<double> times(1.0);
    int covered = 0;
    double width = 0.0;
    for (int s = 0; s < samples; ++s) {
        std::vector<double> values(repeats);
        for (double& value : values) value = times(random);
        const Estimate found = bootstrap(repeats, [&](std::span<const std::size_t> chosen) {
            std::vector<double> drawn;
            for (const std::size_t k : chosen) drawn.push_back(values[k]);
            return median(std::move(drawn));
        });
        REQUIRE(found.interval);
        CHECK(found.interval->low <= found.value);
        CHECK(found.value <= found.interval->high);
        covered += found.interval->low <= std::log(2.0) && std::log(2.0) <= found.interval->high;
        width += (found.interval->high - found.interval->low) / samples;
    }
    INFO(repeats << " repeats, covered " << covered << ", mean width " << width);
    CHECK(covered >= samples * (0.95 - 3 * 0.018));
    CHECK(width < 4.0 / std::sqrt(static_cast<double>(repeats)) * 1.96);  // a normal approximation has 2 x 1.96 / sqrt(n)
}

TEST_CASE("one repeat has no interval, a median of an even number is between", "[cli][timing]") {
    const Estimate one = bootstrap(1, [](auto) { return 3.0; });
    CHECK(one.value == 3.0);
    CHECK_FALSE(one.interval);
    CHECK(median({4.0, 1.0, 2.0, 10.0}) == 3.0);
    CHECK(median({4.0, 1.0, 2.0}) == 2.0);
}

TEST_CASE("Amdahl's law is found in times that follow it", "[cli][timing][analytic]") {
    const double serial = GENERATE(0.0, 0.05, 0.4, 1.0, -0.1);
    const std::vector<int> threads{1, 2, 4, 8};
    std::vector<double> seconds;
    for (const int p : threads) seconds.push_back(3.0 * (serial + (1.0 - serial) / p));
    CHECK(std::abs(serial_fraction(threads, seconds) - serial) < 1e-12);  // rounding
    for (std::size_t k = 1; k < threads.size(); ++k) CHECK(std::abs(karp_flatt(threads[k], seconds[0] / seconds[k]) - serial) < 1e-12);
    CHECK(std::isnan(serial_fraction(std::vector{2}, std::vector{1.0})));
}

TEST_CASE("a speed-up does not depend on what drifts from repeat to repeat", "[cli][timing]") {
    const TimingFigures figures = timing_figures(drifting_study(7));
    const auto row = std::ranges::find_if(figures.stages, [](const StageFigures& f) { return f.stage == whole_run && f.threads == 2; });
    REQUIRE(row != figures.stages.end());
    REQUIRE(row->wall_s.interval);
    CHECK(row->wall_s.interval->high > 1.3 * row->wall_s.interval->low);
    REQUIRE(row->speed_up);
    for (const double value : {row->speed_up->value, row->speed_up->interval->low, row->speed_up->interval->high})
        CHECK(std::abs(value - 2.0) < 1e-12);
    CHECK(std::abs(row->efficiency->value - 1.0) < 1e-12);
    CHECK(std::abs(row->karp_flatt->value) < 1e-12);
    for (const double value : {row->cpu_ratio->value, row->cpu_ratio->interval->low, row->cpu_ratio->interval->high})
        CHECK(std::abs(value - 1.1) < 1e-12);
    REQUIRE(figures.serial.size() == 2);
    CHECK(std::abs(figures.serial.back().fraction.value) < 1e-12);
    CHECK(figures.warnings.empty());
    const StageFigures& form_factors = figures.stages.front();
    CHECK(form_factors.threads == 1);
    CHECK(std::abs(form_factors.share - 0.8) < 1e-12);
    CHECK(std::abs(form_factors.work_per_s.value - 1e6 / form_factors.wall_s.value) < 1e-3);
    CHECK_FALSE(form_factors.speed_up);
}

TEST_CASE("a study warns of what spoils it", "[cli][timing]") {
    const TimingStudy quiet = drifting_study(7);
    TimingStudy study = quiet;
    study.machine.load = 2.5;
    CHECK(warns_of(study, "loaded before the first run: 2.5 tasks"));
    study = quiet;
    study.runs[3].load = ForeignLoad{.others = 0.3, .stolen = 0.02};
    CHECK(warns_of(study, "during 1 of 14 runs other processes took more than 5 % of all processor time, up to 30 %"));
    CHECK(warns_of(study, "during 1 of 14 runs the host"));
    study = quiet;
    study.runs[5].load.reset();
    CHECK(warns_of(study, "not known for 1 of 14 runs"));
    study = quiet;
    study.runs[1].stages.back().threads_that_worked = 1;
    CHECK(warns_of(study, "2 threads were asked for, but in 1 runs fewer worked: 1"));
    study = quiet;
    study.machine.usable_processors = 1;
    CHECK(warns_of(study, "2 threads were asked for, and this process may use 1 processors"));
    study.machine.usable_processors = 2;
    study.machine.quota = 1.5;
    CHECK(warns_of(study, "may use 1.5 processors (quota"));
    CHECK(warns_of(drifting_study(5), "5 repeats are too few"));
    CHECK_FALSE(warns_of(drifting_study(6), "too few"));
}

TEST_CASE("results that differ between two runs are found", "[cli][timing]") {
    MeasuredRun one = a_run(1, 0, 1.0, 1.0), two = a_run(2, 0, 1.0, 1.0);
    one.hashes = two.hashes = {{"embree/nodes.csv", "a"}, {"embree/sensors.csv", "b"}};
    CHECK(first_difference(one, two).empty());
    two.hashes["embree/sensors.csv"] = "c";
    CHECK(first_difference(one, two) == "embree with 1 threads (repeat 1) and with 2 threads (repeat 1): embree/sensors.csv differs");
    two.hashes = one.hashes;
    two.hashes["zones.json"] = "d";
    CHECK(first_difference(one, two).ends_with("zones.json was written by the second only"));
    CHECK(first_difference(two, one).ends_with("zones.json was written by the first only"));
}

TEST_CASE("a machine is described by what its system says", "[cli][timing]") {
    const FakeSystem system;
    const MachineDescription machine = describe_machine(system.root());
    CHECK(machine.cpu == "Example 9000");
    CHECK(machine.widest_simd == "AVX2");
    CHECK(machine.governor == "powersave");
    CHECK(machine.clock_mhz == 2400.5);
    CHECK(machine.load == 3.25);
    CHECK(machine.virtual_machine);
    CHECK_FALSE(machine.quota);
    CHECK(machine.usable_processors >= 1);
    const TemporaryFolder nothing;
    const MachineDescription unknown = describe_machine(nothing.path());
    CHECK(unknown.cpu.empty());
    CHECK_FALSE(unknown.load);
}

TEST_CASE("the tightest quota of the control groups counts", "[cli][timing]") {
    const FakeSystem system;
    SECTION("of version 2") {
        system.file("proc/self/cgroup", "0::/outer/inner\n");
        system.file("sys/fs/cgroup/outer/cpu.max", "150000 100000\n");
        system.file("sys/fs/cgroup/outer/inner/cpu.max", "max 100000\n");
    }
    SECTION("of version 1") {
        system.file("proc/self/cgroup", "3:cpu,cpuacct:/outer\n2:memory:/outer\n");
        system.file("sys/fs/cgroup/cpu,cpuacct/outer/cpu.cfs_quota_us", "150000\n");
        system.file("sys/fs/cgroup/cpu,cpuacct/outer/cpu.cfs_period_us", "100000\n");
        system.file("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
        system.file("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
    }
    const MachineDescription machine = describe_machine(system.root());
    CHECK(machine.quota == 1.5);
    CHECK(machine.most_threads() <= 1.5);
}

TEST_CASE("what others take is all that was busy but our own", "[cli][timing]") {
    const FakeSystem system;
    const auto times = [&](const std::string& line) {
        system.file("proc/stat", line + "\ncpu0 0 0 0 0\n");
        return machine_times(system.root());
    };
    // 10 s of two processors: 12 s busy, 1 s stolen, 7 s idle.
    const auto before = times("cpu 1000 0 500 9000 100 0 0 50 0 0"), after = times("cpu 1900 100 700 9600 200 0 0 150 0 0");
    const auto load = foreign_load(before, after, 9.0);
    REQUIRE(load);
    const double tick = 100.0;  // of nearly every Linux
    CHECK(std::abs(load->others - (1200.0 / tick - 9.0) / (2000.0 / tick)) < 1e-9);
    CHECK(std::abs(load->stolen - 100.0 / 2000.0) < 1e-9);
    CHECK(foreign_load(before, after, 100.0)->others == 0.0);
    CHECK_FALSE(foreign_load(before, before, 0.0));
    CHECK_FALSE(times("cpu 0 0 0 0 0 0 0 0 0 0"));
    CHECK_FALSE(machine_times("/nowhere"));
}

TEST_CASE("the report of a study holds its data and loads nothing", "[cli][timing][report]") {
    TimingStudy study = drifting_study(3);
    study.scene = "a </script><b>.json";
    const nlohmann::ordered_json json = timing_json(study, timing_figures(study));
    const std::string page = timing_report(json);
    const std::string begin = "<script type=\"application/json\" id=\"timing\">";
    const std::size_t from = page.find(begin) + begin.size();
    CHECK(nlohmann::ordered_json::parse(page.substr(from, page.find("</script>", from) - from)) == json);
    CHECK(page.find("default-src 'none'") != std::string::npos);
    CHECK(page.find("src=\"http") == std::string::npos);
    CHECK(page.find("@SCRIPT@") == std::string::npos);
}

TEST_CASE("timing runs every number of threads in turn and finds the same results", "[cli][timing]") {
    const TemporaryFolder folder;
    const std::filesystem::path out = folder / "study";
    const Outcome outcome = run_naturel(with_room(folder, {"timing", "--backend", backend_names().size() > 1 ? "both" : backend_names().front(),
                                                           "--threads", "2,1", "--repeat", "2", "--out", out.string()}));
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    CHECK(outcome.output.find("results are the same to the last bit") != std::string::npos);
    CHECK(outcome.errors.find("2 repeats are too few") != std::string::npos);
    const Json timing = Json::parse(content_of(out / "timing.json"));
    CHECK(timing["same_results"] == true);
    CHECK(timing["threads"] == Json{1, 2});
    CHECK(timing["machine"]["processors"].get<int>() >= 1);
    CHECK_FALSE(timing["machine"]["software"]["TBB"].get<std::string>().empty());
    REQUIRE(timing["runs"].size() == 4 * backend_names().size());
    for (std::size_t k = 0; k < timing["runs"].size(); ++k) {
        const Json& run = timing["runs"][k];
        CHECK(run["threads"] == 1 + k % 2);
        CHECK(run["repeat"] == 1 + k / (2 * backend_names().size()));
        double wall_s = 0.0;
        for (const Json& stage : run["stages"])
            wall_s += stage["stage"] == whole_run ? -stage["wall_s"].get<double>() : stage["wall_s"].get<double>();
        CHECK(std::abs(wall_s) < 1e-9);  // the stages are the whole
        CHECK(run["peak_memory_bytes"].get<double>() > 1e6);
    }
    std::set<std::string> stages;
    for (const Json& row : timing["stages"]) {
        stages.insert(row["stage"].get<std::string>());
        CHECK(row["speed_up"].is_null() == (row["threads"] == 1));
        CHECK(row["fewest_threads_that_worked"].get<int>() <= row["threads"].get<int>());
        CHECK(row["work_unit"].get<std::string>().empty() == row["work_per_s"].is_null());
        if (row["stage"] == "form factors") CHECK_FALSE(row["work_unit"].get<std::string>().empty());
    }
    for (const char* stage : {"read scene", "open output", "assembly", "zones", "grid", "visibility", "direct light", "form factors", "radiosity", "nodes",
                              "sensors", "tables", "total"})
        CHECK(stages.contains(stage));
    CHECK(lines_of(content_of(out / "timing.csv")) == 1 + timing["stages"].size());
    CHECK(lines_of(content_of(out / "timing_runs.csv")) == 1 + timing["runs"].size() * timing["runs"][0]["stages"].size());
    CHECK(files_below(out).size() == 4);  // and report.html: what was timed is gone
}

TEST_CASE("a study whose runs do not give the same results ends with what differs", "[cli][timing]") {
    const TemporaryFolder folder;
    const std::filesystem::path out = folder / "study", scene = folder / "room.json";
    RunningProgram program(with_room(folder, {"timing", "--backend", "hemicube", "--cells", "32", "--threads", "1", "--repeat", "100", "--out", out.string()}));
    // A run that has opened its folder has read the scene; those that follow find another one.
    Json room = Json::parse(content_of(scene));
    room["sky"]["horizontal_illuminance_lx"] = 12000;
    write(folder / "other.json", room.dump());
    for (int k = 0; k < 10000 && !std::filesystem::exists(out / "run_being_timed"); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::filesystem::rename(folder / "other.json", scene);
    const Outcome outcome = program.wait();
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.errors.find("results are not the same for every number of threads: hemicube with 1 threads") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(out / "timing.json"));
}

TEST_CASE("weak scaling gives every thread as many patches", "[cli][timing]") {
    const TemporaryFolder folder;
    const std::filesystem::path out = folder / "study";
    REQUIRE(run_naturel(with_room(folder, {"timing", "--backend", "hemicube", "--cells", "32", "--threads", "1,4", "--repeat", "1",
                                           "--weak", "--grid-spacing", "0.5", "--out", out.string()}))
                .exit_code == 0);
    const Json timing = Json::parse(content_of(out / "timing.json"));
    std::map<int, double> patches;
    for (const Json& run : timing["runs"])
        if (run["scaling"] == "weak") patches[run["threads"].get<int>()] = run["patches"].get<double>();
    REQUIRE(patches.size() == 2);
    // Cells are whole: a side of ten cells or fewer is a tenth off.
    CHECK(std::abs(patches[4] / patches[1] / 4.0 - 1.0) < 0.25);
}

TEST_CASE("timing refuses what it cannot time", "[cli][timing]") {
    const TemporaryFolder folder;
    CHECK(run_naturel(with_room(folder, {"timing", "--threads", "0"})).exit_code == 2);
    CHECK(run_naturel(with_room(folder, {"timing", "--threads", "1,x"})).exit_code == 2);
    CHECK(run_naturel(with_room(folder, {"timing", "--repeat", "0"})).exit_code == 2);
    CHECK(run_naturel(with_room(folder, {"timing", "--dry-run"})).exit_code == 2);
    // Every run but the first would read form factors instead of computing them.
    CHECK(run_naturel(with_room(folder, {"timing", "--cache", (folder / "cache").string(), "--out", (folder / "study").string()})).exit_code == 2);
    CHECK(run_naturel(with_room(folder, {"timing", "--cache-limit", "1G", "--out", (folder / "study").string()})).exit_code == 2);
    CHECK_FALSE(std::filesystem::exists(folder / "cache"));
    const std::filesystem::path out = folder / "study";
    write(folder / "broken.json", "{\"naturel\": 1}");
    const Outcome broken = run_naturel({"timing", (folder / "broken.json").string(), "--out", out.string()});
    CHECK(broken.exit_code == 3);
    CHECK(broken.errors.find("broken.json:1:") != std::string::npos);
    CHECK(files_below(out).empty());
    CHECK(run_naturel({"timing", (folder / "absent.json").string(), "--out", out.string()}).exit_code == 3);
}

TEST_CASE("a run tells of every stage what it took and who worked", "[cli][timing]") {
    const TemporaryFolder folder;
    const std::string backend = backend_names().back();
    REQUIRE(run_naturel(with_room(folder, {"run", "--backend", backend, "--threads", "2", "--out", (folder / "out").string()})).exit_code == 0);
    const Json timings = Json::parse(content_of(folder / "out" / backend / "timings.json"));
    CHECK(timings["threads"] == 2);
    CHECK(timings["threads_that_worked"].get<int>() >= 1);
    CHECK(timings["threads_that_worked"].get<int>() <= 2);
    CHECK(timings["peak_memory_bytes"].get<double>() > 1e6);
    double cpu_s = 0.0;
    for (const Json& stage : timings["stages"]) {
        CHECK(stage["workers"].size() == stage["threads_that_worked"].get<std::size_t>());
        double workers_s = 0.0;
        for (const Json& worker : stage["workers"]) workers_s += worker["cpu_seconds"].get<double>();
        // Clocks of process and threads are read one after the other.
        CHECK(workers_s <= stage["cpu_seconds"].get<double>() + 0.01);
        cpu_s += stage["cpu_seconds"].get<double>();
    }
    CHECK(std::abs(cpu_s - timings["total_cpu_seconds"].get<double>()) < 1e-9);
}

TEST_CASE("a trace is valid JSON whose spans nest", "[cli][timing]") {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder / "trace.json";
    const std::string backend = backend_names().back();
    REQUIRE(run_naturel(with_room(folder, {"run", "--backend", backend, "--threads", "2", "--trace", file.string(), "--out", (folder / "out").string()}))
                .exit_code == 0);
    const Json trace = Json::parse(content_of(file));
    std::map<int, std::vector<double>> open;  // ends of the spans that have begun, by thread
    std::set<std::string> stages, block_names;
    std::vector<std::pair<std::string, double>> blocks;                             // name and begin
    std::map<std::string, std::vector<std::pair<double, double>>> spans_of_stages;  // begin and end
    double last_ns = 0.0, stages_us = 0.0;
    std::set<int> threads;
    for (const Json& event : trace["traceEvents"]) {
        if (event["ph"] == "M") continue;
        REQUIRE(event["ph"] == "X");
        const int thread = event["tid"];
        if (threads.insert(thread).second) last_ns = 0.0;
        // Whole nanoseconds, exact in a double.
        const double begin_ns = std::round(1e3 * event["ts"].get<double>()), end_ns = begin_ns + std::round(1e3 * event["dur"].get<double>());
        CHECK(begin_ns >= last_ns);  // in order
        last_ns = begin_ns;
        auto& ends = open[thread];
        while (!ends.empty() && ends.back() <= begin_ns) ends.pop_back();
        if (event["cat"] == "stage" && ends.empty()) stages_us += event["dur"].get<double>();
        if (!ends.empty()) CHECK(end_ns <= ends.back());
        ends.push_back(end_ns);
        const std::string name = event["name"];
        (event["cat"] == "stage" ? stages : block_names).insert(name);
        if (event["cat"] == "stage") spans_of_stages[name].emplace_back(begin_ns, end_ns);
        else blocks.emplace_back(name, begin_ns);
    }
    for (const char* stage : {"assembly", "form factors", "direct light", "direct light at nodes", "sensors", "tables"}) CHECK(stages.contains(stage));
    std::size_t outside = 0;
    for (const auto& [name, begin_ns] : blocks)
        outside += std::ranges::none_of(spans_of_stages[name], [at = begin_ns](const auto& span) { return span.first <= at && at <= span.second; });
    CHECK(outside == 0);  // each block begins in a stage of its name
    CHECK(block_names.contains("form factors"));
    const Json timings = Json::parse(content_of(folder / "out" / backend / "timings.json"));
    // The stages are the whole run, to rounding.
    CHECK(std::abs(1e-6 * stages_us - timings["total_seconds"].get<double>()) < 1e-6);

    const Outcome refused = run_naturel(with_room(folder, {"run", "--trace", (folder / "absent" / "trace.json").string(), "--out", (folder / "no").string()}));
    CHECK(refused.exit_code == 3);
    CHECK_FALSE(std::filesystem::exists(folder / "no"));
}

TEST_CASE("form factors that are read have no rate of computing", "[cli][timing]") {
    const TemporaryFolder folder;
    const auto has_work = [&] {
        REQUIRE(run_naturel(with_room(folder, {"run", "--backend", "hemicube", "--cells", "32", "--cache", (folder / "cache").string(), "--out",
                                               (folder / "out").string(), "--quiet"}))
                    .exit_code == 0);
        std::map<std::string, bool> work;
        const Json timings = Json::parse(content_of(folder / "out/hemicube/timings.json"));
        for (const Json& stage : timings["stages"])
            work[stage["stage"].get<std::string>()] = stage.contains("work");
        return work;
    };
    const auto computed = has_work(), read = has_work();
    CHECK(computed.at("form factors"));
    CHECK_FALSE(read.at("form factors"));
    CHECK(read.at("sensors"));
}

TEST_CASE("an output that is a link, a pipe or a device stays one", "[cli]") {
    const TemporaryFolder folder;
    const auto trace_to = [&](const std::filesystem::path& file) {
        return with_room(folder, {"run", "--backend", "hemicube", "--cells", "16", "--no-error-estimate", "--no-report", "--quiet", "--trace",
                                  file.string(), "--out", (folder / "out").string()});
    };
    SECTION("links, of which one leads to the other") {
        write(folder / "target.json", "old");
        std::filesystem::create_symlink("target.json", folder / "near");
        std::filesystem::create_symlink(folder / "near", folder / "far");
        REQUIRE(run_naturel(trace_to(folder / "far")).exit_code == 0);
        CHECK(std::filesystem::is_symlink(folder / "near"));
        CHECK(std::filesystem::is_symlink(folder / "far"));
        CHECK(Json::parse(content_of(folder / "target.json")).contains("traceEvents"));

        std::filesystem::create_symlink("rows.csv", folder / "link.csv");  // to nothing yet
        REQUIRE(run_naturel({"formfactors", (folder / "room.json").string(), "--backend", "hemicube", "--cells", "16", "--quiet", "--out",
                             (folder / "link.csv").string()})
                    .exit_code == 0);
        CHECK(std::filesystem::is_symlink(folder / "link.csv"));
        CHECK(content_of(folder / "rows.csv").size() > 100);
    }
    SECTION("a pipe") {
        REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
        // Opened before, so that the program need not wait for a reader.
        const int pipe = ::open((folder / "pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
        REQUIRE(pipe >= 0);
        RunningProgram program(trace_to(folder / "pipe"));
        auto end = std::async(std::launch::async, [&] { return program.wait(); });
        std::string bytes;
        const auto read_all = [&] {
            std::array<char, 4096> block{};
            for (ssize_t got = 0; (got = ::read(pipe, block.data(), block.size())) > 0;) bytes.append(block.data(), static_cast<std::size_t>(got));
        };
        while (end.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) read_all();
        read_all();
        ::close(pipe);
        CHECK(end.get().exit_code == 0);
        CHECK(std::filesystem::is_fifo(folder / "pipe"));
        CHECK(Json::parse(bytes).contains("traceEvents"));
    }
    SECTION("a device") {
        // One of its own that swallows everything, as /dev/null does.
        const std::filesystem::path device = folder / "null";
        const int made = ::mknod(device.c_str(), S_IFCHR | 0600, makedev(1, 3));
        const int opened = made == 0 ? ::open(device.c_str(), O_WRONLY | O_CLOEXEC) : -1;
        if (opened < 0) {
            WARN("skipped: only root may make a device");
            return;
        }
        ::close(opened);
        CHECK(run_naturel(trace_to(device)).exit_code == 0);
        CHECK(std::filesystem::is_character_file(device));
    }
}
