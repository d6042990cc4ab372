#pragma once
#include <cstddef>
#include <vector>

#include "cli/shard.h"
#include "cli/study_jobs.h"

namespace naturel {

/// CPU time of a group: of its form factors, before its first job, before the first job of each set, and of each job.
struct GroupCost {
    double form_factor_seconds = 0.0, first_seconds = 0.0, set_seconds = 0.0, job_seconds = 0.0;
};

/// The jobs of one shard (of equal ones the first), by their number in `jobs`, those of groups that share form factors together, in these those of a group, and in it those of a set. Jobs stand in a row like
/// that, and the row is cut where the sum of the forecast costs asks for it: at most one group is split at each cut.
std::vector<std::size_t> jobs_of_shard(const StudyJobs& jobs, const std::vector<GroupCost>& costs, const Shard& shard);

}  // namespace naturel
