#include "core/sky_patches.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/errors.h"
#include "core/sun.h"
#include "core/units.h"

namespace naturel {

SkyPatches::SkyPatches(std::vector<SkyRow> rows)
    : rows_(std::move(rows)), count_(rows_.back().first + rows_.back().count) {}

int SkyPatches::patch_at(const glm::dvec3& direction) const {
    const double altitude = std::asin(std::clamp(direction.z, 0.0, 1.0));
    const auto above =
        std::ranges::upper_bound(rows_, altitude, {}, &SkyRow::low_rad);  // the lowest row starts at 0
    const SkyRow& row = *std::prev(above);
    const double turn = std::atan2(direction.x, direction.y) / (2.0 * pi) * row.count;
    const int column = static_cast<int>(std::floor(turn + 0.5));
    return row.first + ((column % row.count) + row.count) % row.count;
}

const SkyRow& SkyPatches::row_of(int patch) const {
    return *std::prev(std::ranges::upper_bound(rows_, patch, {}, &SkyRow::first));
}

glm::dvec3 SkyPatches::centre(int patch) const {
    const SkyRow& row = row_of(patch);
    return direction_from_angles(row.centre_rad, 2.0 * pi * (patch - row.first) / row.count);
}

double SkyPatches::solid_angle_sr(int patch) const {
    const SkyRow& row = row_of(patch);
    return 2.0 * pi * (std::sin(row.high_rad) - std::sin(row.low_rad)) / row.count;
}

SkyPatches tregenza_patches() { return reinhart_patches(1); }

SkyPatches reinhart_patches(int factor) {
    NATUREL_EXPECT(factor >= 1);
    constexpr std::array counts{30, 30, 24, 24, 18, 12, 6};
    const double height_rad = 0.5 * pi / (7.0 * factor + 0.5);
    std::vector<SkyRow> rows;
    int first = 0;
    for (int r = 0; r < 7 * factor; ++r) {
        const int count = factor * counts[static_cast<std::size_t>(r / factor)];
        rows.push_back({r * height_rad, (r + 1) * height_rad, (r + 0.5) * height_rad, count, first});
        first += count;
    }
    rows.push_back({7 * factor * height_rad, 0.5 * pi, 0.5 * pi, 1, first});
    return SkyPatches(std::move(rows));
}

SkyPatches raster_patches(const std::vector<double>& altitudes_rad, int columns) {
    NATUREL_EXPECT(!altitudes_rad.empty() && columns >= 1);
    std::vector<SkyRow> rows;
    for (std::size_t r = 0; r < altitudes_rad.size(); ++r) {
        const double low = r == 0 ? 0.0 : rows.back().high_rad;
        const double high =
            r + 1 == altitudes_rad.size() ? 0.5 * pi : 0.5 * (altitudes_rad[r] + altitudes_rad[r + 1]);
        rows.push_back({low, high, altitudes_rad[r], columns, static_cast<int>(r) * columns});
    }
    return SkyPatches(std::move(rows));
}

}  // namespace naturel
