#pragma once
#include "core/band3.h"

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

}  // namespace naturel
