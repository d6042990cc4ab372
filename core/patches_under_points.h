#pragma once
#include <cstdint>
#include <vector>

#include "core/box_index.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

/// Finds the patches that sensors lie on. Refers to its arguments: keep them alive.
class PatchesUnderPoints {
public:
    PatchesUnderPoints(const Building& building, const PatchGrid& grid);

    /// None in the air. near: scratch.
    PatchId patch_under(const GatherPoint& point, std::vector<std::uint32_t>& near) const;

private:
    const Building& building_;
    const PatchGrid& grid_;
    BoxIndex facets_;
};

}  // namespace naturel
