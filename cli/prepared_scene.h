#pragma once
#include <filesystem>
#include <optional>

#include "cli/options.h"
#include "core/building.h"
#include "core/light_zones.h"
#include "core/patch_grid.h"
#include "core/progress.h"
#include "core/scene.h"
#include "core/scene_sources.h"
#include "core/stage_clock.h"

namespace naturel {

/// A scene and everything of it that is found before anybody looks around.
struct PreparedScene {
    Scene scene;
    Building building;
    std::optional<SunBeam> sun;  ///< that casts sunspots
    LightZones zones;            ///< empty where the scene's grid follows none
    PatchGrid grid;
};

/// A scene file with the defaults of a preset.
/// grid_spacing_m: replaces what the file says. read: set to the files that were read, the scene's own first.
Scene read_scene_file(const std::filesystem::path& file, const QualityPreset& quality, const std::optional<double>& grid_spacing_m,
                      std::vector<std::filesystem::path>& read);
Scene read_scene_file(const std::filesystem::path& file, const QualityPreset& quality, const std::optional<double>& grid_spacing_m);

/// What the options of a run have another say in than the scene.
void replace_by_options(Scene& scene, const RunOptions& options);

/// The scene of a run, with what its options replace. sources: set to the files it was read from.
Scene read_scene_file(const RunOptions& options, std::vector<SourceFile>& sources);

/// Assembly, light zones and grid. Throws Interrupted.
/// clock: told of each, where there is one.
PreparedScene prepare_scene(Scene scene, const QualityPreset& quality, const Progress& progress, StageClock* clock = nullptr);

}  // namespace naturel
