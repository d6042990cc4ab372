#include "cli/timing.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "cli/build_description.h"
#include "cli/file_reader.h"
#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/json_text.h"
#include "cli/timed_run.h"
#include "cli/timing_report.h"
#include "cli/timing_study.h"
#include "cli/timing_writer.h"
#include "core/errors.h"
#include "core/sha256.h"

namespace naturel {
namespace {

/// The runs of one repeat, in the order in which they follow each other.
std::vector<RunOptions> runs_of_repeat(const TimingOptions& options, const std::map<std::string, double>& spacing_m, Scaling scaling) {
    std::vector<RunOptions> runs;
    for (const Backend& backend : backends_named(options.run.backend)) {
        for (const int threads : options.threads) {
            RunOptions run = options.run;
            run.backend = backend.name;
            run.threads = threads;
            // Cells shrink on both sides.
            if (scaling == Scaling::weak)
                run.grid_spacing_m = spacing_m.at(run.backend) / std::sqrt(static_cast<double>(threads) / options.threads.front());
            runs.push_back(std::move(run));
        }
    }
    return runs;
}

std::string estimate_text(const Estimate& estimate, int digits) {
    return estimate.interval ? fmt::format("{:.{}f} [{:.{}f}, {:.{}f}]", estimate.value, digits, estimate.interval->low, digits,
                                           estimate.interval->high, digits)
                             : fmt::format("{:.{}f}", estimate.value, digits);
}

std::string account(const TimingFigures& figures) {
    std::string text;
    const auto same_block = [](const StageFigures& a, const StageFigures& b) { return a.backend == b.backend && a.scaling == b.scaling; };
    for (std::size_t k = 0; k < figures.stages.size(); ++k) {
        const StageFigures& row = figures.stages[k];
        if (k == 0 || !same_block(row, figures.stages[k - 1]))
            text += fmt::format("{}{}\n  {:<16}{:>8}{:>8}  {:<26}{:<20}{:<26}{:<20}{}\n", row.backend,
                                row.scaling == Scaling::weak ? ", patches in proportion to threads" : "", "stage", "threads", "share", "wall s",
                                "speed-up", "CPU s", "CPU beside fewest", "worked");
        text += fmt::format("  {:<16}{:>8}{:>6.1f} %  {:<26}{:<20}{:<26}{:<20}{}\n", row.stage, row.threads, 100.0 * row.share,
                            estimate_text(row.wall_s, 4), row.speed_up ? estimate_text(*row.speed_up, 2) : "", estimate_text(row.cpu_s, 4),
                            row.cpu_ratio ? estimate_text(*row.cpu_ratio, 2) : "", row.fewest_threads_that_worked);
    }
    for (const SerialFraction& serial : figures.serial)
        if (serial.stage == whole_run) text += fmt::format("{}: serial fraction {}\n", serial.backend, estimate_text(serial.fraction, 3));
    return text;
}

}  // namespace

ExitCode time_runs(const TimingOptions& options, Progress& progress) try {
    TimingStudy study{.scene = options.run.scene.filename().string(), .scene_sha256 = sha256_hex(file_content(options.run.scene)), .command = options.command,
                      .machine = describe_machine(), .threads = options.threads, .repeats = static_cast<std::size_t>(options.repeats)};
    study.machine.software = build_description();
    for (const char* name : {"timing.json", "timing.csv", "timing_runs.csv", "report.html"})
        refuse_to_replace(std::vector{options.run.scene}, std::vector{options.run.out / name});
    make_writable_folder(options.run.out);
    const std::filesystem::path folder = options.run.out / "run_being_timed";

    // One run of each backend warms up: it brings scene and program into the file cache and the clock to its frequency.
    std::map<std::string, double> spacing_m;
    std::map<std::string, MeasuredRun> reference;
    const auto note = [&](const MeasuredRun& run) {
        const auto [first, is_first] = reference.emplace(run.backend, run);
        if (is_first) return;
        if (const std::string difference = first_difference(first->second, run); !difference.empty())
            throw std::runtime_error("results are not the same for every number of threads: " + difference);
    };
    std::vector<Scaling> scalings{Scaling::strong};
    if (options.weak) scalings.push_back(Scaling::weak);
    const std::size_t backends = backends_named(options.run.backend).size();
    progress.begin("timed runs", backends * (1 + options.threads.size() * study.repeats * scalings.size()));
    for (RunOptions& run : runs_of_repeat(options, {}, Scaling::strong)) {
        if (run.threads != options.threads.back()) continue;
        const MeasuredRun warm = timed_run(run, folder, progress);
        spacing_m[warm.backend] = warm.grid_spacing_m;
        note(warm);
        progress.advance();
    }
    for (const Scaling scaling : scalings) {
        for (std::size_t repeat = 0; repeat < study.repeats; ++repeat) {
            for (const RunOptions& run : runs_of_repeat(options, spacing_m, scaling)) {
                MeasuredRun measured = timed_run(run, folder, progress);
                measured.scaling = scaling;
                measured.repeat = repeat;
                if (scaling == Scaling::strong) note(measured);
                study.runs.push_back(std::move(measured));
                progress.advance();
            }
        }
    }
    progress.end();

    const TimingFigures figures = timing_figures(study);
    const nlohmann::ordered_json json = timing_json(study, figures);
    std::error_code absent;
    std::filesystem::remove(options.run.out / "timing.json", absent);
    write_file(options.run.out / "timing_runs.csv", timing_runs_csv(study));
    write_file(options.run.out / "timing.csv", timing_csv(figures));
    write_file(options.run.out / "report.html", timing_report(json));
    write_file(options.run.out / "timing.json", json_text(json));
    const std::string text = account(figures) +
                             fmt::format("  results are the same to the last bit in all {} runs with {} threads\n  written to {}\n",
                                         study.repeats * backends * options.threads.size(), fmt::join(options.threads, ", "),
                                         options.run.out.string());
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
    for (const std::string& warning : figures.warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
    const bool converged = std::ranges::all_of(study.runs, &MeasuredRun::converged);
    return converged ? ExitCode::done : ExitCode::not_converged;
} catch (const FailedRun& failed) {
    return failed.code;
}

}  // namespace naturel
