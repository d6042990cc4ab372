#include "core/sky_interpolation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/sky_table.h"

namespace naturel {
namespace {

/// Near the zenith a row is short; with fewer directions a slope would be seen as a wave along it.
constexpr int least_columns = 24;

/// Rows of directions from the horizon to the zenith, as many in each as keep the distance.
SkyPatches rows_of_directions(double spacing_rad) {
    const int last = static_cast<int>(std::ceil(0.5 * pi / spacing_rad));
    const double step = 0.5 * pi / last;
    std::vector<SkyRow> rows;
    int first = 0;
    for (int j = 0; j <= last; ++j) {
        const double altitude = j * step;
        const int count = j == last ? 1 : std::max(least_columns, static_cast<int>(std::ceil(2.0 * pi * std::cos(altitude) / step)));
        rows.push_back({std::max(0.0, altitude - 0.5 * step), std::min(0.5 * pi, altitude + 0.5 * step), altitude, count, first});
        first += count;
    }
    return SkyPatches(std::move(rows));
}

/// Lagrange's polynomial through values at -1, 0, 1 and 2.
std::array<double, 4> cubic_weights(double t) {
    return {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0, -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0};
}

glm::dvec3 turned(const glm::dvec3& d, double cosine, double sine) { return {d.x * cosine + d.y * sine, d.y * cosine - d.x * sine, d.z}; }

bool same(const SkyRow& a, const SkyRow& b) {
    return a.low_rad == b.low_rad && a.high_rad == b.high_rad && a.centre_rad == b.centre_rad && a.count == b.count;
}

}  // namespace

SkyInterpolation::SkyInterpolation(SkyPatches patches, Order order, double north_rad)
    : patches_(std::move(patches)), order_(order), north_rad_(north_rad) {
    for (int k = 0; k < patches_.count(); ++k) {
        glm::dvec3 direction = turned(patches_.centre(k), std::cos(north_rad_), -std::sin(north_rad_));
        direction.z = std::max(0.0, direction.z);
        directions_.push_back(direction);
    }
}

SkyInterpolation::SkyInterpolation(double spacing_rad) : SkyInterpolation(rows_of_directions(spacing_rad), Order::cubic, 0.0) {}

SkyInterpolation::SkyInterpolation(const SkyTable& table, double north_rad)
    : SkyInterpolation(table.patches(), table.is_interpolated() ? Order::linear : Order::constant, north_rad) {}

bool SkyInterpolation::operator==(const SkyInterpolation& other) const {
    return order_ == other.order_ && north_rad_ == other.north_rad_ &&
           std::ranges::equal(patches_.rows(), other.patches_.rows(), same);
}

void SkyInterpolation::find(const glm::dvec3& direction, Stencil& stencil) const {
    const glm::dvec3 own = turned(direction, std::cos(north_rad_), std::sin(north_rad_));
    stencil.count = 0;
    if (order_ == Order::constant) {
        stencil.nodes[0] = static_cast<std::uint32_t>(patches_.patch_at(own));
        stencil.weights[0] = 1.0;
        stencil.count = 1;
        return;
    }
    const double altitude = std::asin(std::clamp(own.z, 0.0, 1.0));
    double turn = std::atan2(own.x, own.y) / (2.0 * pi);
    if (turn < 0.0) turn += 1.0;
    const std::vector<SkyRow>& rows = patches_.rows();
    if (order_ == Order::linear) {
        const auto above = std::ranges::upper_bound(rows, altitude, {}, &SkyRow::centre_rad);
        if (above == rows.begin()) return add_linear(rows.front(), turn, 1.0, stencil);
        if (above == rows.end()) return add_linear(rows.back(), turn, 1.0, stencil);
        const SkyRow &low = *std::prev(above), &high = *above;
        const double share = (altitude - low.centre_rad) / (high.centre_rad - low.centre_rad);
        add_linear(low, turn, 1.0 - share, stencil);
        return add_linear(high, turn, share, stencil);
    }
    const int last = static_cast<int>(rows.size()) - 1;
    const double place = altitude / rows[1].centre_rad;
    const int first = std::max(0, static_cast<int>(place) - 1);  // at the horizon from one side
    const std::array<double, 4> shares = cubic_weights(place - first - 1);
    for (int k = 0; k < 4; ++k) {
        // Beyond the zenith the rows go on on the other side.
        const int row = first + k;
        if (row <= last) add_cubic(rows[static_cast<std::size_t>(row)], turn, shares[static_cast<std::size_t>(k)], stencil);
        else add_cubic(rows[static_cast<std::size_t>(2 * last - row)], turn < 0.5 ? turn + 0.5 : turn - 0.5,
                       shares[static_cast<std::size_t>(k)], stencil);
    }
}

void SkyInterpolation::add_linear(const SkyRow& row, double turn, double share, Stencil& stencil) const {
    const double at = turn * row.count;
    const int column = static_cast<int>(at);
    for (const auto& [k, weight] : {std::pair{column, 1.0 - (at - column)}, std::pair{column + 1, at - column}}) {
        stencil.nodes[stencil.count] = static_cast<std::uint32_t>(row.first + k % row.count);
        stencil.weights[stencil.count++] = share * weight;
    }
}

void SkyInterpolation::add_cubic(const SkyRow& row, double turn, double share, Stencil& stencil) const {
    if (row.count == 1) {
        stencil.nodes[stencil.count] = static_cast<std::uint32_t>(row.first);
        stencil.weights[stencil.count++] = share;
        return;
    }
    const double at = turn * row.count;
    const int column = static_cast<int>(at);
    const std::array<double, 4> weights = cubic_weights(at - column);
    for (int k = 0; k < 4; ++k) {
        stencil.nodes[stencil.count] = static_cast<std::uint32_t>(row.first + (column + k - 1 + row.count) % row.count);
        stencil.weights[stencil.count++] = share * weights[static_cast<std::size_t>(k)];
    }
}

}  // namespace naturel
