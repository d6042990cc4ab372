#include <fcntl.h>
#include <sys/file.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <future>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "cli/study_keys.h"
#include "tests/catch.h"
#include "tests/cli/program.h"

using namespace naturel::tests;

namespace {

using Json = nlohmann::json;

/// The small room under two skies and with two floors, coarse: four jobs in one group.
const Json four_jobs = {{"naturel_study", 1},
                        {"name", "four"},
                        {"scenes", "room.json"},
                        {"options", {{"backend", "hemicube"}, {"cells", 32}}},
                        {"vary",
                         {{{"name", "floor"}, {"path", "/materials/floor"}, {"values", {{{"reflectance", 0.2}}, {{"reflectance", 0.6}}}}},
                          {{"name", "sky"}, {"path", "/sky/horizontal_illuminance_lx"}, {"values", {10000, 20000}}}}}};

class StudyFolder {
public:
    explicit StudyFolder(const Json& study = four_jobs) {
        write(folder_ / "room.json", small_room);
        put(study);
    }
    void put(const Json& study) const { write(folder_ / "study.json", study.dump(1)); }

    std::filesystem::path operator/(std::string_view name) const { return folder_ / name; }
    std::string study() const { return (folder_ / "study.json").string(); }

    Outcome batch(std::string_view out, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments{"batch", study(), "--out", (folder_ / out).string(), "--threads", "2"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_naturel(arguments);
    }
    std::map<std::string, std::string> results(std::string_view out) const {
        std::map<std::string, std::string> files;
        for (auto& [name, content] : files_below(folder_ / out))
            if (name.starts_with("results") || name.starts_with("sensors")) files.emplace(name, std::move(content));
        return files;
    }

private:
    TemporaryFolder folder_;
};

std::vector<Json> lines_of(const std::string& text) {
    std::istringstream stream(text);
    std::vector<Json> lines;
    for (std::string line; std::getline(stream, line);) lines.push_back(Json::parse(line));
    return lines;
}

/// Records in all files of a folder, whole or not.
std::size_t record_count(const std::filesystem::path& folder) {
    std::size_t count = 0;
    for (const auto& [name, content] : files_below(folder / "records"))
        for (std::size_t at = content.find("NATURJOB"); at != std::string::npos; at = content.find("NATURJOB", at + 1)) ++count;
    return count;
}

/// Many jobs of some milliseconds each.
Json many_jobs(int count) {
    Json study = four_jobs;
    study["name"] = "many";
    study["keep"] = {"sensors"};
    study["vary"][1] = {{"name", "sky"}, {"path", "/sky/horizontal_illuminance_lx"}, {"range", {{"first", 1000}, {"last", 50000}, {"count", count}}}};
    return study;
}

/// Kills the process at random instants, until it ends by itself. Every other one falls into its beginning; the rest come after its
/// first finished jobs, so that each time a few are finished more, however quick the machine is. Returns how often it was killed.
int run_with_kills(const StudyFolder& study, std::string_view out, int kills, double beginning_s) {
    std::mt19937 random(7);
    const auto records = study / out / "records/shard_1_of_1.records";
    int killed = 0;
    for (; killed < kills; ++killed) {
        std::error_code absent;
        const auto size = [&] { return std::filesystem::exists(records, absent) ? std::filesystem::file_size(records, absent) : 0; };
        const auto before = size();
        RunningProgram program({"batch", study.study(), "--out", (study / out).string(), "--threads", "2", "--quiet"});
        // Or until the first jobs are finished. A torn end may be cut off before that.
        const double longest_s = killed % 2 == 0 ? std::uniform_real_distribution(0.0, beginning_s)(random) : 20.0;
        const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(longest_s);
        while (size() <= before && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        if (killed % 2 != 0) std::this_thread::sleep_for(std::chrono::duration<double>(std::uniform_real_distribution(0.0, 0.03)(random)));
        program.send(SIGKILL);
        if (program.wait().exit_code != 128 + SIGKILL) break;
    }
    const Outcome last = study.batch(out);
    INFO(last.errors);
    CHECK(last.exit_code == 0);
    return killed;
}

void check_refusal(const Json& study, const std::string& place, const std::string& text) {
    const StudyFolder folder(study);
    const Outcome outcome = folder.batch("out");
    INFO(outcome.errors << "\nexpected at " << place << ": " << text);
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.errors.find(text) != std::string::npos);
    CHECK(outcome.errors.find(place) != std::string::npos);
    CHECK(outcome.errors.find("study.json:") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
}

Json with(const char* pointer, const Json& value) {
    Json study = four_jobs;
    study[Json::json_pointer(pointer)] = value;
    return study;
}

/// Values of a parameter in the order of the jobs.
std::vector<Json> values_of(const std::vector<Json>& jobs, const std::string& name) {
    std::vector<Json> values;
    for (const Json& job : jobs) values.push_back(job["parameters"].at(name));
    return values;
}

/// Jobs of a study as its folder lists them, without what they compute.
std::vector<Json> jobs_of(const Json& study) {
    const StudyFolder folder(study);
    const Outcome outcome = folder.batch("out");
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    return lines_of(folder.results("out").at("results.jsonl"));
}

/// The study with one varied parameter, in the room with the clock's sun.
Json varying(const Json& parameter) {
    Json study = four_jobs;
    study["vary"] = Json::array({parameter});
    study["set"] = {{"/site", {{"latitude_deg", 47.2}, {"longitude_deg", -1.6}, {"time_zone_h", 1}}},
                    {"/sun", {{"date", "2026-06-21"}, {"time", "12:00"}, {"direct_normal_illuminance_lx", 50000}}}};
    return study;
}

/// Megabytes or gigabytes before " of memory", in bytes.
[[maybe_unused]] double forecast_bytes(const std::string& text) {
    const std::size_t begin = text.find("at most about ", text.find("Together about"));
    REQUIRE(begin != std::string::npos);
    std::istringstream words(text.substr(begin + 14));
    double number = 0.0;
    std::string unit;
    words >> number >> unit;
    return number * (unit == "GB" ? 1e9 : 1e6);
}

std::size_t count_of(const std::string& text, std::string_view part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

}  // namespace

TEST_CASE("a study leaves a row per job whose numbers are those of the job", "[cli][batch]") {
    const StudyFolder study(with("/keep", {"sensors"}));
    const Outcome outcome = study.batch("out");
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    CHECK(outcome.output.find("4 jobs done, 0 failed, 0 missing") != std::string::npos);
    const auto files = study.results("out");
    const std::vector<Json> lines = lines_of(files.at("results.jsonl"));
    REQUIRE(lines.size() == 4);
    const auto mean = [&](std::size_t job, const char* what) {
        return lines[job]["figures"]["sensor_sets"][0][what]["mean"].get<double>();
    };
    // The sun shines as before: light grows by less than the sky, daylight factors stay; a lighter floor gives more.
    CHECK(lines[1]["parameters"]["sky"] == 20000);
    CHECK(std::abs(mean(1, "daylight_factor_percent") / mean(0, "daylight_factor_percent") - 1.0) < 1e-5);
    CHECK(mean(1, "illuminance_lx") > 1.05 * mean(0, "illuminance_lx"));
    CHECK(mean(1, "illuminance_lx") < 2.0 * mean(0, "illuminance_lx"));
    CHECK(mean(2, "illuminance_lx") > mean(0, "illuminance_lx"));

    const std::string& table = files.at("results.csv");
    CHECK(table.starts_with("job,group,key,row,scene,floor,sky,status,outdoors.zenith_luminance_cd_m2,outdoors.horizontal_illuminance_lx,"));
    CHECK(std::ranges::count(table, '\n') == 5);

    // The last axis of the array of sensors begins with the total; the sets follow each other.
    const std::string& array = files.at("sensors_1.npy");
    const std::size_t sensors = static_cast<std::size_t>(std::ranges::count(files.at("sensors_1.csv"), '\n')) - 1;
    CHECK(array.find("'shape': (4, " + std::to_string(sensors) + ", 6)") != std::string::npos);
    REQUIRE(array.size() == 128 + 4 * sensors * 6 * sizeof(double));
    double sum_lx = 0.0;
    const auto points = lines[2]["figures"]["sensor_sets"][0]["points"].get<std::size_t>();
    for (std::size_t k = 0; k < points; ++k) {
        double total_lx = 0.0;
        std::memcpy(&total_lx, array.data() + 128 + (2 * sensors + k) * 6 * sizeof(double), sizeof total_lx);
        sum_lx += total_lx;
    }
    CHECK(std::abs(sum_lx / static_cast<double>(points) / mean(2, "illuminance_lx") - 1.0) < 1e-12);
}

TEST_CASE("a job gives the numbers that a run of its scene gives", "[cli][batch]") {
    Json room = Json::parse(small_room);
    room.erase("sun");
    StudyFolder study;
    write(study / "room.json", room.dump());
    REQUIRE(study.batch("out").exit_code == 0);
    room["materials"]["floor"] = {{"reflectance", 0.6}};
    room["sky"]["horizontal_illuminance_lx"] = 20000;
    write(study / "varied.json", room.dump());
    REQUIRE(run_naturel({"run", (study / "varied.json").string(), "--out", (study / "run").string(), "--backend", "hemicube", "--cells", "32",
                         "--no-error-estimate", "--quiet"})
                .exit_code == 0);
    const Json summary = Json::parse(content_of(study / "run/hemicube/summary.json"));
    const Json job = lines_of(study.results("out").at("results.jsonl"))[3]["figures"];
    // Both stop the radiosity at 1e-6, on paths of their own.
    for (const char* figure : {"mean", "min", "max"})
        CHECK(std::abs(job["sensor_sets"][0]["illuminance_lx"][figure].get<double>() /
                           summary["sensor_sets"][0]["illuminance_lx"][figure].get<double>() -
                       1.0) < 1e-5);
    CHECK(job["outdoors"] == summary["outdoors"]);
}

TEST_CASE("a study killed at any instant ends with the bytes of one that was not", "[cli][batch]") {
    const StudyFolder study(many_jobs(20));
    REQUIRE(study.batch("whole").exit_code == 0);
    run_with_kills(study, "killed", 4, 0.15);
    write(study / "killed/results.csv.123-4.part", "killed while it wrote results");
    write(study / "killed/download.part", "of somebody else");
    REQUIRE(study.batch("killed").exit_code == 0);
    CHECK(std::filesystem::remove(study / "killed/download.part"));
    CHECK((study.results("killed") == study.results("whole")));
    CHECK(record_count(study / "killed") == 40 + 1);  // each job once, and the sensors
}

TEST_CASE("fifty random kills cost no finished job and no byte", "[cli][batch][slow]") {
    const StudyFolder study(many_jobs(1500));
    REQUIRE(study.batch("whole").exit_code == 0);
    CHECK(run_with_kills(study, "killed", 50, 1.0) == 50);
    CHECK((study.results("killed") == study.results("whole")));
    CHECK(record_count(study / "killed") == 3000 + 1);
}

TEST_CASE("a torn or damaged record is never trusted", "[cli][batch]") {
    const StudyFolder study(many_jobs(3));
    REQUIRE(study.batch("out").exit_code == 0);
    const auto whole = study.results("out");
    const auto file = study / "out/records/shard_1_of_1.records";
    const std::string records = content_of(file);
    const std::size_t last = records.rfind("NATURJOB"), middle = records.find("NATURJOB", 1);
    std::string torn = records, flipped = records;
    torn.resize(last + (records.size() - last) / 2);
    flipped[middle + 200] ^= 1;
    for (const std::string& damaged : {torn, flipped, records.substr(0, last + 3), records + std::string(5000, '\0'), std::string("NATURJOB")}) {
        write(file, damaged);
        const Outcome outcome = study.batch("out");
        INFO(outcome.errors);
        CHECK(outcome.exit_code == 0);
        CHECK((study.results("out") == whole));
        // What is not whole at the end is cut off, and at most the last job written once more.
        if (damaged.size() > last && damaged != flipped) CHECK((content_of(file) == records));
    }
}

TEST_CASE("a full disk ends a study with a clear word, and it goes on when there is room", "[cli][batch]") {
    const StudyFolder study(many_jobs(20));
    REQUIRE(study.batch("whole").exit_code == 0);
    // No file may grow beyond 20 kB; children inherit that.
    struct rlimit before {};
    getrlimit(RLIMIT_FSIZE, &before);
    struct rlimit small = before;
    small.rlim_cur = 20000;
    setrlimit(RLIMIT_FSIZE, &small);
    const Outcome full = study.batch("full");
    setrlimit(RLIMIT_FSIZE, &before);
    INFO(full.errors);
    CHECK(full.exit_code == 3);
    CHECK(full.errors.find("cannot be written: File too large (finished jobs are safe") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(study / "full/results.csv"));
    CHECK(study.batch("full").exit_code == 0);
    CHECK((study.results("full") == study.results("whole")));
}

TEST_CASE("a full and then a read-only file system cost a study nothing but time", "[cli][batch][slow]") {
    const StudyFolder study(many_jobs(50));
    REQUIRE(study.batch("whole").exit_code == 0);
    const auto disk = study / "disk";
    std::filesystem::create_directory(disk);
    if (::mount("naturel", disk.c_str(), "tmpfs", 0, "size=100k") != 0) {
        WARN("skipped: only root may mount a small disk");
        return;
    }
    const Outcome full = study.batch("disk");
    CHECK(full.exit_code == 3);
    CHECK(full.errors.find("No space left on device") != std::string::npos);
    CHECK(::mount("naturel", disk.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, "size=10m") == 0);
    const Outcome read_only = study.batch("disk");
    CHECK(read_only.exit_code == 3);
    CHECK(read_only.errors.find("Read-only file system") != std::string::npos);
    CHECK(::mount("naturel", disk.c_str(), "tmpfs", MS_REMOUNT, "size=10m") == 0);
    const Outcome rest = study.batch("disk");
    CHECK(rest.exit_code == 0);
    CHECK(rest.errors.find("jobs are finished already") != std::string::npos);
    CHECK((study.results("disk") == study.results("whole")));
    CHECK(record_count(disk) == 100 + 1);
    ::umount(disk.c_str());
}

TEST_CASE("a folder that cannot be written to is refused before anything is computed", "[cli][batch]") {
    const StudyFolder study;
    write(study / "file", "keep me");
    const Outcome outcome = study.batch("file");
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.errors.find("cannot be made") != std::string::npos);
    CHECK(content_of(study / "file") == "keep me");
}

TEST_CASE("shards share a study in one folder or in several, with the bytes of one process", "[cli][batch]") {
    Json two_groups = four_jobs;
    two_groups["keep"] = {"sensors"};
    two_groups["vary"].push_back({{"path", "/grid/spacing_m"}, {"values", {1.0, 0.9}}});
    const StudyFolder study(two_groups);
    REQUIRE(study.batch("whole").exit_code == 0);
    std::vector<std::string> merge{"merge"};
    std::size_t computed_apart = 0;
    for (const char* shard : {"1/3", "3/3", "2/3"}) {
        REQUIRE(study.batch("together", {"--shard", shard}).exit_code == 0);
        const std::string own = std::string("own_") + shard[0];
        REQUIRE(study.batch(own, {"--shard", shard}).exit_code == 0);
        CHECK_FALSE(std::filesystem::exists(study / own / "results.csv"));
        for (const auto& [name, content] : files_below(study / own / "records"))
            for (std::size_t at = content.find("\"status\":\"done\""); at != std::string::npos; at = content.find("\"status\":\"done\"", at + 1)) ++computed_apart;
        merge.push_back((study / own).string());
    }
    CHECK((study.results("together") == study.results("whole")));
    CHECK(record_count(study / "together") == 8 + 2);
    CHECK(computed_apart == 8);  // no job in two shards

    merge.insert(merge.end(), {"--out", (study / "merged").string()});
    const Outcome merged = run_naturel(merge);
    INFO(merged.errors);
    CHECK(merged.exit_code == 0);
    CHECK((study.results("merged") == study.results("whole")));

    const std::string first = merge[1];
    merge.erase(merge.begin() + 1);
    merge.back() = (study / "partly").string();
    const Outcome partly = run_naturel(merge);
    CHECK(partly.exit_code == 5);
    CHECK(partly.output.find("missing; written to") != std::string::npos);
    // What was merged before stays, even when its folders are gone.
    std::filesystem::remove_all(merge[1]);
    CHECK(run_naturel({"merge", first, "--out", merge.back()}).exit_code == 0);
    CHECK((study.results("partly") == study.results("whole")));
}

TEST_CASE("equal jobs are computed once, whatever shards they would fall into", "[cli][batch]") {
    const StudyFolder study(with("/vary/1/values", {10000, 20000, 10000}));
    REQUIRE(study.batch("whole").exit_code == 0);
    REQUIRE(study.batch("out", {"--shard", "1/2"}).exit_code == 0);
    REQUIRE(study.batch("out", {"--shard", "2/2"}).exit_code == 0);
    CHECK(record_count(study / "out") == 4);
    CHECK((study.results("out") == study.results("whole")));
    CHECK(lines_of(study.results("out").at("results.jsonl")).size() == 6);
}

TEST_CASE("records that cannot be read are not taken for missing ones", "[cli][batch]") {
    const StudyFolder study;
    REQUIRE(study.batch("out").exit_code == 0);
    std::filesystem::create_directories(study / "out/records/odd.records");
    const Outcome outcome = study.batch("out");
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.errors.find("odd.records: cannot be read") != std::string::npos);
}

TEST_CASE("a failed job is recorded, stops no other, and is tried again when asked for", "[cli][batch]") {
    Json study_json = with("/vary/1/values", {10000, 20000, -1});
    study_json["invalid_jobs"] = "record";
    const StudyFolder study(study_json);
    const Outcome outcome = study.batch("out");
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 5);
    CHECK(outcome.output.find("4 jobs done, 2 failed") != std::string::npos);
    const std::vector<Json> lines = lines_of(study.results("out").at("results.jsonl"));
    CHECK(lines[2]["status"] == "failed");
    CHECK(lines[2]["error"].get<std::string>().find("-1 is out of range") != std::string::npos);
    CHECK(lines[3]["status"] == "done");
    CHECK(study.batch("out").errors.find("6 of 6 jobs are finished already") != std::string::npos);
    CHECK(study.batch("out", {"--retry-failed"}).errors.find("4 of 6 jobs are finished already") != std::string::npos);

