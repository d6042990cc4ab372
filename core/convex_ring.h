#pragma once
#include "core/planar_region.h"

namespace naturel {

/// True when a ring turns left in every corner, as the rings of convex_hull() do. The ring must not cross itself.
bool is_convex(const Ring& ring);

/// What two convex rings have in common, convex itself; empty if that is not more than a line. Corners are found in double precision
/// and rounded to 1 nm once, as Clipper rounds them, at a small part of its cost.
Ring intersect_convex(const Ring& a, const Ring& b);

}  // namespace naturel
