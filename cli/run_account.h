#pragma once
#include <string>
#include <vector>

#include "cli/result.h"

namespace naturel {

/// The short account of a run for people.
std::string run_account(const Result& result, const std::vector<SensorSetStatistics>& sets);

/// The same of a comparison of two backends.
std::string difference_account(const std::string& backend, const std::string& reference, const std::vector<SensorSetDifference>& sets);

/// A line for every set with points that are not where people are.
std::string misplaced_sensors(const std::vector<SensorSetStatistics>& sets);

}  // namespace naturel
