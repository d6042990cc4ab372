#include "cli/batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <new>
#include <set>
#include <span>

#include "cli/file_writer.h"
#include "cli/forecast.h"
#include "cli/image_writer.h"
#include "cli/job_figures.h"
#include "cli/job_group.h"
#include "cli/job_list.h"
#include "cli/job_results.h"
#include "cli/job_scripts.h"
#include "cli/job_shards.h"
#include "cli/study_jobs.h"
#include "core/errors.h"

namespace naturel {
namespace {

/// Whether stderr is for people.
bool tells_in_words(const BatchOptions& options) {
    return !options.quiet && options.progress == ProgressForm::text;
}

/// Thrown when --max-failures is exceeded.
struct TooManyFailures {};

/// What computing jobs ended with: their records, or why there are none.
struct Attempt {
    std::vector<std::string> records;
    std::string error;  ///< empty: all went well
};

/// Failures of a job are records; what ends the program (Interrupted, a disk that is full) passes.
Attempt attempt(const std::function<std::vector<std::string>()>& compute) {
    try {
        return {compute(), {}};
    } catch (const WriteError&) {
        throw;
    } catch (const InputError& error) {
        return {{}, error.what()};
    } catch (const Interrupted&) {
        throw;
    } catch (const std::bad_alloc&) {
        return {{}, "out of memory (a coarser grid, smaller pictures or fewer threads need less)"};
    } catch (const std::exception& error) {
        return {{}, fmt::format("internal fault: {}", error.what())};
    }
}

/// Jobs are computed some at a time: enough to keep all threads busy, few enough that little is lost when the process is killed.
class ChunkSize {
public:
    std::size_t get() const { return size_; }
    void learn(double seconds) {
        if (seconds < 0.25) size_ = std::min<std::size_t>(2 * size_, 4096);
        if (seconds > 1.0) size_ = std::max<std::size_t>(1, size_ / 2);
    }

private:
    std::size_t size_ = 8;
};

class BatchRun {
public:
    BatchRun(const BatchOptions& options, const Study& study, RunOptionSets& sets, const StudyJobs& jobs, RecordFile& records, JobProgress& progress)
        : options_(options), study_(study), sets_(sets), jobs_(jobs), records_(records), progress_(progress), jobs_of_set_(jobs.sets, 0) {
        for (const StudyJob& job : jobs.jobs)
            if (job.invalid.empty()) ++jobs_of_set_[job.set];
    }

    /// pending: jobs that are not finished, those of a group together. known: what the folder holds already.
    void compute(std::span<const std::size_t> pending, const FinishedJobs& known) {
        for (std::size_t first = 0; first < pending.size();) {
            std::size_t last = first;
            const auto kind = [&](std::size_t k) {
                const StudyJob& job = jobs_.jobs[pending[k]];
                return std::pair(job.group, job.invalid.empty());
            };
            while (last < pending.size() && kind(last) == kind(first)) ++last;
            const std::span<const std::size_t> group = pending.subspan(first, last - first);
            if (!kind(first).second)
                for (const std::size_t job : group) fail(job, jobs_.jobs[job].invalid);
            else if (study_.keep.images)
                compute_with_pictures(group);
            else
                compute_group(group, known);
            first = last;
        }
    }

private:
    PendingJob pending_job(std::size_t job) {
        return {jobs_.jobs[job].key, input_of(study_, jobs_.jobs[job], sets_), jobs_of_set_[jobs_.jobs[job].set]};
    }

    void done(const std::vector<std::string>& records, std::size_t jobs) {
        std::string bytes;
        for (const std::string& record : records) bytes += record;
        records_.append(bytes);
        progress_.add(jobs, 0);
    }

    void fail(std::size_t job, const std::string& error) {
        records_.append(failed_record(jobs_.jobs[job].key, error));
        progress_.add(0, 1);
        if (tells_in_words(options_)) print_at_once(stderr, fmt::format("job {} failed: {}\n", job + 1, error));
        if (options_.max_failures && progress_.failed() > *options_.max_failures) throw TooManyFailures{};
    }

