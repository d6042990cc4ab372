#pragma once
#include "cli/options.h"

namespace naturel {

/// Writes the results of a study whose jobs lie in one or several folders. Throws InputError.
ExitCode merge(const MergeOptions& options);

}  // namespace naturel
