#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "core/building.h"
#include "core/glazing.h"
#include "core/patch_grid.h"
#include "core/progress.h"
#include "core/sky.h"
#include "core/visibility.h"

namespace naturel {

/// Light kept apart by what it stems from: the daylight factor wants the sky alone.
struct LightBySource {
    Band3 sky{};    ///< from the sky, directly or after reflections
    Band3 other{};  ///< from the sun and from emitting surfaces

    LightBySource& operator+=(const LightBySource& o) { return sky += o.sky, other += o.other, *this; }
    friend LightBySource operator+(LightBySource a, const LightBySource& b) { return a += b; }
    friend LightBySource operator*(double k, const LightBySource& a) { return {k * a.sky, k * a.other}; }
    friend LightBySource operator*(const Band3& k, const LightBySource& a) { return {k * a.sky, k * a.other}; }
    Band3 total() const { return sky + other; }
};

/// Everything that shines outdoors.
struct OutdoorLight {
    Sky sky;
    glm::dvec3 sun_direction{0, 0, 1};        ///< unit, towards the sun
    double direct_normal_illuminance_lx = 0;  ///< 0 when there is no sun or it is below the horizon
    Band3 sky_colour = grey(1.0);             ///< bands of sky light of luminance 1
    Band3 sun_colour = grey(1.0);             ///< the same of the sun
    LightBySource ground_luminance_cd_m2{};
    std::vector<LightBySource> patch_luminance_cd_m2{};  ///< [patch], filled for outdoor patches only

    Illuminance horizontal_illuminance() const { return sky.horizontal_illuminance(); }  ///< the sun excluded
};

/// Lights ground and outdoor facets (docs/method.md, "Outdoors"): the ground by the unobstructed sky and sun, the patches
/// of outdoor faces by sky, sun and ground as far as other buildings do not hide them; one reflection.
OutdoorLight light_outdoors(const Scene& scene, const Building& building, const PatchGrid& grid,
                            const Visibility& visibility, Progress& progress);

/// Luminance in a direction in which first_seen() said `seen`. from_m: the observer. An indoor facet counts as dark.
/// is_sky (may be null): set to true when the light comes straight from the sky.
LightBySource outdoor_luminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                                bool* is_sky = nullptr);

/// Illuminance of a point in the open air (an outdoor patch or an outdoor sensor), by 1024 directions of equal weight and
/// one towards the sun.
struct OutdoorIlluminance {
    Band3 sky_lx, sun_lx;
    LightBySource reflected_lx{};
};
OutdoorIlluminance outdoor_illuminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                       const Visibility& visibility, const GatherPoint& point);

}  // namespace naturel
