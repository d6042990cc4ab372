#include "cli/leaks.h"

#include <fmt/format.h>

#include <algorithm>

namespace naturel {

std::string leak_warning(const Building& building, const PatchGrid& grid, const FormFactorQuality& quality) {
    if (quality.leaking_rows == 0 || std::ranges::any_of(building.faces, &Face::sheet)) return {};
    const Patch& worst = grid.patches[quality.worst_row];
    return fmt::format("warning: {} of {} patches lose more than {:.0f} % of what leaves them, though solids enclose the room; worst {:.1f} %, "
                       "patch {} of face \"{}\" at ({:.4g}, {:.4g}, {:.4g}) m (too thin or too small for its distances, or a point inside a "
                       "solid: do not trust the values there)\n",
                       quality.leaking_rows, grid.gather_patch_count, 100.0 * leaking_share, 100.0 * quality.worst_lost, quality.worst_row,
                       building.faces[index(worst.face)].name, worst.centroid_m.x, worst.centroid_m.y, worst.centroid_m.z);
}

}  // namespace naturel