    // A grid that nobody can lay is found only when it is tried: both jobs of that group fail, the others do not.
    const StudyFolder fine(with("/vary/0", {{"path", "/grid/spacing_m"}, {"values", {0.001, 1.0}}}));
    CHECK(fine.batch("out").exit_code == 5);
    CHECK(lines_of(fine.results("out").at("results.jsonl"))[3]["status"] == "done");
    const Outcome stopped = fine.batch("stopped", {"--max-failures", "0"});
    CHECK(stopped.exit_code == 5);
    CHECK(stopped.errors.find("`naturel merge " + (fine / "stopped").string() + "` writes results of what there is") != std::string::npos);
    CHECK(run_naturel({"merge", (fine / "stopped").string()}).output.find("0 jobs done, 1 failed, 3 missing") != std::string::npos);
    CHECK(stopped.errors.find("stopped after 1 failure (") != std::string::npos);
}

TEST_CASE("jobs of a study that varies reflectances under every sky are grouped by their reflectances", "[cli][batch]") {
    // What sets of reflectances cost is paid once each, in whatever order a study names its parameters.
    Json turned = four_jobs;
    std::swap(turned["vary"][0], turned["vary"][1]);
    turned["vary"][1]["values"].push_back({{"reflectance", 0.4}});
    const StudyFolder study(turned);
    REQUIRE(study.batch("out").exit_code == 0);
    const std::string records = files_below(study / "out/records").begin()->second;
    const std::vector<Json> jobs = lines_of(study.results("out").at("results.jsonl"));
    REQUIRE(jobs.size() == 6);
    std::vector<std::pair<std::size_t, double>> place;  // in the file, and reflectance
    for (const Json& job : jobs)
        place.emplace_back(records.find(job["key"].get<std::string>()), job["parameters"]["floor"]["reflectance"].get<double>());
    std::ranges::sort(place);
    std::vector<double> reflectances;
    for (const auto& [at, reflectance] : place) reflectances.push_back(reflectance);
    CHECK(reflectances == std::vector{0.2, 0.2, 0.6, 0.6, 0.4, 0.4});
}

