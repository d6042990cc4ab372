#pragma once
#include <functional>
#include <string>

#include "cli/exit_codes.h"

namespace naturel {

/// The exit code of an action; what it throws becomes one and a message.
/// tell: takes the message; default: a line on stderr.
ExitCode guarded(const std::function<ExitCode()>& action, const std::function<void(const std::string&)>& tell = {});

}  // namespace naturel
