#pragma once
#include <cstdint>
#include <vector>

#include "core/patch_grid.h"

namespace naturel {

/// Which patch lies under a place of a face's grid, where one look tells. Faces with cut cells have all cells divided, and what
/// is crossed by one line alone knows the patches on its sides.
class CellPatches {
public:
    CellPatches(const PatchGrid& grid, std::size_t face_count);

    /// A face's own cells. Behind the last of each row and column there is another like it, where rounding may lead.
    struct FaceCells {
        std::uint32_t first = 0;
        int division = 1;  ///< of each cell of the face's grid, along either side
        int columns = 0;   ///< from one row to the next
    };
    const FaceCells& of_face(FaceId face) const { return faces_[index(face)]; }

    /// A cell of no face, with no clear patch.
    std::uint32_t unclear_cell() const { return static_cast<std::uint32_t>(counters_.size() - 1); }

    /// HitCounts::counter_of() the patch of each cell; entries that are not below `cut` want patch_beside().
    const std::uint32_t* counters() const { return counters_.data(); }
    static constexpr std::uint32_t cut = 0x8000'0000u;

    /// The patch under a place (in divided cells) of a cut cell; PatchId::none too close to the line to tell, or where it takes
    /// more than a line.
    PatchId patch_beside(std::uint32_t entry, float column, float row) const {
        if (entry == unknown) return PatchId::none;
        const Split& split = splits_[entry & ~cut];
        const float side = split.along_columns * column + split.along_rows * row + split.offset;
        if (side > split.margin) return split.inside;
        return side < -split.margin ? split.outside : PatchId::none;
    }

private:
    static constexpr std::uint32_t unknown = 0xffff'ffffu;

    struct Split {
        float along_columns, along_rows, offset;  ///< signed distance from the line, in divided cells
        float margin;                             ///< what rounding may make of it, and more
        PatchId inside, outside;
    };
    struct Outline;

    std::uint32_t entry_of(const std::vector<Outline>& outlines, int column, int row, double rounding);

    std::vector<FaceCells> faces_;         ///< [face]
    std::vector<std::uint32_t> counters_;  ///< by rows, one face after the other
    std::vector<Split> splits_;
};

}  // namespace naturel
