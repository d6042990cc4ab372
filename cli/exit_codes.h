#pragma once

namespace naturel {

/// What the program tells its caller. README.md lists the same numbers.
enum class ExitCode {
    done = 0,
    internal_fault = 1,
    wrong_usage = 2,
    bad_input = 3,
    not_converged = 4,
    some_failed = 5,    ///< of the jobs of a study
    interrupted = 130,  ///< 128 + SIGINT, as shells do
};

}  // namespace naturel
