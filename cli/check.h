#pragma once
#include "cli/options.h"

namespace naturel {

/// Prints on stdout what a scene contains, and warnings for what is probably not meant.
void check(const CheckOptions& options, Progress& progress);

}  // namespace naturel
