#pragma once
#include "cli/options.h"

namespace naturel {

/// Runs a scene again and again with several numbers of threads and writes what that took; figures go to stdout. The process must not
/// have started threads. Returns done or not_converged, or the code of a run that failed. Results that depend on the number of
/// threads are an internal fault.
ExitCode time_runs(const TimingOptions& options, Progress& progress);

}  // namespace naturel