    void compute_group(std::span<const std::size_t> pending, const FinishedJobs& known) {
        std::unique_ptr<JobGroup> group;
        const Attempt start = attempt([&] {
            group = std::make_unique<JobGroup>(pending_job(pending.front()).input, options_.cache, progress_);
            return std::vector<std::string>();
        });
        if (!start.error.empty()) {
            for (const std::size_t job : pending) fail(job, start.error);
            return;
        }
        const std::string& group_key = jobs_.group_keys[jobs_.jobs[pending.front()].group];
        if (study_.keep.sensors && known.find(group_key) == nullptr) done({sensors_record(group_key, group->scene(), group->sensors())}, 0);

        const auto solve = [&](std::span<const std::size_t> jobs) {
            return attempt([&] {
                std::vector<PendingJob> inputs;
                for (const std::size_t job : jobs) inputs.push_back(pending_job(job));
                return group->records_of(inputs, study_.keep.sensors, progress_);
            });
        };
        for (std::size_t first = 0; first < pending.size();) {
            const std::span<const std::size_t> chunk = pending.subspan(first, std::min(chunk_.get(), pending.size() - first));
            const double start_s = progress_.seconds();
            const Attempt together = solve(chunk);
            if (together.error.empty()) {
                done(together.records, chunk.size());
            } else {
                // One of them is to blame: which?
                for (std::size_t k = 0; k < chunk.size(); ++k) {
                    const Attempt alone = solve(chunk.subspan(k, 1));
                    if (alone.error.empty())
                        done(alone.records, 1);
                    else
                        fail(chunk[k], alone.error);
                }
            }
            chunk_.learn(progress_.seconds() - start_s);
            first += chunk.size();
        }
    }

    void compute_with_pictures(std::span<const std::size_t> pending) {
        for (const std::size_t job : pending) {
            // Jobs change their numbers when a study gets more of them.
            const std::filesystem::path folder = options_.out / "images" / short_key(jobs_.jobs[job].key);
            make_writable_folder(folder);
            const std::string group_key = study_.keep.sensors ? jobs_.group_keys[jobs_.jobs[job].group] : std::string();
            const Attempt one = attempt([&] { return records_with_pictures(pending_job(job), folder, group_key, options_.cache, progress_); });
            if (one.error.empty())
                done(one.records, 1);
            else
                fail(job, one.error);
        }
    }

