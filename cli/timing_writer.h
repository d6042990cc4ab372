#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/timing_study.h"

namespace naturel {

/// Everything: machine, figures, warnings, and every run.
nlohmann::ordered_json timing_json(const TimingStudy& study, const TimingFigures& figures);

/// A row per stage and number of threads.
std::string timing_csv(const TimingFigures& figures);

/// A row per stage of every run: what was measured, for statistics of one's own.
std::string timing_runs_csv(const TimingStudy& study);

}  // namespace naturel
