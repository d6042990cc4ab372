#pragma once
#include <functional>

#include "cli/exit_codes.h"

namespace naturel {

/// The exit code of an action; what it throws becomes one and a message on stderr.
ExitCode guarded(const std::function<ExitCode()>& action);

}  // namespace naturel
