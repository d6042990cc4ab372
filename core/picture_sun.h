#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "core/view.h"

namespace naturel {

/// The sun's disc in a picture: evenly bright, 0.533 degrees wide (Radiance's "source" of gendaylit). Where samples are large against
/// it, each gets the share of the disc that falls on it, so that the illuminance by the sun is exact at any size of pixels.
/// A parallel view, whose rays have one direction, never shows it.
class PictureSun {
public:
    /// direct_normal_illuminance_lx: 0 for no sun. camera: of the samples.
    PictureSun(const Camera& camera, const glm::dvec3& direction, double direct_normal_illuminance_lx);

    /// True where a rectangle of samples may show a part of the disc.
    bool may_show(int column_begin, int column_end, int row_begin, int row_end) const {
        return column_begin < column_end_ && column_end > column_begin_ && row_begin < row_end_ && row_end > row_begin_;
    }

    /// Mean over a sample, cd/m2, if nothing hides the sun. ray: of its centre.
    double luminance_cd_m2(int column, int row, const glm::dvec3& direction) const;

private:
    double luminance_of_disc_cd_m2_ = 0.0;
    glm::dvec3 direction_{};
    int width_ = 0;
    int column_begin_ = 0, column_end_ = 0, row_begin_ = 0, row_end_ = 0;  ///< samples that may show it
    std::vector<std::pair<std::uint64_t, double>> samples_{};  ///< number and luminance, increasing; empty where samples are small
};

}  // namespace naturel
