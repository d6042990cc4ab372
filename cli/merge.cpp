#include "cli/merge.h"

#include <fmt/format.h>

#include <cstdio>
#include <set>

#include "cli/file_reader.h"
#include "cli/file_writer.h"
#include "cli/job_progress.h"
#include "cli/job_results.h"
#include "core/errors.h"

namespace naturel {
namespace {

/// One record of everything that the list speaks of, in its order.
std::string all_records(const JobList& list, const FinishedJobs& finished) {
    std::string bytes;
    std::set<std::string> taken;
    const auto take = [&](const std::string& key) {
        const RecordPlace* place = finished.find(key);
        if (place == nullptr || !taken.insert(key).second) return;
        const JobRecord record = read_record(*place);
        bytes += record_bytes(record.json, record.numbers);
    };
    for (const ListedJob& job : list.jobs) {
        take(job.group_key);
        take(job.key);
    }
    return bytes;
}

/// Files that are still being written are left out.
void copy_folder(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::error_code error;
    std::filesystem::create_directories(to, error);
    for (const auto& entry : entries_of(from, error)) {
        if (entry.is_directory(error))
            copy_folder(entry.path(), to / entry.path().filename());
        else if (entry.path().extension() != part_ending)
            write_file(to / entry.path().filename(), file_content(entry.path()));
    }
    if (error) throw InputError(to.string(), fmt::format("cannot be written: {}", error.message()));
}

void copy_images(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::error_code error;
    if (!std::filesystem::exists(from / "images", error) || std::filesystem::equivalent(from, to, error)) return;
    copy_folder(from / "images", to / "images");
    keep_for_good(to / "images");
}

}  // namespace

ExitCode merge(const MergeOptions& options, const Progress& progress) {
    const JobList list = read_job_list(options.folders.front());
    const std::string text = job_list_text(list);
    for (const std::filesystem::path& folder : options.folders)
        if (job_list_text(read_job_list(folder)) != text)
            throw InputError((folder / "jobs.jsonl").string(),
                             fmt::format("belongs to another study than {} (folders of one study can be merged)", options.folders.front().string()));
    const std::filesystem::path out = options.out.empty() ? options.folders.front() : options.out;
    if (!options.out.empty()) {
        make_writable_folder(out);
        make_writable_folder(records_folder(out));
    }
    const auto warn = [](const std::string& words) { tell(ProgressForm::text, Remark::warning, words); };
    const FolderLock lock(out, progress, [](const std::string& words) { tell(ProgressForm::text, Remark::note, words); });
    if (!options.out.empty()) {
        if (const auto warning = keep_job_list(out, list)) warn(*warning);
        FinishedJobs parts(out);  // of an earlier merge
        for (const std::filesystem::path& folder : options.folders) parts.add(folder);
        if (count_jobs(list, parts).missing > 0)
            for (const std::string& damage : parts.damages()) warn(damage);
        // Records say that pictures are there: they come last.
        for (const std::filesystem::path& folder : options.folders) copy_images(folder, out);
        write_file_for_good(records_folder(out) / "merged.records", all_records(list, parts));
    }
    const FinishedJobs finished(out);
    const JobCounts counts = write_results(out, list, finished);
    if (options.out.empty() && counts.missing > 0)
        for (const std::string& damage : finished.damages()) warn(damage);
    print_at_once(stdout, fmt::format("{}; written to {}\n", account_of(list, counts), (out / "results.csv").string()) + account_of_convergence(counts));
    if (counts.failed + counts.missing > 0) return ExitCode::some_failed;
    return counts.not_converged > 0 ? ExitCode::not_converged : ExitCode::done;
}

}  // namespace naturel
