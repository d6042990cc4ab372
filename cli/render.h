#pragma once
#include "cli/options.h"
#include "core/progress.h"

namespace naturel {

/// `naturel render`: draws views of a finished run, from what the run stored and without computing it again.
void render(const RenderOptions& options, Progress& progress);

}  // namespace naturel
