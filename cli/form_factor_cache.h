#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

/// Form factors that outlive the process, for later runs with the same geometry, grid and options of visibility.
struct FormFactorCache {
    std::filesystem::path folder{};  ///< empty: none is kept
    double limit_bytes = 1e10;       ///< of all files in the folder; those used longest ago go first
};

/// Of everything the form factors of a grid depend on, the version of the program included.
std::string form_factor_key(const Building& building, const PatchGrid& grid, const Visibility& visibility, std::size_t rows, bool with_errors);

/// The same visibility, but all form factors together come from the folder if they are there, and go there if not. A file that is
/// damaged counts as absent; a folder that cannot be written to costs a note on stderr and nothing else. Many processes may share
/// a folder. Without a folder: the visibility as it is. building, grid: keep them alive.
std::unique_ptr<Visibility> with_cache(std::unique_ptr<Visibility> visibility, const Building& building, const PatchGrid& grid,
                                       const FormFactorCache& cache);

}  // namespace naturel