    const BatchOptions& options_;
    const Study& study_;
    RunOptionSets& sets_;
    const StudyJobs& jobs_;
    RecordFile& records_;
    JobProgress& progress_;
    std::vector<std::size_t> jobs_of_set_;
    ChunkSize chunk_;
};

/// Forecasts of all groups; what cannot be forecast, because a job of it will fail, costs nothing.
std::vector<GroupForecast> forecast_groups(const Study& study, RunOptionSets& sets, const StudyJobs& jobs, const Progress& progress) {
    std::vector<GroupForecast> groups(jobs.group_keys.size());
    std::vector<std::set<std::size_t>> sets_of(groups.size());
    std::vector<std::size_t> jobs_of(groups.size(), 0);
    for (const StudyJob& job : jobs.jobs) {
        if (!job.invalid.empty()) continue;
        sets_of[job.group].insert(job.set);
        ++jobs_of[job.group];
    }
    std::vector<bool> seen(groups.size(), false);
    for (const StudyJob& job : jobs.jobs) {
        if (!job.invalid.empty() || seen[job.group]) continue;
        seen[job.group] = true;
        try {
            groups[job.group] = forecast_group(input_of(study, job, sets), jobs_of[job.group], sets_of[job.group].size(), study.keep.images, progress);
        } catch (const InputError&) {
            // So will the job. Every machine finds that; what is a fault of one machine must not let it cut the row elsewhere.
        }
    }
    return groups;
}

std::vector<GroupCost> costs_of(const std::vector<GroupForecast>& forecasts) {
    std::vector<GroupCost> costs;
    for (const GroupForecast& forecast : forecasts) costs.push_back({forecast.first_seconds, forecast.set_seconds, forecast.job_seconds});
    return costs;
}

/// Time of some jobs, and the largest memory of their groups.
ScriptNeeds needs_of(const StudyJobs& jobs, const std::vector<GroupForecast>& forecasts, std::span<const std::size_t> some) {
    ScriptNeeds needs;
    std::vector<bool> group_seen(forecasts.size(), false), set_seen(jobs.sets, false);
    for (const std::size_t number : some) {
        const StudyJob& job = jobs.jobs[number];
        if (!job.invalid.empty()) continue;
        const GroupForecast& group = forecasts[job.group];
        if (!group_seen[job.group]) needs.seconds += group.first_seconds;
        if (!set_seen[job.set]) needs.seconds += group.set_seconds;
        group_seen[job.group] = true, set_seen[job.set] = true;
        needs.seconds += group.job_seconds;
        needs.bytes = std::max(needs.bytes, group.bytes);
    }
    return needs;
}

/// "date 2026-01-21, time 08:00"
std::string parameter_words(const nlohmann::ordered_json& parameters) {
    std::string text;
    for (const auto& [name, value] : parameters.items())
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, value.is_string() ? value.get<std::string>() : value.dump());
    return text;
}

std::string dry_run_account(const Study& study, const StudyJobs& jobs, const std::vector<GroupForecast>& forecasts,
                            std::span<const std::size_t> mine, const Shard& shard) {
    std::string text = fmt::format("study \"{}\": {} jobs in {} groups; nothing computed\n", study.name, jobs.jobs.size(), jobs.group_keys.size());
    if (jobs.left_out > 0) text += fmt::format("  {} more are left out: the sun is too low\n", jobs.left_out);
    if (shard.count > 1) text += fmt::format("  {} of them belong to shard {} of {}\n", mine.size(), shard.number, shard.count);
    text += study.keep.images ? "Pictures are kept: every job is a run of its own.\n"
                              : "Jobs of a group share assembly, grid and form factors:\n";
    std::vector<std::size_t> sizes(forecasts.size(), 0);
    std::vector<std::set<std::size_t>> sets(forecasts.size());
    for (const std::size_t job : mine) {
        if (!jobs.jobs[job].invalid.empty()) continue;
        ++sizes[jobs.jobs[job].group];
        sets[jobs.jobs[job].group].insert(jobs.jobs[job].set);
    }
    if (!study.keep.images)
        for (std::size_t g = 0; g < forecasts.size(); ++g)
            if (sizes[g] > 0)
                text += fmt::format("  group {}: {} jobs; {} patches, {} sensors; memory at most about {}; {} first, {:.2g} s for each of {} sets of "
                                    "reflectances and glazings, then {:.3g} ms a job\n",
                                    g + 1, sizes[g], forecasts[g].patches, forecasts[g].sensors, in_bytes(forecasts[g].bytes),
                                    in_time(forecasts[g].first_seconds), forecasts[g].set_seconds, sets[g].size(),
                                    1e3 * forecasts[g].job_seconds);
    const ScriptNeeds needs = needs_of(jobs, forecasts, mine);
    text += fmt::format("Together about {} of one core, and at most about {} of memory.\n", in_time(needs.seconds), in_bytes(needs.bytes));
    for (const std::size_t job : mine)
        text += fmt::format("job {} (group {}): {}{}\n", job + 1, jobs.jobs[job].group + 1,
                            parameter_words(parameters_of(study, jobs.jobs[job].combination)),
                            jobs.jobs[job].invalid.empty() ? "" : "; INVALID: " + jobs.jobs[job].invalid);
    return text;
}

/// Where results are complete, they are written; the last shard to end does it. mine: the jobs of this shard, whose failures make
/// the exit code.
ExitCode conclude(const BatchOptions& options, const StudyJobs& jobs, std::span<const std::size_t> mine, const Shard& shard, const std::string& work) {
    const FolderLock lock(options.out);
    const JobList list = read_job_list(options.out);  // to which another process may have added jobs
    const FinishedJobs finished(options.out);
    JobCounts counts = count_jobs(list, finished);
    std::string text = fmt::format("study \"{}\": {} jobs done, {} failed, {} missing; {}\n", list.study, counts.done, counts.failed, counts.missing, work);
    if (counts.missing == 0) {
        counts = write_results(options.out, list, finished);
        text += fmt::format("  written to {}\n", (options.out / "results.csv").string());
    } else if (shard.count > 1) {
        text += fmt::format("  shard {} of {} has ended; results are written by the last one, or by `naturel merge`\n", shard.number, shard.count);
    }
    if (counts.not_converged > 0) text += fmt::format("  {} jobs did NOT converge\n", counts.not_converged);
    print_at_once(stdout, text);
    if (std::ranges::any_of(mine, [&](std::size_t job) { return finished.state(jobs.jobs[job].key) == JobState::failed; }))
        return ExitCode::some_failed;
    return counts.not_converged > 0 ? ExitCode::not_converged : ExitCode::done;
}

}  // namespace

