#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "cli/options.h"
#include "cli/prepared_scene.h"
#include "cli/result.h"
#include "core/scene_sources.h"

namespace naturel {

inline constexpr const char* stored_solution_name = "solution.bin";

/// A finished run as a file keeps it, for pictures without computing again (docs/stored_solution.md): the scene and its side files,
/// the options, and the numbers at nodes, patches and sensors. What follows from the scene alone (building, zones, grid, sky) is
/// made again when it is read. Equal results give equal bytes. sources: that the scene was read from.
std::string stored_solution(const Result& result, std::span<const SourceFile> sources);

/// A run that has been read back: what Result refers to, but for the visibility.
struct StoredRun {
    RunOptions options;  ///< those that the numbers came from; of pictures, those of the views in `prepared.scene`
    PreparedScene prepared;
    DaylightSolution solution;  ///< without times and without the quality of form factors
};

/// result: what stored_solution() wrote, or the folder that it lies in. Throws InputError where it cannot be read, is of another
/// version or damaged, or where this program does not make the same grid of its scene. Throws Interrupted.
StoredRun read_stored_solution(const std::filesystem::path& result, const Progress& progress);

}  // namespace naturel
