#include "cli/job_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "cli/file_writer.h"
#include "cli/json_text.h"
#include "core/errors.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

std::filesystem::path list_file(const std::filesystem::path& folder) {
    return folder / "jobs.jsonl";
}

}  // namespace

std::filesystem::path records_folder(const std::filesystem::path& folder) {
    return folder / "records";
}

JobList list_jobs(const Study& study, const StudyJobs& jobs) {
    JobList list{study.name, NATUREL_VERSION, study.keep.sensors, {}};
    for (const StudyJob& job : jobs.jobs) {
        ListedJob listed{job.key, {}, 0, parameters_of(study, job.combination)};
        if (job.invalid.empty()) {
            listed.group = job.group + 1;
            listed.group_key = jobs.group_keys[job.group];
        }
        list.jobs.push_back(std::move(listed));
    }
    return list;
}

std::string job_list_text(const JobList& list) {
    std::string text =
        json_line({{"naturel", list.version}, {"study", list.study}, {"sensors", list.sensors}, {"jobs", list.jobs.size()}}) + '\n';
    std::size_t number = 0;
    for (const ListedJob& job : list.jobs)
        text += json_line({{"job", ++number}, {"key", job.key}, {"group", job.group}, {"group_key", job.group_key}, {"parameters", job.parameters}}) + '\n';
    return text;
}

JobList read_job_list(const std::filesystem::path& folder) {
    const std::filesystem::path file = list_file(folder);
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw InputError(file.string(), "cannot be read (this is not the folder of a study)");
    JobList list;
    try {
        std::string line;
        std::getline(stream, line);
        const Json head = Json::parse(line);
        list.version = head.at("naturel").get<std::string>();
        list.study = head.at("study").get<std::string>();
        list.sensors = head.at("sensors").get<bool>();
        while (std::getline(stream, line)) {
            Json job = Json::parse(line);
            list.jobs.push_back({job.at("key").get<std::string>(), job.at("group_key").get<std::string>(), job.at("group").get<std::size_t>(),
                                 std::move(job.at("parameters"))});
        }
        if (list.jobs.size() != head.at("jobs").get<std::size_t>()) throw InputError(file.string(), "ends too early (write it again with `naturel batch`)");
    } catch (const Json::exception& error) {
        throw InputError(file.string(), fmt::format("is damaged: {} (write it again with `naturel batch`)", error.what()));
    }
    return list;
}

std::optional<std::string> keep_job_list(const std::filesystem::path& folder, const JobList& list) {
    const std::string text = job_list_text(list);
    const std::filesystem::path file = list_file(folder);
    std::optional<std::string> warning;
    std::error_code error;
    if (std::filesystem::exists(file, error)) {
        std::optional<JobList> read;
        try {
            read = read_job_list(folder);
        } catch (const InputError& problem) {
            // Records say themselves whose they are.
            warning = fmt::format("{}; the list is made again", problem.what());
        }
        if (read && job_list_text(*read) == text) return {};
        const JobList before = read ? std::move(*read) : JobList{{}, list.version, false, {}};
        constexpr auto remedy = "choose another folder for --out, or remove this one";
        if (before.version != list.version)
            throw InputError(file.string(), fmt::format("was made by naturel {}, this is {} ({})", before.version, list.version, remedy));
        std::set<std::string_view> keys;
        for (const ListedJob& job : list.jobs) keys.insert(job.key);
        const auto foreign = std::ranges::find_if(before.jobs, [&](const ListedJob& job) { return job.group != 0 && !keys.contains(job.key); });
        if (foreign != before.jobs.end())
            throw InputError(file.string(), fmt::format("belongs to another study: its job {}, {:.200}, is none of this one, or its scene, its options or "
                                                        "\"keep\" have changed (a study may get more jobs, not other ones: {})",
                                                        foreign - before.jobs.begin() + 1, foreign->parameters.dump(), remedy));
    }
    write_file_for_good(file, text);
    return warning;
}

void FinishedJobs::add(const std::filesystem::path& folder) {
    std::error_code error;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : entries_of(records_folder(folder), error))
        if (entry.path().extension() == ".records") files.push_back(entry.path());
    if (error && error != std::errc::no_such_file_or_directory)
        throw InputError(records_folder(folder).string(), fmt::format("cannot be read: {}", error.message()));
    std::ranges::sort(files);
    for (const std::filesystem::path& file : files) {
        const RecordScan scan = scan_records(file);
        if (scan.damaged_bytes > 0)
            damages_.push_back(fmt::format("{}: {} damaged bytes between records are skipped, and the jobs they were of are missing", file.string(),
                                           scan.damaged_bytes));
        for (const auto& [place, line] : scan.records) {
            const Json json = Json::parse(line);
            const JobState state = json.at("status") == "failed" ? JobState::failed : JobState::done;
            Finished& finished = finished_[json.at("key").get<std::string>()];
            if (state >= finished.state) finished = {place, state};
        }
    }
}

JobState FinishedJobs::state(const std::string& key) const {
    const auto found = finished_.find(key);
    return found == finished_.end() ? JobState::missing : found->second.state;
}

const RecordPlace* FinishedJobs::find(const std::string& key) const {
    const auto found = finished_.find(key);
    return found == finished_.end() ? nullptr : &found->second.place;
}

}  // namespace naturel
