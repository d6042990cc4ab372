#pragma once
#include <filesystem>

#include "cli/options.h"
#include "cli/timing_study.h"

namespace naturel {

/// `naturel run` in a process of its own that is born for it, so that no run finds threads, memory or tables of another. Its
/// words are swallowed unless it fails: then they are printed and its exit code is thrown as FailedRun.
/// The calling process must not have started threads. options: with one backend.
/// folder: for the results; made, and removed again.
MeasuredRun timed_run(const RunOptions& options, const std::filesystem::path& folder, const Progress& progress);

struct FailedRun {
    ExitCode code;
};

}  // namespace naturel
