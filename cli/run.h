#pragma once
#include "cli/options.h"

namespace naturel {

/// Computes the daylight of a scene with every backend asked for and writes the results; a short account goes
/// to stdout. Returns done or not_converged.
ExitCode run(const RunOptions& options, Progress& progress);

}  // namespace naturel
