#include "core/sky_table.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/errors.h"
#include "core/sky_shape.h"
#include "core/units.h"

namespace naturel {
namespace {

/// Primitive of 2 sin h cos h, and of 2 h sin h cos h.
double flat_part(double h) { return std::sin(h) * std::sin(h); }
double slope_part(double h) { return 0.25 * std::sin(2.0 * h) - 0.5 * h * std::cos(2.0 * h); }

class TableSky final : public SkyShape {
public:
    TableSky(std::shared_ptr<const SkyTable> table, double north_rad)
        : table_(std::move(table)), cos_(std::cos(north_rad)), sin_(std::sin(north_rad)) {}

    double luminance(const glm::dvec3& d) const override {
        // From the frame of the model into the world's (docs/method.md, "Coordinates").
        return table_->luminance({d.x * cos_ + d.y * sin_, d.y * cos_ - d.x * sin_, d.z});
    }
    double horizontal() const override { return table_->horizontal(); }
    bool is_smooth() const override { return table_->is_interpolated(); }

private:
    std::shared_ptr<const SkyTable> table_;
    double cos_, sin_;
};

}  // namespace

SkyTable::SkyTable(SkyPatches patches, std::vector<double> values, bool interpolated)
    : patches_(std::move(patches)), values_(std::move(values)), interpolated_(interpolated) {
    NATUREL_EXPECT(static_cast<int>(values_.size()) == patches_.count());
}

/// Linear between the centres of a row; turn: azimuth / 2 pi, in [0, 1).
double SkyTable::along(const SkyRow& row, double turn) const {
    const double at = turn * row.count;
    const int column = static_cast<int>(at);
    const double share = at - column;
    const auto value = [&](int k) { return values_[static_cast<std::size_t>(row.first + k % row.count)]; };
    return (1.0 - share) * value(column) + share * value(column + 1);
}

double SkyTable::luminance(const glm::dvec3& direction) const {
    if (!interpolated_) return values_[static_cast<std::size_t>(patches_.patch_at(direction))];
    const double altitude = std::asin(std::clamp(direction.z, 0.0, 1.0));
    double turn = std::atan2(direction.x, direction.y) / (2.0 * pi);
    if (turn < 0.0) turn += 1.0;
    const std::vector<SkyRow>& rows = patches_.rows();
    const auto above = std::ranges::upper_bound(rows, altitude, {}, &SkyRow::centre_rad);
    if (above == rows.begin()) return along(rows.front(), turn);
    if (above == rows.end()) return along(rows.back(), turn);
    const SkyRow &low = *std::prev(above), &high = *above;
    const double share = (altitude - low.centre_rad) / (high.centre_rad - low.centre_rad);
    return (1.0 - share) * along(low, turn) + share * along(high, turn);
}

double SkyTable::horizontal() const {
    const std::vector<SkyRow>& rows = patches_.rows();
    const auto mean = [&](const SkyRow& row) {
        const auto first = values_.begin() + row.first;
        return std::accumulate(first, first + row.count, 0.0) / row.count;
    };
    // The integral over azimuth is 2 pi times the mean of the row, interpolated or not.
    double sum = 0.0;
    if (!interpolated_) {
        for (const SkyRow& row : rows)
            sum += mean(row) * (flat_part(row.high_rad) - flat_part(row.low_rad));
        return pi * sum;
    }
    const double top = 0.5 * pi;
    sum += mean(rows.front()) * flat_part(rows.front().centre_rad);
    for (std::size_t r = 0; r + 1 < rows.size(); ++r) {
        const double low = rows[r].centre_rad, high = rows[r + 1].centre_rad;
        const double slope = (mean(rows[r + 1]) - mean(rows[r])) / (high - low);
        const double level = mean(rows[r]) - slope * low;
        sum += level * (flat_part(high) - flat_part(low)) + slope * (slope_part(high) - slope_part(low));
    }
    sum += mean(rows.back()) * (flat_part(top) - flat_part(rows.back().centre_rad));
    return pi * sum;
}

std::unique_ptr<SkyShape> make_table_sky(const SkyDescription& description, const glm::dvec3&) {
    NATUREL_EXPECT(description.table != nullptr);
    return std::make_unique<TableSky>(description.table, description.north_rad);
}

}  // namespace naturel
