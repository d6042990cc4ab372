#include "cli/job_scripts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace naturel {
namespace {

/// One word for a shell, whatever is in it.
std::string quoted(const std::string& word) {
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

/// In double quotes of a line of options, where Slurm fills in numbers for its own percent signs.
std::string for_slurm(const std::string& path) {
    std::string text;
    for (const char c : path) text += c == '%' ? std::string("%%") : std::string(1, c);
    return text;
}

std::string program() {
    std::error_code error;
    const std::filesystem::path path = std::filesystem::read_symlink("/proc/self/exe", error);
    return error ? "naturel" : path.string();
}

/// What every shard runs, but for --shard.
std::string command(const BatchOptions& options) {
    std::string text = fmt::format("{} batch {} --out {}", quoted(program()), quoted(std::filesystem::absolute(options.study).string()),
                                   quoted(std::filesystem::absolute(options.out).string()));
    if (!options.cache.folder.empty()) text += fmt::format(" --cache {}", quoted(std::filesystem::absolute(options.cache.folder).string()));
    text += fmt::format(" --cache-limit {:.0f}", options.cache.limit_bytes);
    if (options.max_failures) text += fmt::format(" --max-failures {}", *options.max_failures);
    if (options.retry_failed) text += " --retry-failed";
    return text;
}

std::string slurm_script(const BatchOptions& options, const ScriptNeeds& needs) {
    const std::string out = std::filesystem::absolute(options.out).string();
    // Twice the forecast and some more: nodes differ.
    const double minutes = 10.0 + std::ceil(2.0 * needs.seconds / 60.0 / options.threads);
    const double megabytes = 200.0 + std::ceil(1.5 * needs.bytes / 1e6);
    std::string name;
    for (const char c : needs.name) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    return fmt::format(R"(#!/bin/bash
#SBATCH --job-name={0}
#SBATCH --array=1-{1}
#SBATCH --cpus-per-task={2}
#SBATCH --mem={3:.0f}M
#SBATCH --time={4:.0f}
#SBATCH --requeue
#SBATCH --open-mode=append
# Slurm wants this folder before it starts a job: mkdir -p {5}
#SBATCH --output="{6}/log/shard_%a.txt"
# The last shard to end writes results.csv. Tasks that failed may be given again: sbatch --array=3,7 SCRIPT
exec {7} --threads {2} --shard "$SLURM_ARRAY_TASK_ID/{1}"
)",
                       name, needs.shards, options.threads, megabytes, minutes, quoted(out + "/log"), for_slurm(out), command(options));
}

std::string parallel_script(const BatchOptions& options, const ScriptNeeds& needs) {
    return fmt::format(R"(#!/bin/bash
# {0} shards, at most JOBS at a time (all processors by default, {1} threads each). Add machines with, for example,
# PARALLEL='--sshlogin host1,host2'. The last shard to end writes results.csv. Given again, it goes on.
seq 1 {0} | parallel --jobs "${{JOBS:-$(( ($(nproc) + {1} - 1) / {1} ))}}" --line-buffer --tagstring 'shard {{}}' --retries 3 \
    {2} --threads {1} --shard '{{}}/{0}'
)",
                       needs.shards, options.threads, command(options));
}

}  // namespace

std::string job_script(const BatchOptions& options, const ScriptNeeds& needs) {
    return options.print == JobScript::slurm ? slurm_script(options, needs) : parallel_script(options, needs);
}

}  // namespace naturel
