#pragma once
#include <string>

#include "core/building.h"
#include "core/form_factors.h"
#include "core/patch_grid.h"

namespace naturel {

/// A line for people where patches lose light though every face belongs to a solid, so that there is no way out; else empty.
/// Sheets may have gaps and backs: what they lose is told by `naturel check`.
std::string leak_warning(const Building& building, const PatchGrid& grid, const FormFactorQuality& quality);

}  // namespace naturel
