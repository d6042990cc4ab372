#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/job_records.h"
#include "cli/study_jobs.h"

namespace naturel {

/// A job as the folder of a study lists it.
struct ListedJob {
    std::string key;
    std::string group_key;
    std::size_t group = 0;  ///< from 1; 0 of an invalid scene
    nlohmann::ordered_json parameters;
};

/// Tells the jobs of a study apart, in results and in the names of their folders of pictures.
inline std::string short_key(const std::string& key) { return key.substr(0, 16); }

/// What the jobs of a folder are: its file jobs.jsonl. Results can be written from it and the records alone.
struct JobList {
    std::string study;
    std::string version;  ///< of naturel
    bool sensors = false;
    std::vector<ListedJob> jobs;
};

JobList list_jobs(const Study& study, const StudyJobs& jobs);

/// Text of jobs.jsonl.
std::string job_list_text(const JobList& list);

/// Throws InputError if the folder has no list, or a damaged one.
JobList read_job_list(const std::filesystem::path& folder);

/// Puts the list into a folder that has none, a damaged one, or one that only lacks jobs. Throws InputError if the folder belongs to
/// another study or version: nothing is changed then. Returns a warning, or nothing.
std::optional<std::string> keep_job_list(const std::filesystem::path& folder, const JobList& list);

enum class JobState { missing, failed, done };

/// The records of a folder, by the key of what they are about.
class FinishedJobs {
public:
    /// Reads every file of records below `folder`. Throws InputError.
    explicit FinishedJobs(const std::filesystem::path& folder) { add(folder); }
    /// And those of another folder; one that has none adds none.
    void add(const std::filesystem::path& folder);

    JobState state(const std::string& key) const;
    /// Null where there is none.
    const RecordPlace* find(const std::string& key) const;

    /// What had to be skipped, for a warning; empty if all is well.
    const std::vector<std::string>& damages() const { return damages_; }

private:
    struct Finished {
        RecordPlace place;
        JobState state = JobState::missing;
    };
    std::map<std::string, Finished> finished_;
    std::vector<std::string> damages_;
};

/// "records" below a folder.
std::filesystem::path records_folder(const std::filesystem::path& folder);

}  // namespace naturel
