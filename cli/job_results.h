#pragma once
#include <cstddef>
#include <filesystem>

#include "cli/job_list.h"

namespace naturel {

/// How far a study is.
struct JobCounts {
    std::size_t done = 0, failed = 0, missing = 0, not_converged = 0;
};

/// Writes results.jsonl, results.csv and, if they were kept, the light on sensors as sensors_N.csv and sensors_N.npy: a row per
/// job of the list whatever became of it. The same records give the same bytes. Throws InputError.
JobCounts write_results(const std::filesystem::path& folder, const JobList& list, const FinishedJobs& finished);

/// The same count without writing, and without those that did not converge.
JobCounts count_jobs(const JobList& list, const FinishedJobs& finished);

/// 'study "year": 3 jobs done, 0 failed, 1 missing'
std::string account_of(const JobList& list, const JobCounts& counts);
/// A line on jobs that did not converge, where there are any.
std::string account_of_convergence(const JobCounts& counts);

}  // namespace naturel
