#pragma once
#include "cli/options.h"
#include "core/progress.h"

namespace naturel {

/// Runs the jobs of a study that are not finished yet. Throws InputError and Interrupted; finished jobs are kept.
/// drawn: progress shows on a terminal.
ExitCode batch(const BatchOptions& options, Progress& progress, bool drawn);

}  // namespace naturel
