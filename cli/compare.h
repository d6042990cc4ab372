#pragma once
#include "cli/exit_codes.h"
#include "cli/options.h"
#include "core/progress.h"

namespace naturel {

/// Finds what the projection costs in a scene, ingredient by ingredient, and writes comparison.json and its tables.
/// Throws InputError and Interrupted.
ExitCode compare(const CompareOptions& options, Progress& progress);

}  // namespace naturel
