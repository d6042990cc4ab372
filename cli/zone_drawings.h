#pragma once
#include <string>
#include <vector>

#include "cli/zone_writer.h"
#include "core/patch_grid.h"

namespace naturel {

/// A drawing and the name of its file.
struct Drawing {
    std::string file;  ///< "floor_1_plan.svg", "floor_1_walls.svg"
    std::string svg;
};

/// For every floor of the building a plan and its walls unrolled, both with grid, sunspots and umbra zones,
/// to scale. A building without indoor surfaces has none.
std::vector<Drawing> draw_zones(const ZoneReport& report, const PatchGrid& grid);

}  // namespace naturel
