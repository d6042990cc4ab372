#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <optional>

#include "cli/batch.h"
#include "cli/check.h"
#include "cli/compare.h"
#include "cli/formfactors.h"
#include "cli/guarded.h"
#include "cli/merge.h"
#include "cli/options.h"
#include "cli/render.h"
#include "cli/run.h"
#include "cli/sky.h"
#include "cli/terminal_progress.h"
#include "cli/timing.h"
#include "cli/zones.h"
#include "core/parallel.h"

namespace naturel {
namespace {

std::atomic<bool> stop_requested = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only write lock-free atomics");

/// The first signal asks the calculation to stop between two steps; a second one ends the process at once.
void stop_on_signals() {
    struct sigaction action {};
    action.sa_handler = [](int) { stop_requested = true; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    signal(SIGXFSZ, SIG_IGN);  // a file that grows too long is an error of writing like a full disk
}

ExitCode execute(const RunOptions& options) {
    const ThreadLimit limit(options.threads);
    TerminalProgress progress(!options.quiet && isatty(STDERR_FILENO) != 0, stop_requested);
    return run(options, progress);
}

ExitCode execute(const TimingOptions& options) {
    // Without a limit on threads: every run has its own, in its own process.
    TerminalProgress progress(!options.run.quiet && isatty(STDERR_FILENO) != 0, stop_requested);
    return time_runs(options, progress);
}

ExitCode execute(const RenderOptions& options) {
    const ThreadLimit limit(options.threads);
    TerminalProgress progress(!options.quiet && isatty(STDERR_FILENO) != 0, stop_requested);
    render(options, progress);
    return ExitCode::done;
}

ExitCode execute(const CheckOptions& options) {
    TerminalProgress progress(isatty(STDERR_FILENO) != 0, stop_requested);
    check(options, progress);
    return ExitCode::done;
}

ExitCode execute(const FormFactorsOptions& options) {
    const ThreadLimit limit(options.threads);
    TerminalProgress progress(!options.quiet && isatty(STDERR_FILENO) != 0, stop_requested);
    write_form_factors(options, progress);
    return ExitCode::done;
}

ExitCode execute(const CompareOptions& options) {
    const ThreadLimit limit(options.threads);
    TerminalProgress progress(!options.quiet && isatty(STDERR_FILENO) != 0, stop_requested);
    return compare(options, progress);
}

ExitCode execute(const ZonesOptions& options) {
    const ThreadLimit limit(options.threads);
    TerminalProgress progress(!options.quiet && isatty(STDERR_FILENO) != 0, stop_requested);
    find_zones(options, progress);
    return ExitCode::done;
}

ExitCode execute(const SkyOptions& options) {
    show_sky(options);
    return ExitCode::done;
}

ExitCode execute(const BatchOptions& options) {
    const ThreadLimit limit(options.threads);
    const bool drawn = !options.quiet && options.progress == ProgressForm::text && isatty(STDERR_FILENO) != 0;
    TerminalProgress progress(drawn, stop_requested);
    return batch(options, progress, drawn);
}

ExitCode execute(const MergeOptions& options) {
    return merge(options, TerminalProgress(false, stop_requested));
}

ExitCode execute(ExitCode nothing_left_to_do) {
    return nothing_left_to_do;
}

ExitCode guarded_main(int argc, char** argv) {
    return guarded([&] {
        return std::visit([](const auto& command) { return execute(command); }, parse_command_line(argc, argv));
    });
}

}  // namespace
}  // namespace naturel

int main(int argc, char** argv) {
    naturel::stop_on_signals();
    return static_cast<int>(naturel::guarded_main(argc, argv));
}