TEST_CASE("a study may get more jobs in a folder, but not other ones", "[cli][batch]") {
    const StudyFolder study;
    REQUIRE(study.batch("out").exit_code == 0);
    study.put(with("/vary/1/values", {10000, 15000, 20000}));
    const Outcome more = study.batch("out");
    CHECK(more.exit_code == 0);
    CHECK(more.errors.find("4 of 6 jobs are finished already") != std::string::npos);
    const auto before = study.results("out");
    study.put(with("/options/cells", 48));
    const Outcome other = study.batch("out");
    CHECK(other.exit_code == 3);
    CHECK(other.errors.find("belongs to another study") != std::string::npos);
    CHECK((study.results("out") == before));
}

TEST_CASE("Ctrl-C ends a study with exit code 130 and keeps what is finished", "[cli][batch]") {
    Json study_json = many_jobs(20);
    study_json["keep"] = {"images"};  // each job is a run of its own and takes some time
    study_json["options"]["cells"] = 256;
    const StudyFolder study(study_json);
    RunningProgram program({"batch", study.study(), "--out", (study / "out").string(), "--threads", "2"});
    const auto records = study / "out/records/shard_1_of_1.records";
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    std::error_code absent;
    while ((!std::filesystem::exists(records) || std::filesystem::file_size(records, absent) < 1000) && std::chrono::steady_clock::now() < deadline)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    // Meanwhile nobody else may work on these jobs.
    const Outcome second = study.batch("out");
    CHECK(second.exit_code == 3);
    CHECK(second.errors.find("another naturel is at work") != std::string::npos);
    program.send(SIGINT);
    const Outcome outcome = program.wait();
    INFO(outcome.errors);
    CHECK(outcome.exit_code == 130);
    CHECK(outcome.errors.find(" finished; the same command goes on from there") != std::string::npos);
    CHECK(record_count(study / "out") >= 1);
    CHECK(record_count(study / "out") < 40);
}

