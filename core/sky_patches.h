#pragma once
#include <glm/vec3.hpp>
#include <vector>

namespace naturel {

/// A row of patches or raster points around the sky. Patch 0 is centred on azimuth 0, the others follow clockwise.
struct SkyRow {
    double low_rad, high_rad;  ///< altitudes of the borders
    double centre_rad;         ///< altitude of the centre; pi / 2 for the cap
    int count;
    int first;  ///< number of the row's first patch
};

/// A division of the sky into rows of patches, from the horizon up.
class SkyPatches {
public:
    /// rows: adjacent, from altitude 0 to pi / 2.
    explicit SkyPatches(std::vector<SkyRow> rows);

    const std::vector<SkyRow>& rows() const { return rows_; }
    int count() const { return count_; }
    /// Number of the patch in a direction with z >= 0.
    int patch_at(const glm::dvec3& direction) const;
    glm::dvec3 centre(int patch) const;
    double solid_angle_sr(int patch) const;

private:
    const SkyRow& row_of(int patch) const;

    std::vector<SkyRow> rows_;
    int count_;
};

/// The 145 patches of P. R. Tregenza 1987: rows of 12 degrees.
SkyPatches tregenza_patches();

/// C. F. Reinhart's subdivision, 144 factor^2 + 1 patches (factor 1: Tregenza's patches, 2: 577, 4: 2305, 6: 5185).
SkyPatches reinhart_patches(int factor);

/// A raster of `columns` azimuths at each altitude (radians, increasing, within [0, pi / 2]); borders half way between.
SkyPatches raster_patches(const std::vector<double>& altitudes_rad, int columns);

}  // namespace naturel
