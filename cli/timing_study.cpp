#include "cli/timing_study.h"

#include <fmt/format.h>

#include <algorithm>

namespace naturel {
namespace {

/// From so much on the load of others, or of the host, is told of. A few per cent are what an idle system takes.
constexpr double loaded_share = 0.05, stolen_share = 0.01;
constexpr double loaded_tasks = 0.5;
constexpr std::size_t enough_repeats = 6;  ///< the fewest whose extremes hold the median with 95 %

using Runs = std::vector<const MeasuredRun*>;  // [repeat]

Runs runs_of(const TimingStudy& study, const std::string& backend, Scaling scaling, int threads) {
    Runs found;
    for (const MeasuredRun& run : study.runs)
        if (run.backend == backend && run.scaling == scaling && run.threads == threads) found.push_back(&run);
    return found;
}

/// A time of a stage in every run, [repeat]. Times of zero have no ratio; one tick of a nanosecond clock stands for them.
std::vector<double> times_of(const Runs& runs, const std::string& stage, double MeasuredStage::*time) {
    std::vector<double> times;
    for (const MeasuredRun* run : runs) times.push_back(std::max(1e-9, run->find(stage)->*time));
    return times;
}

double median_of(const std::vector<double>& times, std::span<const std::size_t> repeats) {
    std::vector<double> drawn;
    drawn.reserve(repeats.size());
    for (const std::size_t k : repeats) drawn.push_back(times[k]);
    return median(std::move(drawn));
}

StageFigures figures_of(const Runs& runs, const Runs& base, const std::string& stage) {
    const MeasuredRun& first = *runs.front();
    const std::size_t n = runs.size();
    const std::vector<double> wall_s = times_of(runs, stage, &MeasuredStage::wall_s), cpu_s = times_of(runs, stage, &MeasuredStage::cpu_s);
    StageFigures figures{.backend = first.backend, .scaling = first.scaling, .stage = stage, .threads = first.threads,
                         .patches = first.patches,
                         .wall_s = bootstrap(n, [&](auto k) { return median_of(wall_s, k); }),
                         .cpu_s = bootstrap(n, [&](auto k) { return median_of(cpu_s, k); }),
                         .work_unit = first.find(stage)->work_unit, .speed_up = {}, .efficiency = {}, .cpu_ratio = {}, .karp_flatt = {}};
    figures.share = figures.wall_s.value / median(times_of(runs, whole_run, &MeasuredStage::wall_s));
    figures.fewest_threads_that_worked = first.find(stage)->threads_that_worked;
    std::vector<double> peaks;
    for (const MeasuredRun* run : runs) {
        peaks.push_back(run->peak_memory_bytes);
        figures.fewest_threads_that_worked = std::min(figures.fewest_threads_that_worked, run->find(stage)->threads_that_worked);
    }
    figures.peak_memory_bytes = median(std::move(peaks));
    if (const double work = first.find(stage)->work; !figures.work_unit.empty())
        figures.work_per_s = bootstrap(n, [&](auto k) { return work / median_of(wall_s, k); });

    const int base_threads = base.front()->threads;
    if (base_threads == first.threads) return figures;
    // Runs of one repeat stand beside each other in time: they are drawn together, so that what drifts cancels.
    const std::vector<double> base_wall_s = times_of(base, stage, &MeasuredStage::wall_s);
    const std::vector<double> base_cpu_s = times_of(base, stage, &MeasuredStage::cpu_s);
    const auto speed_up = [&](auto k) { return median_of(base_wall_s, k) / median_of(wall_s, k); };
    const bool strong = first.scaling == Scaling::strong;
    const double ideal = strong ? static_cast<double>(first.threads) / base_threads : 1.0;
    figures.speed_up = bootstrap(n, speed_up);
    figures.efficiency = bootstrap(n, [&](auto k) { return speed_up(k) / ideal; });
    figures.cpu_ratio = bootstrap(n, [&](auto k) { return median_of(cpu_s, k) / median_of(base_cpu_s, k); });
    if (strong && base_threads == 1) figures.karp_flatt = bootstrap(n, [&](auto k) { return karp_flatt(first.threads, speed_up(k)); });
    return figures;
}

SerialFraction serial_fraction_of(const std::vector<Runs>& by_threads, const std::string& stage) {
    std::vector<int> threads;
    std::vector<std::vector<double>> wall_s;
    for (const Runs& runs : by_threads) {
        threads.push_back(runs.front()->threads);
        wall_s.push_back(times_of(runs, stage, &MeasuredStage::wall_s));
    }
    const auto fraction = [&](std::span<const std::size_t> repeats) {
        std::vector<double> medians;
        for (const std::vector<double>& times : wall_s) medians.push_back(median_of(times, repeats));
        return serial_fraction(threads, medians);
    };
    return {by_threads.front().front()->backend, stage, bootstrap(by_threads.front().size(), fraction)};
}

std::vector<std::string> warnings_about(const TimingStudy& study) {
    std::vector<std::string> warnings;
    const MachineDescription& machine = study.machine;
    const int most = std::ranges::max(study.threads);
    if (most > machine.most_threads())
        warnings.push_back(fmt::format("{} threads were asked for, and this process may use {:g} processors{}", most, machine.most_threads(),
                                       machine.quota && *machine.quota == machine.most_threads() ? " (quota of the control group)" : ""));
    if (machine.load && *machine.load > loaded_tasks)
        warnings.push_back(fmt::format("the machine was loaded before the first run: {:g} tasks over the last minute", *machine.load));
    std::size_t disturbed = 0, stolen = 0, known = 0;
    double most_others = 0.0, most_stolen = 0.0;
    for (const MeasuredRun& run : study.runs) {
        if (!run.load) continue;
        ++known;
        disturbed += run.load->others > loaded_share;
        stolen += run.load->stolen > stolen_share;
        most_others = std::max(most_others, run.load->others);
        most_stolen = std::max(most_stolen, run.load->stolen);
    }
    if (disturbed > 0)
        warnings.push_back(fmt::format("during {} of {} runs other processes took more than {:.0f} % of all processor time, up to {:.0f} %",
                                       disturbed, study.runs.size(), 100.0 * loaded_share, 100.0 * most_others));
    if (stolen > 0)
        warnings.push_back(fmt::format("during {} of {} runs the host of this virtual machine kept more than {:.0f} % of all processor time "
                                       "to itself, up to {:.0f} %",
                                       stolen, study.runs.size(), 100.0 * stolen_share, 100.0 * most_stolen));
    if (known < study.runs.size())
        warnings.push_back(fmt::format("what other processes took is not known for {} of {} runs (too short, or /proc/stat is empty)",
                                       study.runs.size() - known, study.runs.size()));
    for (const int threads : study.threads) {
        std::size_t short_of = 0;
        int fewest = threads;
        for (const MeasuredRun& run : study.runs) {
            const int worked = run.find(whole_run)->threads_that_worked;
            if (run.threads != threads || worked >= threads) continue;
            ++short_of;
            fewest = std::min(fewest, worked);
        }
        if (short_of > 0)
            warnings.push_back(fmt::format("{} threads were asked for, but in {} runs fewer worked: {}", threads, short_of, fewest));
    }
    if (study.repeats < enough_repeats)
        warnings.push_back(fmt::format("{} repeats are too few for 95 % intervals (--repeat {} or more)", study.repeats, enough_repeats));
    if (std::ranges::any_of(study.runs, [](const MeasuredRun& run) { return !run.converged; }))
        warnings.emplace_back("the radiosity did not converge");
    return warnings;
}

}  // namespace

const MeasuredStage* MeasuredRun::find(const std::string& stage) const {
    const auto found = std::ranges::find(stages, stage, &MeasuredStage::stage);
    return found == stages.end() ? nullptr : &*found;
}

TimingFigures timing_figures(const TimingStudy& study) {
    TimingFigures figures;
    std::vector<std::string> backends;
    for (const MeasuredRun& run : study.runs)
        if (std::ranges::find(backends, run.backend) == backends.end()) backends.push_back(run.backend);
    std::vector<int> threads = study.threads;
    std::ranges::sort(threads);
    for (const std::string& backend : backends) {
        for (const Scaling scaling : {Scaling::strong, Scaling::weak}) {
            std::vector<Runs> by_threads;
            for (const int count : threads)
                if (Runs runs = runs_of(study, backend, scaling, count); !runs.empty()) by_threads.push_back(std::move(runs));
            if (by_threads.empty()) continue;
            for (const MeasuredStage& stage : by_threads.front().front()->stages) {
                // A stage that some run had no occasion for has no times to compare.
                const auto has_it = [&](const MeasuredRun* run) { return run->find(stage.stage) != nullptr; };
                if (!std::ranges::all_of(by_threads, [&](const Runs& runs) { return std::ranges::all_of(runs, has_it); })) continue;
                for (const Runs& runs : by_threads) figures.stages.push_back(figures_of(runs, by_threads.front(), stage.stage));
                if (scaling == Scaling::strong && by_threads.size() > 1)
                    figures.serial.push_back(serial_fraction_of(by_threads, stage.stage));
            }
        }
    }
    figures.warnings = warnings_about(study);
    return figures;
}

std::string first_difference(const MeasuredRun& a, const MeasuredRun& b) {
    const auto words = [&](const std::string& file, const char* how) {
        return fmt::format("{} with {} threads (repeat {}) and with {} threads (repeat {}): {} {}", a.backend, a.threads, a.repeat + 1,
                           b.threads, b.repeat + 1, file, how);
    };
    for (const auto& [file, hash] : a.hashes) {
        const auto other = b.hashes.find(file);
        if (other == b.hashes.end()) return words(file, "was written by the first only");
        if (other->second != hash) return words(file, "differs");
    }
    for (const auto& [file, hash] : b.hashes)
        if (!a.hashes.contains(file)) return words(file, "was written by the second only");
    return {};
}

}  // namespace naturel