TEST_CASE("errors of a study name its line and what would be right", "[cli][batch]") {
    check_refusal(with("/vary/1/values/1", "bright"), "/vary/1/values/1: scene \"room.json\" with /sky/horizontal_illuminance_lx = \"bright\": /sky/horizontal_illuminance_lx",
                  "stands where a number belongs");
    check_refusal(with("/vary/1/path", "/skies/0/level"), "/vary/1/path", "has no /skies to go on from");
    check_refusal(with("/vary/1/path", "/polyhedra/7"), "/vary/1/path", "has no item \"7\" (0 to 2");
    check_refusal(with("/vary/1/path", "sky"), "/vary/1/path", "is no path into the scene");
    check_refusal(with("/vary/0/path", "/materials/flor"), "/vary/0/path", "has no material \"flor\" (did you mean \"floor\"?)");
    check_refusal(with("/vary/1/name", "floor"), "/vary/1", "there is another parameter \"floor\"");
    check_refusal(with("/options/ray", 5), "/options/ray", "did you mean \"rays\"?");
    check_refusal(with("/options/cells", 0), "/options/cells", "--cells");
    check_refusal(with("/options/backend", ""), "/options/backend", "--backend: the value is an empty text");
    check_refusal(with("/options/backend", "both"), "/options/backend", "a job has one backend");
    check_refusal(with("/scenes", "palace.json"), "/scenes", "there is no scene \"palace.json\"");
    check_refusal(with("/vary/1/values", Json::array()), "/vary/1/values", "the list is empty");
    check_refusal(with("/vary/1/name", "status"), "/vary/1", "is a column of every result");
    check_refusal(with("/vary/1/range", {{"first", 1}, {"last", 2}, {"step", 1}}), "/vary/1", "more than one of");
    check_refusal(with("/vary/1", {{"zip", {four_jobs["vary"][1], {{"path", "/name"}, {"values", {"a"}}}}}}), "/vary/1/zip/1", "has 1 values, the first of the zip 2");
    check_refusal(with("/vary/1", {{"path", "/sun/altitude_deg"}, {"range", {{"first", 10}, {"last", 20}, {"step", -1}}}}), "/vary/1/range/step", "does not lead from 10 to 20");
    check_refusal(with("/vary/1", {{"path", "/sun/date"}, {"dates", {{"first", "2026-02-30"}, {"last", "2026-03-01"}}}}), "/vary/1/dates/first", "is no date");
    check_refusal(with("/vary/1", {{"path", "/sun/date"}, {"dates", {{"first", "-026-01-21"}, {"last", "2026-03-01"}}}}), "/vary/1/dates/first", "is no date");
    check_refusal(with("/vary/1", {{"path", "/sun/time"}, {"times", {{"first", "-1:30"}, {"last", "12:00"}}}}), "/vary/1/times/first", "is no time");
    check_refusal(with("/vary/1", {{"path", "/sky/x"}, {"range", {{"first", 0}, {"last", 1e300}, {"step", 1e-300}}}}), "/vary/1/range", "there are more than 1000000 values");
    check_refusal(with("/sun_above_deg", 80), "study.json:1:1", "no job is left");
    check_refusal(with("/vray", 1), "/vray", "did you mean \"vary\"?");
}

TEST_CASE("a dry run names jobs, groups, memory and time, and leaves nothing", "[cli][batch]") {
    const StudyFolder study;
    const Outcome outcome = study.batch("out", {"--dry-run"});
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.output.find("4 jobs in 1 group;") != std::string::npos);
    CHECK(outcome.output.find("of memory") != std::string::npos);
    CHECK(outcome.output.find("for each of 2 sets of reflectances") != std::string::npos);
    CHECK(outcome.output.find("job 4 (group 1): scene room.json, floor {\"reflectance\":0.6}, sky 20000") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(study / "out"));
    for (const char* scheduler : {"slurm", "parallel"}) {
        const Outcome script = study.batch("out", {"--print", scheduler, "--shards", "3"});
        CHECK(script.exit_code == 0);
        CHECK(script.output.starts_with("#!/bin/bash\n"));
        CHECK(script.output.find("/3") != std::string::npos);
        CHECK_FALSE(std::filesystem::exists(study / "out"));
    }
}

TEST_CASE("pictures are kept job by job", "[cli][batch]") {
    Json study_json = with("/keep", {"images"});
    study_json["vary"].erase(0);
    const StudyFolder study(study_json);
    const Outcome outcome = study.batch("out");
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    const auto pictures = [&](const Json& job) { return study / "out/images" / job["key"].get<std::string>().substr(0, 16) / "views"; };
    const std::vector<Json> jobs = lines_of(study.results("out").at("results.jsonl"));
    CHECK(std::filesystem::exists(pictures(jobs[0]) / "to__window.png"));
    CHECK(std::filesystem::exists(pictures(jobs[1]) / "to__Window_2.exr"));

    // Sensors and pictures: every job has a grid of its own, and its own table of sensors.
    study_json["keep"] = {"sensors", "images"};
    study.put(study_json);
    const Outcome with_sensors = study.batch("with_sensors");
    INFO(with_sensors.errors);
    REQUIRE(with_sensors.exit_code == 0);
    CHECK(study.results("with_sensors").contains("sensors_2.npy"));
    const std::string npy = study.results("with_sensors").at("sensors_2.npy");
    CHECK(npy.find("(1, ") != std::string::npos);
    study_json["keep"] = {"images"};
    study.put(study_json);

    // Nor is a machine that cannot write them.
    const TemporaryFolder bare;
    std::filesystem::copy_file(NATUREL_PROGRAM, bare / "naturel");
    const Outcome without_writer = run_naturel({"batch", study.study(), "--out", (study / "bare").string()}, bare / "naturel");
    CHECK(without_writer.exit_code == 1);
    CHECK(record_count(study / "bare") == 0);

    // A disk that refuses pictures is no fault of the job.
    std::filesystem::remove_all(study / "out");
    std::filesystem::create_directories(study / "out");
    write(study / "out/images", "a file in the place of a folder");
    CHECK(study.batch("out").exit_code == 3);
    std::filesystem::remove(study / "out/images");
    std::filesystem::create_directories(pictures(jobs[0]).parent_path());
    write(pictures(jobs[0]), "another");
    CHECK(study.batch("out").exit_code == 3);
    std::filesystem::remove(pictures(jobs[0]));
    CHECK(study.batch("out").exit_code == 0);
}

