#include "cli/zone_drawings.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/plan_writer.h"
#include "cli/walls_writer.h"

namespace naturel {

std::vector<Drawing> draw_zones(const ZoneReport& report, const PatchGrid& grid) {
    const std::vector<Storey> storeys = find_storeys(report.scene, report.building);
    DrawingContext context{.report = report,
                           .grid = grid,
                           .patches = std::vector<std::vector<PatchId>>(report.building.faces.size()),
                           .sensors = place_sensors(report.scene, report.building),
                           .floor_count = storeys.size()};
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p)
        context.patches[index(grid.patches[p].face)].push_back(make_id<PatchId>(p));
    for (const std::vector<Sunspot>& spots : report.zones.sunspots)
        for (const Sunspot& spot : spots)
            context.largest_sun_lx = std::max(context.largest_sun_lx, luminous_lx(context, spot));

    std::vector<Drawing> drawings;
    for (std::size_t k = 0; k < storeys.size(); ++k) {
        const DrawnFloor floor{storeys[k], k + 1};
        const auto add = [&](const char* what, std::string svg) {
            if (!svg.empty())
                drawings.push_back({fmt::format("floor_{}_{}.svg", k + 1, what), std::move(svg)});
        };
        add("plan", draw_plan(context, floor));
        add("walls", draw_walls(context, floor));
    }
    return drawings;
}

}  // namespace naturel
