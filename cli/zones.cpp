#include "cli/zones.h"

#include <fmt/format.h>

#include <cstdio>

#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/prepared_scene.h"
#include "cli/zone_drawings.h"
#include "cli/zone_writer.h"
#include "core/errors.h"

namespace naturel {

void find_zones(const ZonesOptions& options, Progress& progress) {
    std::vector<std::filesystem::path> files_read;
    Scene scene = read_scene_file(options.scene, options.quality, options.grid_spacing_m, files_read);
    refuse_to_replace(files_read, std::vector{options.out / "zones.json"});
    make_writable_folder(options.out);
    const Building building = assemble(scene);
    choose_grid_spacing(scene, building, options.quality);

    progress.begin("light zones", building.faces.size());
    const std::optional<SunBeam> sun = sun_beam(scene);
    const LightZones zones = find_light_zones(scene, building, sun ? &*sun : nullptr);
    progress.end();
    if (progress.interrupted()) throw Interrupted();

    const Primaries primaries(scene.primaries);
    const ZoneReport report{options.scene, scene, building, sun, zones, primaries};
    std::vector<Drawing> drawings;
    if (options.svg) {
        const PatchGrid grid = make_patch_grid(building, scene.grid, scene.grid.zones ? zones : LightZones{});
        if (progress.interrupted()) throw Interrupted();
        drawings = draw_zones(report, grid);
    }
    for (const Drawing& drawing : drawings) refuse_to_replace(files_read, std::vector{options.out / drawing.file});
    // Nothing is written before everything is there.
    std::string account = zones_table(report);
    const auto write = [&](const std::string& name, const std::string& text) {
        write_file(options.out / name, text);
        account += fmt::format("  written to {}\n", (options.out / name).string());
    };
    write("zones.json", zones_json(report));
    for (const Drawing& drawing : drawings)
        write(drawing.file, drawing.svg);
    std::fwrite(account.data(), 1, account.size(), stdout);
}

}  // namespace naturel
