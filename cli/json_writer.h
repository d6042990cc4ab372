#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "cli/result.h"

namespace naturel {

/// A picture that was written, for the summary.
struct WrittenView {
    std::string id;
    std::vector<std::string> files;      ///< EXR, PNG and, if asked for, PNG in false colour
    double white_luminance_cd_m2 = 0.0;  ///< shown as white in the PNG
    PictureOptions options{};
};

/// One stage of a run and how long it took.
struct StageTime {
    std::string stage;
    double seconds = 0.0;
};

// Texts of the JSON files. Keys keep their order; a number that is not finite is an internal fault.

/// What was computed, how, and how good it is: enough to run it again. No timings, and nothing that depends
/// on the number of threads.
std::string summary_json(const Result& result, const std::vector<SensorSetStatistics>& sets,
                         const std::vector<WrittenView>& views);

std::string timings_json(const std::vector<StageTime>& stages, int threads);

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
