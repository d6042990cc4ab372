#pragma once
#include "cli/options.h"
#include "core/progress.h"

namespace naturel {

/// Writes the results of a study whose jobs lie in one or several folders. Throws InputError, and
/// Interrupted while it waits for another process to be done with the folder.
ExitCode merge(const MergeOptions& options, const Progress& progress);

}  // namespace naturel
