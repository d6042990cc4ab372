#pragma once
#include "core/building.h"

namespace naturel {

/// The reader limits the grid that a scene file asks for; this does it for --grid-spacing. Throws InputError.
void refuse_too_fine_grid(const Building& building, double spacing_m);

}  // namespace naturel
