#pragma once
#include <string>
#include <vector>

#include "core/building.h"

namespace naturel {

/// A sentence for every view that looks from inside a solid, or whose eye lies on a surface: such pictures show nothing that is.
std::vector<std::string> view_notes(const Scene& scene, const Building& building);

}  // namespace naturel
