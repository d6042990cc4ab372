#pragma once
#include "core/scene.h"

namespace naturel::tests {

/// A hall of 40 x 30 x 8 m with eight windows in its south wall, the sun in them, and `count` boxes at random on its floor.
Scene hall_with_boxes(int count);

}  // namespace naturel::tests
