#pragma once
#include <string>

#include "cli/drawing_parts.h"

namespace naturel {

/// The plan of a floor, cut 1 m over it, with its level surfaces from above: SVG text. Empty for a floor
/// without extent.
std::string draw_plan(const DrawingContext& context, const DrawnFloor& floor);

}  // namespace naturel