TEST_CASE("the article's direct light is that of a run", "[cli][batch]") {
    Json room = Json::parse(small_room);
    room.erase("sun");
    room["direct"] = {{"method", "article"}};
    StudyFolder study;
    write(study / "room.json", room.dump());
    REQUIRE(study.batch("out").exit_code == 0);
    room["materials"]["floor"] = {{"reflectance", 0.6}};
    room["sky"]["horizontal_illuminance_lx"] = 20000;
    write(study / "varied.json", room.dump());
    REQUIRE(run_naturel({"run", (study / "varied.json").string(), "--out", (study / "run").string(), "--backend", "hemicube", "--cells", "32",
                         "--no-error-estimate", "--no-report", "--quiet"})
                .exit_code == 0);
    const Json summary = Json::parse(content_of(study / "run/hemicube/summary.json"));
    const Json job = lines_of(study.results("out").at("results.jsonl"))[3]["figures"];
    // The same steps; only the adaptive method differs, by more than a per cent here.
    CHECK(job["sensor_sets"][0]["illuminance_lx"] == summary["sensor_sets"][0]["illuminance_lx"]);
}

TEST_CASE("a list of jobs that was lost is made again", "[cli][batch]") {
    const StudyFolder study;
    REQUIRE(study.batch("out").exit_code == 0);
    const auto results = study.results("out");
    for (const char* damaged : {"", "{\"naturel\""}) {
        write(study / "out/jobs.jsonl", damaged);
        const Outcome again = study.batch("out");
        REQUIRE(again.exit_code == 0);
        CHECK(again.errors.find("warning: " + (study / "out/jobs.jsonl").string()) != std::string::npos);
        CHECK(study.results("out") == results);
    }
    CHECK(study.batch("out").errors.find("warning") == std::string::npos);
}

TEST_CASE("progress in JSON is an object a line", "[cli][batch]") {
    const StudyFolder study;
    const Outcome outcome = study.batch("out", {"--progress", "json"});
    REQUIRE(outcome.exit_code == 0);
    const std::vector<Json> lines = lines_of(outcome.errors);
    REQUIRE(!lines.empty());
    CHECK(lines.back()["done"] == 4);
    CHECK(lines.back()["jobs"] == 4);
    CHECK(lines.back()["failed"] == 0);
}

TEST_CASE("form factors come from the cache with the same results, and a damaged file does not count", "[cli][batch]") {
    const StudyFolder study;
    REQUIRE(study.batch("plain").exit_code == 0);
    const std::string cache = (study / "cache").string();
    const std::vector<std::string> with_cache{"--cache", cache, "--quiet"};
    REQUIRE(study.batch("first", with_cache).exit_code == 0);
    const auto files = files_below(cache);
    REQUIRE(files.size() == 1);
    const auto file = std::filesystem::path(cache) / files.begin()->first;
    REQUIRE(study.batch("second", with_cache).errors.empty());
    // A value changed in the file under a checksum that fits would show; bytes changed without are not believed.
    std::string damaged = files.begin()->second;
    damaged[damaged.size() / 2] ^= 1;
    for (const std::string& bytes : {damaged, files.begin()->second.substr(0, 100), std::string()}) {
        write(file, bytes);
        std::filesystem::remove_all(study / "third");
        CHECK(study.batch("third", with_cache).errors.find("is damaged") != std::string::npos);
        CHECK((study.results("third") == study.results("plain")));
        CHECK((content_of(file) == files.begin()->second));
    }
    CHECK((study.results("first") == study.results("plain")));
    CHECK((study.results("second") == study.results("plain")));

    // `run` with the same geometry and options uses the same file; another grid needs one of its own, for which the old one goes.
    const std::vector<std::string> run{"run", (study / "room.json").string(), "--backend", "hemicube", "--cells", "32", "--quiet",
                                       "--cache", cache, "--out", (study / "run").string(), "--no-error-estimate"};
    REQUIRE(run_naturel(run).exit_code == 0);
    const auto size_of_cache = [&] {
        std::size_t bytes = 0;
        for (const auto& [name, content] : files_below(cache)) bytes += content.size();
        return bytes;
    };
    const std::size_t limit = size_of_cache() + 100;
    // What a killed process left goes, what another one is just writing stays.
    write(std::filesystem::path(cache) / "old.rows.1-1.part", "");
    write(std::filesystem::path(cache) / "new.rows.1-1.part", "");
    std::filesystem::last_write_time(std::filesystem::path(cache) / "old.rows.1-1.part", std::filesystem::file_time_type::clock::now() - std::chrono::hours(2));
    std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
    auto other = run;
    other.insert(other.end(), {"--seed", "5", "--cache-limit", std::to_string(limit)});
    REQUIRE(run_naturel(other).exit_code == 0);
    CHECK(!files_below(cache).empty());
    CHECK(size_of_cache() <= limit);
    CHECK_FALSE(std::filesystem::exists(std::filesystem::path(cache) / "old.rows.1-1.part"));
    CHECK(std::filesystem::exists(std::filesystem::path(cache) / "new.rows.1-1.part"));
    CHECK_FALSE(std::filesystem::exists(file));
}

TEST_CASE("form factors of another grid with as many patches are not those of the cache", "[cli][form_factors]") {
    const TemporaryFolder folder;
    const auto tables_of = [&](double azimuth_deg, std::vector<std::string> more) {
        // The room is symmetric, so that the spot of the mirrored sun cuts its faces into as many patches.
        Json room = Json::parse(small_room);
        room.erase("views");
        room["sun"]["azimuth_deg"] = azimuth_deg;
        write(folder / "room.json", room.dump());
        more.insert(more.begin(), {"run", (folder / "room.json").string(), "--backend", "hemicube", "--cells", "32", "--quiet", "--out",
                                   (folder / "run").string(), "--no-error-estimate", "--no-report"});
        REQUIRE(run_naturel(more).exit_code == 0);
        return std::pair{content_of(folder / "run/hemicube/sensors.csv"), content_of(folder / "run/hemicube/patches.csv")};
    };
    const std::vector<std::string> cache{"--cache", (folder / "cache").string()};
    const auto first = tables_of(150, cache), second = tables_of(210, cache);
    CHECK(std::ranges::count(first.second, '\n') == std::ranges::count(second.second, '\n'));
    CHECK(files_below(folder / "cache").size() == 2);
    CHECK((second == tables_of(210, {})));
}

