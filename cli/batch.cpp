#include "cli/batch.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <span>

#include "cli/file_writer.h"
#include "cli/forecast.h"
#include "cli/guarded.h"
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

void note(const BatchOptions& options, const std::string& text) {
    if (!options.quiet) tell(options.progress, Remark::note, text);
}

void warn(const BatchOptions& options, const std::string& text) {
    tell(options.progress, Remark::warning, text);
}

/// "3 of 4 jobs are finished"
std::string account_of_finished(std::size_t finished, std::size_t all) {
    return fmt::format("{} of {} {} finished", finished, counted(all, "job"), finished == 1 ? "is" : "are");
}

/// Where form factors that took long are kept until the study is complete.
std::filesystem::path own_cache(const BatchOptions& options) {
    return options.out / "form_factors";
}

FormFactorCache cache_of(const BatchOptions& options) {
    FormFactorCache cache = options.cache;
    cache.tell = [&options](const std::string& text) { warn(options, text); };
    if (!cache.folder.empty()) return cache;
    // As much as a kill may cost; shorter ones are not worth the disk.
    cache.least_seconds = 2.0;
    cache.folder = own_cache(options);
    return cache;
}

/// An error without what depends on the folder in which the study was started: records of equal jobs are equal.
std::string without_place(const Study& study, std::string error) {
    std::vector<std::string> files{study.file.string()};
    for (const StudyScene& scene : study.scenes) files.push_back(scene.file.string());
    for (const std::string& file : files) {
        // "study.json:12:7: /vary/0"
        if (!error.starts_with(file + ':')) continue;
        const std::size_t end = error.find_first_not_of("0123456789:", file.size());
        if (end != std::string::npos && end >= file.size() + 2 && error[end] == ' ') error.erase(0, end + 1);
        break;
    }
    const std::string folder = study.file.parent_path().string() + '/';
    if (folder == "/") return error;
    for (std::size_t at = error.find(folder); at != std::string::npos; at = error.find(folder, at))
        if (at == 0 || std::string_view(" \"'(=").find(error[at - 1]) != std::string_view::npos)
            error.erase(at, folder.size());
        else
            ++at;
    return error;
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
        : options_(options), study_(study), sets_(sets), jobs_(jobs), records_(records), progress_(progress), jobs_of_set_(jobs.sets, 0),
          cache_(cache_of(options)) {
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
            const auto row_set = [&](std::size_t k) { return jobs_.jobs[pending[k]].row_set; };
            const std::span<const std::size_t> group = pending.subspan(first, last - first);
            if (!kind(first).second)
                for (const std::size_t job : group) fail(job, jobs_.jobs[job].invalid);
            else {
                form_factors_.expect_more(last < pending.size() && kind(last).second && row_set(last) == row_set(first));
                if (study_.keep.images)
                    compute_with_pictures(group);
                else
                    compute_group(group, known);
            }
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
        records_.append(failed_record(jobs_.jobs[job].key, without_place(study_, error)));
        progress_.add(0, 1);
        note(options_, fmt::format("job {} failed: {}", job + 1, error));
        if (options_.max_failures && progress_.failed() > *options_.max_failures) throw TooManyFailures{};
    }

    void compute_group(std::span<const std::size_t> pending, const FinishedJobs& known) {
        std::unique_ptr<JobGroup> group;
        const Attempt start = attempt([&] {
            group = std::make_unique<JobGroup>(pending_job(pending.front()).input, cache_, form_factors_, progress_);
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
            const Attempt one = attempt([&] { return records_with_pictures(pending_job(job), folder, group_key, cache_, form_factors_, progress_); });
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
    FormFactorCache cache_;
    FormFactorMemory form_factors_;
};

/// Forecasts of all groups; what cannot be forecast, because a job of it will fail, costs nothing.
std::vector<GroupForecast> forecast_groups(const Study& study, RunOptionSets& sets, const StudyJobs& jobs, const Progress& progress) {
    std::vector<GroupForecast> groups(jobs.group_keys.size());
    std::vector<std::set<std::size_t>> sets_of(groups.size()), groups_of(jobs.row_sets);
    std::vector<std::size_t> jobs_of(groups.size(), 0);
    for (const StudyJob& job : jobs.jobs) {
        if (!job.invalid.empty()) continue;
        groups_of[job.row_set].insert(job.group);
        sets_of[job.group].insert(job.set);
        ++jobs_of[job.group];
    }
    std::vector<bool> seen(groups.size(), false);
    for (const StudyJob& job : jobs.jobs) {
        if (!job.invalid.empty() || seen[job.group]) continue;
        seen[job.group] = true;
        try {
            groups[job.group] = forecast_group(input_of(study, job, sets), jobs_of[job.group], sets_of[job.group].size(), study.keep.images, progress);
            if (groups_of[job.row_set].size() > 1) groups[job.group].bytes += groups[job.group].kept_bytes;
        } catch (const InputError&) {
            // So will the job. Every machine finds that; what is a fault of one machine must not let it cut the row elsewhere.
        }
    }
    return groups;
}

std::vector<GroupCost> costs_of(const std::vector<GroupForecast>& forecasts) {
    std::vector<GroupCost> costs;
    for (const GroupForecast& forecast : forecasts) costs.push_back({forecast.form_factor_seconds, forecast.first_seconds, forecast.set_seconds, forecast.job_seconds});
    return costs;
}

/// Time of some jobs, and the largest memory of their groups.
ScriptNeeds needs_of(const StudyJobs& jobs, const std::vector<GroupForecast>& forecasts, std::span<const std::size_t> some) {
    ScriptNeeds needs;
    double process_seconds = 0.0;
    std::vector<bool> rows_seen(jobs.row_sets, false), group_seen(forecasts.size(), false), set_seen(jobs.sets, false);
    for (const std::size_t number : some) {
        const StudyJob& job = jobs.jobs[number];
        if (!job.invalid.empty()) continue;
        const GroupForecast& group = forecasts[job.group];
        if (!rows_seen[job.row_set]) needs.seconds += group.form_factor_seconds;
        if (!group_seen[job.group]) needs.seconds += group.first_seconds;
        if (!set_seen[job.set]) needs.seconds += group.set_seconds;
        rows_seen[job.row_set] = true, group_seen[job.group] = true, set_seen[job.set] = true;
        needs.seconds += group.job_seconds;
        process_seconds = std::max(process_seconds, group.process_seconds);
        needs.bytes = std::max(needs.bytes, group.bytes);
    }
    needs.seconds += process_seconds;
    return needs;
}

/// "date 2026-01-21, time 08:00"
std::string parameter_words(const nlohmann::ordered_json& parameters) {
    std::string text;
    for (const auto& [name, value] : parameters.items())
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, value.is_string() ? value.get<std::string>() : value.dump());
    return text;
}

/// mine: jobs of the shard that are not finished. finished: those that are.
std::string dry_run_account(const Study& study, const StudyJobs& jobs, const std::vector<GroupForecast>& forecasts,
                            std::span<const std::size_t> mine, std::size_t finished, const Shard& shard) {
    std::string text = fmt::format("study \"{}\": {} in {}; nothing computed\n", study.name, counted(jobs.jobs.size(), "job"),
                                   counted(jobs.group_keys.size(), "group"));
    if (jobs.left_out > 0) text += fmt::format("  {} more are left out: the sun is too low\n", jobs.left_out);
    if (shard.count > 1) text += fmt::format("  {} of them belong to shard {} of {}\n", mine.size() + finished, shard.number, shard.count);
    if (finished > 0) text += fmt::format("  {} already; what follows is of the others\n", account_of_finished(finished, mine.size() + finished));
    text += study.keep.images ? "Pictures are kept: every job is a run of its own, but for form factors of an equal grid.\n"
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
                text += fmt::format("  group {}: {}; {} patches, {}; memory at most about {}; {} first, {:.2g} s for {}{} of "
                                    "reflectances and glazings, then {:.3g} ms a job\n",
                                    g + 1, counted(sizes[g], "job"), forecasts[g].patches, counted(forecasts[g].sensors, "sensor"),
                                    in_bytes(forecasts[g].bytes), in_time(forecasts[g].form_factor_seconds + forecasts[g].first_seconds),
                                    forecasts[g].set_seconds, sets[g].size() == 1 ? "" : "each of ", counted(sets[g].size(), "set"),
                                    1e3 * forecasts[g].job_seconds);
    const ScriptNeeds needs = needs_of(jobs, forecasts, mine);
    text += fmt::format("Together about {} of one core, and at most about {} of memory.\n", in_time(needs.seconds), in_bytes(needs.bytes));
    for (const std::size_t job : mine)
        text += fmt::format("job {} (group {}): {}{}\n", job + 1, jobs.jobs[job].group + 1,
                            parameter_words(parameters_of(study, jobs.jobs[job].combination)),
                            jobs.jobs[job].invalid.empty() ? "" : "; INVALID: " + jobs.jobs[job].invalid);
    return text;
}

/// Names what varies and has no effect: jobs that are equal though their parameters differ.
std::optional<std::string> warning_of_equal_jobs(const Study& study, const StudyJobs& jobs) {
    std::map<std::string_view, std::size_t> first;
    std::set<std::string> without_effect;
    std::string example;
    for (std::size_t number = 0; number < jobs.jobs.size(); ++number) {
        const auto [place, is_new] = first.emplace(jobs.jobs[number].key, number);
        if (is_new) continue;
        const nlohmann::ordered_json mine = parameters_of(study, jobs.jobs[number].combination),
                                     other = parameters_of(study, jobs.jobs[place->second].combination);
        for (const auto& [name, value] : mine.items())
            if (value != other.at(name)) without_effect.insert(in_quotes(name));
        if (example.empty() && !without_effect.empty()) example = fmt::format("job {} equals job {}", number + 1, place->second + 1);
    }
    if (without_effect.empty()) return {};
    const bool one = without_effect.size() == 1;
    return fmt::format("{} although {} {}: what {} has no effect, or is set again by a parameter that follows", example,
                       fmt::join(without_effect, ", "), one ? "differs" : "differ", one ? "it sets" : "they set");
}

/// Where results are complete, they are written; the last shard to end does it. mine: the jobs of this shard, whose failures make
/// the exit code.
ExitCode conclude(const BatchOptions& options, const StudyJobs& jobs, std::span<const std::size_t> mine, const Shard& shard, const std::string& work,
                  const Progress& progress) {
    const FolderLock lock(options.out, progress, [&](const std::string& text) { note(options, text); });
    const JobList list = read_job_list(options.out);  // to which another process may have added jobs
    const FinishedJobs finished(options.out);
    JobCounts counts = count_jobs(list, finished);
    std::string text = fmt::format("{}; {}\n", account_of(list, counts), work);
    if (counts.missing == 0) {
        counts = write_results(options.out, list, finished);
        text += fmt::format("  written to {}\n", (options.out / "results.csv").string());
        if (options.cache.folder.empty()) remove_kept_rows(own_cache(options));
    } else if (shard.count > 1) {
        text += fmt::format("  shard {} of {} has ended; results are written by the last one, or by `naturel merge`\n", shard.number, shard.count);
    }
    print_at_once(stdout, text + account_of_convergence(counts));
    if (std::ranges::any_of(mine, [&](std::size_t job) { return finished.state(jobs.jobs[job].key) == JobState::failed; }))
        return ExitCode::some_failed;
    return counts.not_converged > 0 ? ExitCode::not_converged : ExitCode::done;
}

ExitCode compute_study(const BatchOptions& options, Progress& told, bool drawn) {
    const Study study = read_study(options.study);
    RunOptionSets sets;
    const StudyJobs jobs = find_jobs(study, sets, told);
    if (const auto warning = warning_of_equal_jobs(study, jobs)) warn(options, *warning);
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
    const std::vector<std::size_t> all_mine = jobs_of_shard(jobs, costs_of(forecasts), shard);
    const std::size_t all = all_mine.size();
    const auto without_finished = [&](const FinishedJobs& known) {
        std::vector<std::size_t> rest = all_mine;
        std::erase_if(rest, [&](std::size_t job) {
            const JobState state = known.state(jobs.jobs[job].key);
            return state == JobState::done || (state == JobState::failed && !options.retry_failed);
        });
        return rest;
    };
    if (options.dry_run) {
        const std::vector<std::size_t> rest = without_finished(FinishedJobs(options.out));
        print_at_once(stdout, dry_run_account(study, jobs, forecasts, rest, all - rest.size(), shard));
        return ExitCode::done;
    }

    make_writable_folder(options.out);
    make_writable_folder(records_folder(options.out));
    const JobList list = list_jobs(study, jobs);
    RecordFile records(records_folder(options.out) / (shard.name() + ".records"));
    {
        const FolderLock lock(options.out, told, [&](const std::string& text) { note(options, text); });
        if (const auto warning = keep_job_list(options.out, list)) warn(options, *warning);
    }
    const FinishedJobs known(options.out);
    const std::vector<std::size_t> mine = without_finished(known);
    if (!mine.empty())
        for (const std::string& damage : known.damages()) warn(options, damage);
    if (mine.size() < all) note(options, account_of_finished(all - mine.size(), all) + " already");

    if (study.keep.images && !mine.empty()) require_image_writer();  // or every job would fail on this machine
    JobProgress progress(told, options.quiet ? ProgressForm::none : options.progress, drawn, mine.size());
    BatchRun run(options, study, sets, jobs, records, progress);
    try {
        run.compute(mine, known);
    } catch (const TooManyFailures&) {
        tell(options.progress, Remark::error,
             fmt::format("stopped after {} (--max-failures); what is finished is kept: the same command goes on from there, "
                         "`naturel merge {}` writes results of what there is",
                         counted(progress.failed(), "failure"), options.out.string()));
        return ExitCode::some_failed;
    } catch (const Interrupted&) {
        tell(options.progress, Remark::error,
             account_of_finished(all - mine.size() + progress.done() + progress.failed(), all) + "; the same command goes on from there");
        throw;
    }
    progress.finish();
    const double seconds = progress.seconds();
    const std::string work = mine.empty() ? "none now"
                                          : fmt::format("{} now in {:.2f} s, {:.3g} a second", mine.size(), seconds,
                                                        static_cast<double>(mine.size()) / std::max(seconds, 1e-3));
    return conclude(options, jobs, all_mine, shard, work, told);
}

}  // namespace

ExitCode batch(const BatchOptions& options, Progress& told, bool drawn) {
    if (options.progress != ProgressForm::json) return compute_study(options, told, drawn);
    // Who reads objects gets the last word as one, too.
    return guarded([&] { return compute_study(options, told, drawn); },
                   [](const std::string& text) { tell(ProgressForm::json, Remark::error, text); });
}

}  // namespace naturel
