#pragma once
#include <vector>

#include "core/sky_patches.h"

namespace naturel {

/// A sky given by a value per patch. Azimuths count from true north.
class SkyTable {
public:
    /// values: [patches.count()], >= 0. interpolated: linear in altitude and azimuth between the centres of the patches, constant
    /// beyond the lowest and the highest; otherwise constant on each patch.
    SkyTable(SkyPatches patches, std::vector<double> values, bool interpolated);

    /// direction: unit, z >= 0, y towards true north.
    double luminance(const glm::dvec3& direction) const;

    /// Integral of luminance x sin(altitude), in closed form (docs/method.md eq. (Sky 10)).
    double horizontal() const;

    int count() const { return patches_.count(); }
    const SkyPatches& patches() const { return patches_; }
    bool is_interpolated() const { return interpolated_; }

private:
    double along(const SkyRow& row, double turn) const;

    SkyPatches patches_;
    std::vector<double> values_;
    bool interpolated_;
};

}  // namespace naturel