TEST_CASE("the schema of studies lists the keys that the reader knows", "[cli][batch]") {
    const Json schema = Json::parse(content_of(NATUREL_SOURCE_DIR "/docs/study.schema.json"));
    for (const naturel::SceneObjectKeys& keys : naturel::study_keys::all) {
        INFO(keys.name);
        const Json& object = keys.name == "study" ? schema : schema["$defs"][std::string(keys.name)];
        std::vector<std::string> known, listed;
        for (const auto& list : {std::vector<std::string_view>(keys.required.begin(), keys.required.end()),
                                 std::vector<std::string_view>(keys.optional.begin(), keys.optional.end())})
            for (const std::string_view key : list)
                if (!key.empty()) known.emplace_back(key);
        for (const auto& [key, value] : object.at("properties").items()) listed.push_back(key);
        std::ranges::sort(known);
        std::ranges::sort(listed);
        CHECK(known == listed);
        CHECK(object.at("additionalProperties") == false);
    }
}

TEST_CASE("the shipped studies can be read", "[cli][batch]") {
    for (const auto& entry : std::filesystem::directory_iterator(NATUREL_SOURCE_DIR "/scenes/studies")) {
        INFO(entry.path().string());
        const Outcome outcome = run_naturel({"batch", entry.path().string(), "--dry-run"});
        INFO(outcome.errors);
        CHECK(outcome.exit_code == 0);
    }
}

TEST_CASE("every way to say values gives the values that it says", "[cli][batch]") {
    const auto dates = [](const char* first, const char* last, const Json& step) {
        Json named{{"first", first}, {"last", last}};
        named.update(step);
        Json study = varying({{"path", "/sun/date"}, {"dates", named}});
        study["options"]["cells"] = 8;
        return values_of(jobs_of(study), "date");
    };
    // A month without that day has its last one, and the step goes on from the first date; 2028 is a leap year.
    CHECK(dates("2027-12-31", "2028-04-30", {{"step_months", 1}}) ==
          std::vector<Json>{"2027-12-31", "2028-01-31", "2028-02-29", "2028-03-31", "2028-04-30"});
    CHECK(dates("2027-01-30", "2027-03-29", {{"step_months", 1}}) == std::vector<Json>{"2027-01-30", "2027-02-28"});
    CHECK(dates("2028-02-28", "2028-03-01", Json::object()) == std::vector<Json>{"2028-02-28", "2028-02-29", "2028-03-01"});
    CHECK(dates("2027-02-27", "2027-03-03", {{"step_days", 2}}) == std::vector<Json>{"2027-02-27", "2027-03-01", "2027-03-03"});

    CHECK(values_of(jobs_of(varying({{"path", "/sun/time"}, {"times", {{"first", "08:30"}, {"last", "10:00"}, {"step_min", 45}}}})), "time") ==
          std::vector<Json>{"08:30", "09:15", "10:00"});
    CHECK(values_of(jobs_of(varying({{"path", "/sun/time"}, {"times", {{"first", "09:15"}, {"last", "11:14"}}}})), "time") ==
          std::vector<Json>{"09:15", "10:15"});

    const auto range = [](const Json& description) {
        return values_of(jobs_of(varying({{"path", "/materials/wall/reflectance"}, {"range", description}})), "reflectance");
    };
    CHECK(range({{"first", 0.1}, {"last", 0.4}, {"step", 0.1}}) == std::vector<Json>{0.1, 0.2, 0.3, 0.4});
    CHECK(range({{"first", 0.4}, {"last", 0.15}, {"step", -0.1}}) == std::vector<Json>{0.4, 0.3, 0.2});
    CHECK(range({{"first", 0.2}, {"last", 0.6}, {"count", 3}}) == std::vector<Json>{0.2, 0.4, 0.6});
}

TEST_CASE("a zip varies parameters together, a list changes what each entry says", "[cli][batch]") {
    Json study = four_jobs;
    study["vary"] = Json::parse(R"([
        {"zip": [{"path": "/materials/wall/reflectance", "values": [0.3, 0.7]},
                 {"name": "level", "path": "/sky/horizontal_illuminance_lx", "range": {"first": 5000, "last": 8000, "step": 3000}}]},
        {"name": "variant", "list": [
            {"label": "as it is"},
            {"label": "dark floor, coarse", "set": {"/materials/floor": {"reflectance": 0.1}}, "options": {"cells": 16}}]}
    ])");
    const std::vector<Json> jobs = jobs_of(study);
    CHECK(values_of(jobs, "reflectance") == std::vector<Json>{0.3, 0.3, 0.7, 0.7});
    CHECK(values_of(jobs, "level") == std::vector<Json>{5000, 5000, 8000, 8000});
    CHECK(values_of(jobs, "variant") == std::vector<Json>{"as it is", "dark floor, coarse", "as it is", "dark floor, coarse"});
    const auto mean_lx = [&](std::size_t job) { return jobs[job]["figures"]["sensor_sets"][0]["illuminance_lx"]["mean"].get<double>(); };
    CHECK(mean_lx(2) > mean_lx(0));  // lighter walls under a brighter sky
    CHECK(mean_lx(1) < mean_lx(0));  // a darker floor
    CHECK(jobs[0]["group"] != jobs[1]["group"]);  // with form factors of their own

    // What a value does is what the scene with that value shows.
    const StudyFolder folder;
    Json room = Json::parse(small_room);
    room["materials"]["wall"]["reflectance"] = 0.7;
    room["materials"]["floor"] = {{"reflectance", 0.1}};
    room["sky"]["horizontal_illuminance_lx"] = 8000;
    write(folder / "room.json", room.dump());
    folder.put({{"naturel_study", 1}, {"scenes", "room.json"}, {"options", {{"backend", "hemicube"}, {"cells", 16}}}, {"vary", Json::array()}});
    REQUIRE(folder.batch("out").exit_code == 0);
    CHECK(lines_of(folder.results("out").at("results.jsonl"))[0]["figures"] == jobs[3]["figures"]);
}

TEST_CASE("options that count take whole numbers of a range, and say where others stand", "[cli][batch]") {
    const auto cells = [](const Json& values) {
        Json study = four_jobs;
        study["options"].erase("cells");
        study["vary"] = Json::parse(R"([{"option": "cells"}])");
        study["vary"][0].update(values);
        return study;
    };
    const std::vector<Json> jobs = jobs_of(cells({{"range", {{"first", 16}, {"last", 32}, {"step", 16}}}}));
    CHECK(values_of(jobs, "cells") == std::vector<Json>{16, 32});
    CHECK(jobs[0]["figures"] != jobs[1]["figures"]);
    CHECK(values_of(jobs_of(cells({{"range", {{"first", 16}, {"last", 32}, {"count", 2}}}})), "cells") == std::vector<Json>{16, 32});
    check_refusal(cells({{"values", {64, 64.5}}}), "/vary/0/values/1", "--cells: \"64.5\" is not a whole number from 1 to 4096");
    check_refusal(cells({{"range", {{"first", 16}, {"last", 17}, {"step", 0.5}}}}), "/vary/0/range", "--cells: \"16.5\" is not a whole number from 1 to 4096");
}

