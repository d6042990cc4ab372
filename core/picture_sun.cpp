#include "core/picture_sun.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/planar_region.h"
#include "core/units.h"

namespace naturel {
namespace {

/// Half the mean angle that the sun is seen under from the earth.
const double disc_radius_rad = radians_from_degrees(0.533 / 2);
const double disc_sr = 4 * pi * std::pow(std::sin(disc_radius_rad / 2), 2);

/// Points that stand for equal parts of the disc.
constexpr int disc_points = 4096;

/// A sample this many times smaller than the disc is in it or not, as its centre: what is wrong along the rim is below 1 % of
/// the sun.
constexpr double small_samples = 1024;

/// A point of the disc; Vogel's spiral: equal areas.
glm::dvec3 point_of_disc(const PlaneFrame& frame, int k) {
    const double golden_rad = pi * (3 - std::sqrt(5.0));
    const double angle_rad = 2 * std::asin(std::sqrt((k + 0.5) / disc_points) * std::sin(disc_radius_rad / 2));
    return std::cos(angle_rad) * frame.normal +
           std::sin(angle_rad) * (std::cos(k * golden_rad) * frame.x + std::sin(k * golden_rad) * frame.y);
}

}  // namespace

PictureSun::PictureSun(const Camera& camera, const glm::dvec3& direction, double direct_normal_illuminance_lx)
    : luminance_of_disc_cd_m2_(direct_normal_illuminance_lx / disc_sr), direction_(direction), width_(camera.width) {
    if (!(direct_normal_illuminance_lx > 0.0)) return;
    const PlaneFrame frame = make_plane_frame({}, direction);
    column_begin_ = camera.width, row_begin_ = camera.height;
    for (int k = 0; k < disc_points; ++k) {
        const auto place = camera.place_of(point_of_disc(frame, k));
        if (!place) continue;
        const int column = std::min(static_cast<int>(place->column), camera.width - 1);
        const int row = std::min(static_cast<int>(place->row), camera.height - 1);
        column_begin_ = std::min(column_begin_, column - 1), column_end_ = std::max(column_end_, column + 2);
        row_begin_ = std::min(row_begin_, row - 1), row_end_ = std::max(row_end_, row + 2);
        const double sample_sr = pixel_solid_angle_sr(camera, column, row);
        samples_.emplace_back(static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(width_) + static_cast<std::uint64_t>(column),
                              direct_normal_illuminance_lx / disc_points / sample_sr);
    }
    if (samples_.empty()) return;
    const auto middle = camera.place_of(direction);
    const bool small = middle && small_samples * pixel_solid_angle_sr(camera, static_cast<int>(middle->column),
                                                                       static_cast<int>(middle->row)) < disc_sr;
    if (small) {
        samples_.clear();
        return;
    }
    std::ranges::sort(samples_);
    std::size_t last = 0;
    for (std::size_t k = 1; k < samples_.size(); ++k) {
        if (samples_[k].first == samples_[last].first)
            samples_[last].second += samples_[k].second;
        else
            samples_[++last] = samples_[k];
    }
    samples_.resize(last + 1);
}

double PictureSun::luminance_cd_m2(int column, int row, const glm::dvec3& direction) const {
    if (!may_show(column, column + 1, row, row + 1)) return 0.0;
    if (samples_.empty())
        return glm::dot(direction, direction_) >= std::cos(disc_radius_rad) ? luminance_of_disc_cd_m2_ : 0.0;
    const std::uint64_t number = static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(width_) + static_cast<std::uint64_t>(column);
    const auto found = std::ranges::lower_bound(samples_, number, {}, &std::pair<std::uint64_t, double>::first);
    return found != samples_.end() && found->first == number ? found->second : 0.0;
}

}  // namespace naturel
