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

/// The same count without writing.
JobCounts count_jobs(const JobList& list, const FinishedJobs& finished);

}  // namespace naturel