ExitCode batch(const BatchOptions& options, Progress& told, bool drawn) {
    const Study study = read_study(options.study);
    RunOptionSets sets;
    const StudyJobs jobs = find_jobs(study, sets, told);
    const Shard shard = options.shard ? *options.shard : shard_of_slurm().value_or(Shard{});

    std::vector<GroupForecast> forecasts(jobs.group_keys.size());
    if (options.print || options.dry_run || shard.count > 1) forecasts = forecast_groups(study, sets, jobs, told);
    if (options.print) {
        const std::size_t shards = std::min(options.shards, jobs.jobs.size());
        ScriptNeeds most;
        for (std::size_t number = 1; number <= shards; ++number) {
            const ScriptNeeds needs = needs_of(jobs, forecasts, jobs_of_shard(jobs, costs_of(forecasts), {number, shards}));
            most = {study.name, shards, std::max(most.bytes, needs.bytes), std::max(most.seconds, needs.seconds)};
        }
        print_at_once(stdout, job_script(options, most));
        return ExitCode::done;
    }
    std::vector<std::size_t> mine = jobs_of_shard(jobs, costs_of(forecasts), shard);
    if (options.dry_run) {
        print_at_once(stdout, dry_run_account(study, jobs, forecasts, mine, shard));
        return ExitCode::done;
    }

    make_writable_folder(options.out);
    make_writable_folder(records_folder(options.out));
    const JobList list = list_jobs(study, jobs);
    RecordFile records(records_folder(options.out) / (shard.name() + ".records"));
    {
        const FolderLock lock(options.out);
        if (const auto warning = keep_job_list(options.out, list)) print_at_once(stderr, "warning: " + *warning + "\n");
    }
    const FinishedJobs known(options.out);
    for (const std::string& damage : known.damages()) print_at_once(stderr, "warning: " + damage + "\n");
    const std::vector<std::size_t> all_mine = mine;
    const std::size_t all = all_mine.size();
    std::erase_if(mine, [&](std::size_t job) {
        const JobState state = known.state(jobs.jobs[job].key);
        return state == JobState::done || (state == JobState::failed && !options.retry_failed);
    });
    if (tells_in_words(options) && mine.size() < all) print_at_once(stderr, fmt::format("{} of {} jobs are finished already\n", all - mine.size(), all));

    if (study.keep.images && !mine.empty()) require_image_writer();  // or every job would fail on this machine
    JobProgress progress(told, options.quiet ? ProgressForm::none : options.progress, drawn, mine.size());
    BatchRun run(options, study, sets, jobs, records, progress);
    try {
        run.compute(mine, known);
    } catch (const TooManyFailures&) {
        print_at_once(stderr, fmt::format("naturel: stopped after {} failures (--max-failures)\n", progress.failed()));
        return ExitCode::some_failed;
    } catch (const Interrupted&) {
        print_at_once(stderr, fmt::format("naturel: {} of {} jobs are finished; the same command goes on from there\n",
                                  all - mine.size() + progress.done() + progress.failed(), all));
        throw;
    }
    progress.finish();
    const double seconds = progress.seconds();
    return conclude(options, jobs, all_mine, shard,
                    fmt::format("{} now in {:.2f} s, {:.3g} a second", mine.size(), seconds, static_cast<double>(mine.size()) / std::max(seconds, 1e-3)));
}

}  // namespace naturel
