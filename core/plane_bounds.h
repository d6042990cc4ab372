#pragma once
#include <algorithm>

#include "core/planar_region.h"

namespace naturel {

/// An upright rectangle around polygons of a plane, in nm.
struct PlaneBounds {
    ClipperLib::cInt left = ClipperLib::hiRange, right = -ClipperLib::hiRange;
    ClipperLib::cInt bottom = left, top = right;

    PlaneBounds() = default;
    explicit PlaneBounds(const Ring& ring) { add(ring); }
    explicit PlaneBounds(const Region& region) {
        for (const Ring& ring : region) add(ring);
    }

    void add(const Ring& ring) {
        for (const PlanePoint& p : ring) {
            left = std::min(left, p.X), right = std::max(right, p.X);
            bottom = std::min(bottom, p.Y), top = std::max(top, p.Y);
        }
    }

    /// Keeps what is in `other` too.
    void cut(const PlaneBounds& other) {
        left = std::max(left, other.left), right = std::min(right, other.right);
        bottom = std::max(bottom, other.bottom), top = std::min(top, other.top);
    }

    /// Also when they only touch. Nothing touches the bounds of nothing.
    bool touches(const PlaneBounds& other) const {
        return left <= other.right && other.left <= right && bottom <= other.top && other.bottom <= top;
    }
};

}  // namespace naturel
