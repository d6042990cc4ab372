#pragma once
#include <string>

#include "cli/options.h"

namespace naturel {

/// Words for the scheduler; the program schedules nothing itself.
struct ScriptNeeds {
    std::string name;
    std::size_t shards = 1;
    double bytes = 0.0;    ///< memory of a shard, at most
    double seconds = 0.0;  ///< CPU time of a shard
};

/// A job script that runs the study of `options` in shards, under Slurm or GNU parallel.
std::string job_script(const BatchOptions& options, const ScriptNeeds& needs);

}  // namespace naturel
