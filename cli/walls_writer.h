#pragma once
#include <string>

#include "cli/drawing_parts.h"

namespace naturel {

/// The walls and slopes of a floor unrolled, each in its true size as seen from the room: SVG text. Empty for
/// a floor without any.
std::string draw_walls(const DrawingContext& context, const DrawnFloor& floor);

}  // namespace naturel
