#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "cli/result.h"
#include "cli/view_writer.h"
#include "core/stage_clock.h"

namespace naturel {

// Texts of the JSON files. Keys keep their order; a number that is not finite is an internal fault.

/// What was computed, how, and how good it is: enough to run it again. No timings, and nothing that depends
/// on the number of threads.
std::string summary_json(const Result& result, const std::vector<SensorSetStatistics>& sets,
                         const std::vector<WrittenView>& views);

/// Wall and processor time of each stage, the threads that worked, how much was asked of the visibility per second, and the most
/// memory that the process has had so far.
std::string timings_json(const Result& result, const std::vector<StageTime>& stages);

/// A backend of a comparison and every option it had.
struct ComparedBackend {
    std::string name;
    std::vector<std::pair<std::string, std::string>> settings;
};

/// Differences between two backends, `backend` minus `reference`, and what they were computed from.
std::string comparison_json(const Scene& scene, const std::filesystem::path& scene_file,
                            const ComparedBackend& backend, const ComparedBackend& reference,
                            const std::vector<SensorSetDifference>& sets);

}  // namespace naturel
