#include "cli/prepared_scene.h"

#include <utility>

#include "cli/files_read.h"
#include "core/errors.h"
#include "core/scene_reader.h"

namespace naturel {

Scene read_scene_file(const std::filesystem::path& file, const QualityPreset& quality, const std::optional<double>& grid_spacing_m,
                      std::vector<std::filesystem::path>& read) {
    std::vector<SourceFile> sources;
    Scene scene = read_scene_with_sources(file, scene_defaults(quality), sources);
    read = paths_of_sources(file, sources);
    if (grid_spacing_m) scene.grid.spacing_m = *grid_spacing_m;
    return scene;
}

Scene read_scene_file(const std::filesystem::path& file, const QualityPreset& quality, const std::optional<double>& grid_spacing_m) {
    std::vector<std::filesystem::path> read;
    return read_scene_file(file, quality, grid_spacing_m, read);
}

void replace_by_options(Scene& scene, const RunOptions& options) {
    if (options.grid_spacing_m) scene.grid.spacing_m = *options.grid_spacing_m;
    if (options.direct_method) scene.direct.method = *options.direct_method;
    if (options.direct_tolerance) scene.direct.tolerance = *options.direct_tolerance;
    for (View& view : scene.views) options.picture.apply_to(view.picture);
    options.picture.apply_to(scene.picture);
}

Scene read_scene_file(const RunOptions& options, std::vector<SourceFile>& sources) {
    Scene scene = read_scene_with_sources(options.scene, scene_defaults(options.quality), sources);
    replace_by_options(scene, options);
    return scene;
}

PreparedScene prepare_scene(Scene scene, const QualityPreset& quality, const Progress& progress, StageClock* clock) {
    const auto end_stage = [&](const char* stage) {
        if (progress.interrupted()) throw Interrupted();
        if (clock != nullptr) clock->end_stage(stage);
    };
    PreparedScene prepared;
    prepared.building = assemble(scene);
    choose_grid_spacing(scene, prepared.building, quality);
    end_stage("assembly");
    prepared.sun = sun_beam(scene);
    if (scene.grid.zones) {
        prepared.zones = find_light_zones(scene, prepared.building, prepared.sun ? &*prepared.sun : nullptr);
        end_stage("zones");
    }
    prepared.grid = make_patch_grid(prepared.building, scene.grid, prepared.zones);
    end_stage("grid");
    prepared.scene = std::move(scene);
    return prepared;
}

}  // namespace naturel