TEST_CASE("jobs with the sun below the limit are left out", "[cli][batch]") {
    Json study = varying({{"path", "/sun/time"}, {"times", {{"first", "04:00"}, {"last", "22:00"}, {"step_min", 360}}}});
    study["sun_above_deg"] = 2;
    // In June at 47 degrees the sun stands above 2 degrees at 10:00 and 16:00, not at 4:00 and 22:00.
    CHECK(values_of(jobs_of(study), "time") == std::vector<Json>{"10:00", "16:00"});
    const StudyFolder folder(study);
    CHECK(folder.batch("out", {"--dry-run"}).output.find("2 more are left out: the sun is too low") != std::string::npos);
    study["sun_above_deg"] = -60;
    CHECK(jobs_of(study).size() == 4);
}

#ifndef __SANITIZE_ADDRESS__  // whose own memory is several times that
TEST_CASE("the memory that a study is forecast to need is enough, and not many times as much", "[cli][batch]") {
    Json pictures = with("/keep", {"images"});
    pictures["vary"].erase(0);
    for (const std::string& backend : backend_names()) {
        Json large = pictures;
        large["options"] = {{"backend", backend}, {"quality", "draft"}};
        large["set"] = {{"/views/0/width", 1200}, {"/views/0/height", 900}, {"/views/1/width", 500}, {"/views/1/height", 400}};
        large["vary"][0]["values"] = {10000};
        Json fine = four_jobs;
        fine["options"] = {{"backend", backend}, {"quality", "draft"}, {"grid_spacing", 0.2}};
        Json small = four_jobs, small_pictures = pictures;
        small["options"]["backend"] = small_pictures["options"]["backend"] = backend;
        if (backend != "hemicube") small["options"].erase("cells"), small_pictures["options"].erase("cells");
        for (const Json& study : {small, fine, small_pictures, large}) {
            const StudyFolder folder(study);
            const double forecast = forecast_bytes(folder.batch("out", {"--dry-run"}).output);
            const Outcome outcome = folder.batch("out");
            REQUIRE(outcome.exit_code == 0);
            INFO(study.dump() << "\nforecast " << forecast / 1e6 << " MB, peak " << outcome.peak_memory_bytes / 1e6 << " MB");
            CHECK(forecast >= outcome.peak_memory_bytes);
            // Rows are forecast at their longest, and with what a repair takes at most.
            CHECK(forecast <= 2.5 * outcome.peak_memory_bytes);
        }
    }
}
#endif

TEST_CASE("jobs with one grid compute form factors once, whatever else differs", "[cli][batch]") {
    Json pictures = with("/keep", {"images", "sensors"});
    pictures["vary"][1]["values"] = {10000, 20000};
    Json tolerances = with("/keep", {"sensors"});
    tolerances["vary"] = Json::parse(R"([{"option": "radiosity_tolerance", "values": [1e-3, 1e-5]},
                                         {"path": "/primaries", "values": ["srgb", "ebu"]},
                                         {"option": "exposure", "values": ["auto", "white=100"]}])");
    for (const Json& study : {pictures, tolerances}) {
        const StudyFolder folder(study);
        const Outcome whole = folder.batch("whole", {"--progress", "json"});
        INFO(whole.errors);
        REQUIRE(whole.exit_code == 0);
        CHECK(count_of(whole.errors, "\"stage\":\"form factors\"") == 1);
        // In processes of their own jobs share nothing.
        const std::size_t jobs = lines_of(folder.results("whole").at("results.jsonl")).size();
        std::vector<std::string> merge{"merge"};
        for (std::size_t shard = 1; shard <= jobs; ++shard) {
            const std::string out = "apart_" + std::to_string(shard);
            REQUIRE(folder.batch(out, {"--shard", std::to_string(shard) + "/" + std::to_string(jobs)}).exit_code == 0);
            merge.push_back((folder / out).string());
        }
        merge.insert(merge.end(), {"--out", (folder / "merged").string()});
        const Outcome merged = run_naturel(merge);
        INFO(merged.errors);
        REQUIRE(merged.exit_code == 0);
        CHECK((folder.results("merged") == folder.results("whole")));
        CHECK((files_below(folder / "merged/images") == files_below(folder / "whole/images")));
    }
    // Exposure is not even a reason for another group.
    const StudyFolder folder(tolerances);
    CHECK(folder.batch("out", {"--dry-run"}).output.find("8 jobs in 4 groups") != std::string::npos);
}

TEST_CASE("form factors that took long are not lost by a kill, and go when the study is complete", "[cli][batch][slow]") {
    Json study_json = four_jobs;
    study_json["options"] = {{"backend", "hemicube"}, {"cells", 2048}, {"grid_spacing", 0.25}};
    const StudyFolder study(study_json);
    {
        RunningProgram program({"batch", study.study(), "--out", (study / "out").string(), "--threads", "2"});
        const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(120);
        while (std::chrono::steady_clock::now() < deadline && !std::filesystem::exists(study / "out/results.csv")) {
            const auto files = files_below(study / "out/form_factors");
            if (std::ranges::any_of(files, [](const auto& file) { return file.first.ends_with(".rows"); })) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        program.send(SIGKILL);
        program.wait();
    }
    REQUIRE(!files_below(study / "out/form_factors").empty());
    const Outcome rest = study.batch("out", {"--progress", "json"});
    CHECK(rest.exit_code == 0);
    CHECK(count_of(rest.errors, "\"stage\":\"form factors\"") == 0);
    CHECK_FALSE(std::filesystem::exists(study / "out/form_factors"));
    REQUIRE(study.batch("whole").exit_code == 0);
    CHECK((study.results("out") == study.results("whole")));
}

TEST_CASE("results with failed jobs do not depend on where the study lies and how it is called", "[cli][batch]") {
    Json study_json = with("/vary/1/values", {10000, -1});
    study_json["invalid_jobs"] = "record";
    const StudyFolder study(study_json), elsewhere(study_json);
    REQUIRE(study.batch("out").exit_code == 5);
    REQUIRE(elsewhere.batch("out").exit_code == 5);
    CHECK((study.results("out") == elsewhere.results("out")));
    // Written on other lines, and called by another path.
    write(study / "study.json", "\n\n" + content_of(study / "study.json"));
    const auto roundabout = study / "out" / ".." / "study.json";
    REQUIRE(run_naturel({"batch", roundabout.string(), "--out", (study / "again").string()}).exit_code == 5);
    CHECK((study.results("out") == study.results("again")));
    const std::string error = lines_of(study.results("out").at("results.jsonl"))[1]["error"];
    CHECK(error.starts_with("/vary/1/values/1: scene \"room.json\" with /sky/horizontal_illuminance_lx = -1: /sky/horizontal_illuminance_lx: "));
}

TEST_CASE("rows of results say which scene and which row of the sensors they are of", "[cli][batch]") {
    check_refusal(with("/vary/1/name", "key"), "/vary/1", "is a column of every result");

    Json study_json = with("/scenes", {"room.json", "north/room.json"});
    study_json["vary"] = Json::parse(R"([{"name": "sky", "path": "/sky/horizontal_illuminance_lx", "values": [-1, 10000]}])");
    study_json["keep"] = {"sensors"};
    study_json["invalid_jobs"] = "record";
    const StudyFolder study(study_json);
    std::filesystem::create_directory(study / "north");
    std::string north(small_room);
    const std::string from_south = "\"azimuth_deg\": 180";
    north.replace(north.find(from_south), from_south.size(), "\"azimuth_deg\": 0");
    write(study / "north/room.json", north);
    REQUIRE(study.batch("out").exit_code == 5);
    const auto files = study.results("out");
    CHECK(values_of(lines_of(files.at("results.jsonl")), "scene") == std::vector<Json>{"room.json", "room.json", "north/room.json", "north/room.json"});
    std::istringstream table(files.at("results.csv"));
    std::vector<std::string> rows;
    for (std::string line; std::getline(table, line);) rows.push_back(line);
    REQUIRE(rows.size() == 5);
    CHECK(rows[0].starts_with("job,group,key,row,scene,sky,status,"));
    const auto row_of = [&](std::size_t line) {
        std::istringstream cells(rows[line]);
        std::string cell;
        for (int k = 0; k < 4; ++k) std::getline(cells, cell, ',');
        return cell;
    };
    CHECK(row_of(1).empty());  // invalid: no group, no row of its sensors
    CHECK(row_of(2) == "0");
    CHECK(row_of(3).empty());
    CHECK(row_of(4) == "1");
}

TEST_CASE("a parameter without effect is named", "[cli][batch]") {
    Json study_json = varying({{"path", "/sun/time"}, {"values", {"10:00", "12:00"}}});
    study_json["vary"].push_back(Json::parse(R"({"path": "/sun", "values": [{"altitude_deg": 30, "azimuth_deg": 180}]})"));
    const StudyFolder study(study_json);
    const Outcome outcome = study.batch("out");
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.errors.find("warning: job 2 equals job 1 although \"time\" differs") != std::string::npos);
    // The same value twice is no fault.
    study.put(with("/vary/1/values", {10000, 10000}));
    CHECK(study.batch("twice").errors.find("warning") == std::string::npos);
}

