#pragma once
#include <filesystem>
#include <string>

#include "core/building.h"
#include "core/form_factors.h"
#include "core/patch_grid.h"

namespace naturel {

/// What a file of form factors holds. Refers to its parts.
struct FormFactorTable {
    const Building& building;
    const PatchGrid& grid;
    const FormFactors& form_factors;
    const std::vector<double>& row_sum;           ///< [row] sum of the values
    const std::vector<double>& reciprocity_gap;   ///< [row] reciprocity_gaps()
    const std::string& description;               ///< JSON: program, scene, backend, options, statistics
};

/// The files that are written where a table goes to one of that name, the named one last.
std::vector<std::filesystem::path> names_of_form_factor_files(const std::filesystem::path& file);

/// Writes the table as the ending of the name says: .csv, .npz or .bin (docs/form_factor_files.md). Returns the files that it
/// wrote, each whole or not at all, the named one last. Throws InputError.
std::vector<std::filesystem::path> write_form_factor_files(const std::filesystem::path& file, const FormFactorTable& table);

}  // namespace naturel
