#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/study.h"
#include "core/progress.h"
#include "core/scene.h"

namespace naturel {

/// The options that jobs run with. Parsing a command line takes longer than many a job.
class RunOptionSets {
public:
    /// words: names as in a study, and values. The answer lives as long as this object. Thread-safe. Throws InputError.
    const RunOptions& of(const std::map<std::string, std::string>& words);

private:
    std::mutex mutex_;
    std::map<std::map<std::string, std::string>, RunOptions> sets_;
};

/// What a job computes.
struct JobInput {
    Scene scene;
    const RunOptions* options = nullptr;  ///< of the RunOptionSets
};

/// One combination of a study's scenes and parameters.
struct StudyJob {
    std::size_t combination = 0;
    std::string key;          ///< SHA-256 of everything its results depend on
    std::size_t row_set = 0;  ///< of form factors, which groups may have in common; one group belongs to one
    std::size_t group = 0;    ///< into StudyJobs::group_keys
    std::size_t set = 0;      ///< of reflectances, glazings and divisions of the sky: what SkySeries works out once for each
    std::string invalid;      ///< why nothing can be computed; empty if all is well
    std::shared_ptr<const Scene> scene;  ///< kept where memory allows: reading takes as long as many a job
};

/// Jobs of one group share assembly, grid, visibility and all that SkySeries works out once. Form factors are shared by groups, too.
struct StudyJobs {
    std::vector<StudyJob> jobs;
    std::vector<std::string> group_keys;
    std::size_t row_sets = 0;  ///< how many: StudyJob::row_set is less
    std::size_t sets = 0;      ///< of all groups; one belongs to one group
    std::size_t left_out = 0;  ///< combinations whose sun is too low
};

/// Name and value of every parameter of a combination, the scene's name first.
nlohmann::ordered_json parameters_of(const Study& study, std::size_t combination);

/// The scene and options of a job. Throws InputError that names the place in the study.
JobInput input_of(const Study& study, const StudyJob& job, RunOptionSets& options);

/// Reads every job of a study, in parallel. Unless the study records invalid jobs, the first one is refused: InputError.
StudyJobs find_jobs(const Study& study, RunOptionSets& options, Progress& progress);

}  // namespace naturel