TEST_CASE("who waits for a folder says so and can be interrupted", "[cli][batch]") {
    const StudyFolder study;
    REQUIRE(study.batch("out").exit_code == 0);
    const int lock = ::open((study / "out/lock").c_str(), O_RDWR | O_CLOEXEC);
    REQUIRE(lock >= 0);
    REQUIRE(::flock(lock, LOCK_EX) == 0);
    for (const std::vector<std::string>& command : {std::vector<std::string>{"batch", study.study(), "--out", (study / "out").string()},
                                                    std::vector<std::string>{"merge", (study / "out").string()}}) {
        RunningProgram program(command);
        std::this_thread::sleep_for(std::chrono::milliseconds(2500));
        program.send(SIGINT);
        auto end = std::async(std::launch::async, [&] { return program.wait(); });
        if (end.wait_for(std::chrono::seconds(5)) != std::future_status::ready) program.send(SIGKILL);
        const Outcome outcome = end.get();
        CHECK(outcome.exit_code == 130);
        CHECK(outcome.errors.find("waiting for another naturel that writes lists or results in " + (study / "out").string()) != std::string::npos);
    }
    ::close(lock);
}

TEST_CASE("damage between records is told while jobs are missing for it, and no longer", "[cli][batch]") {
    const StudyFolder study(many_jobs(3));
    REQUIRE(study.batch("out").exit_code == 0);
    const auto file = study / "out/records/shard_1_of_1.records";
    std::string records = content_of(file);
    records[records.find("NATURJOB", 1) + 200] ^= 1;
    write(file, records);
    CHECK(run_naturel({"merge", (study / "out").string()}).errors.find("damaged bytes between records are skipped") != std::string::npos);
    CHECK(study.batch("out").errors.find("damaged bytes between records are skipped") != std::string::npos);
    CHECK(study.batch("out").errors.find("damaged") == std::string::npos);
    CHECK(run_naturel({"merge", (study / "out").string()}).errors.empty());
}

TEST_CASE("words of a study are true and name what is wrong", "[cli][batch]") {
    Json hasty = with("/options/max_iterations", 1);
    hasty["options"]["radiosity_tolerance"] = 1e-9;
    const StudyFolder study(hasty);
    const Outcome computed = study.batch("out");
    CHECK(computed.exit_code == 4);
    CHECK(computed.output.find("  4 jobs did NOT converge\n") != std::string::npos);
    const Outcome merged = run_naturel({"merge", (study / "out").string()});
    CHECK(merged.exit_code == 4);
    CHECK(merged.output.find("  4 jobs did NOT converge\n") != std::string::npos);

    const Outcome again = study.batch("out", {"--progress", "json"});
    CHECK(again.errors.find("4 of 4 jobs are finished already") != std::string::npos);
    CHECK(again.output.find("0 of 0") == std::string::npos);
    const Outcome planned = study.batch("out", {"--dry-run"});
    CHECK(planned.output.find("4 of 4 jobs are finished already") != std::string::npos);
    CHECK(planned.output.find("Together about 0 s of one core") != std::string::npos);
    CHECK(planned.output.find("\njob ") == std::string::npos);

    hasty["keep"] = {"sensors"};
    study.put(hasty);
    CHECK(study.batch("out").errors.find("its options or \"keep\" have changed") != std::string::npos);

    write(study / "study.json", "");
    const Outcome empty = study.batch("other");
    CHECK(empty.exit_code == 3);
    CHECK(empty.errors.find("the file ends too early (a study, an object in { }, is expected here)") != std::string::npos);
}

TEST_CASE("all that a study says beside JSON is JSON", "[cli][batch]") {
    Json study_json = with("/vary/1/values", {10000, -1});
    study_json["invalid_jobs"] = "record";
    const StudyFolder study(study_json);
    write(study / "file", "in the place of a folder");
    const std::vector<std::string> json{"--progress", "json", "--cache", (study / "file/cache").string()};
    const Outcome failed = study.batch("out", json);
    CHECK(failed.exit_code == 5);
    std::string warnings, notes;
    for (const Json& line : lines_of(failed.errors)) {
        warnings += line.value("warning", "");
        notes += line.value("note", "");
    }
    CHECK(warnings.find("cache: the folder " + (study / "file/cache").string() + " cannot be made: Not a directory") != std::string::npos);
    CHECK(notes.find("job 2 failed: ") != std::string::npos);
    CHECK(lines_of(study.batch("out", json).errors).size() >= 2);
    const Outcome stopped = study.batch("stopped", {"--progress", "json", "--max-failures", "0"});
    CHECK(lines_of(stopped.errors).back().at("error").get<std::string>().starts_with("stopped after 1 failure"));
    const Outcome refused = study.batch("file", {"--progress", "json"});
    CHECK(refused.exit_code == 3);
    CHECK(lines_of(refused.errors).back().contains("error"));
}
