#pragma once
#include <cstdint>
#include <vector>

#include "core/patch_grid.h"
#include "core/progress.h"
#include "core/visibility.h"

namespace naturel {

/// How well the rows fulfil the two laws of form factors before any repair.
struct FormFactorQuality {
    double mean_lost = 0.0;       ///< area-weighted mean of FormFactorRow::lost
    double worst_lost = 0.0;
    double mean_truncated = 0.0;  ///< area-weighted mean of FormFactorRow::truncated
    double worst_truncated = 0.0;
    double reciprocity_gap = 0.0;    ///< sum |A_i F_ij - A_j F_ji| / sum (A_i F_ij + A_j F_ji)
    double worst_flux_error = 0.0;   ///< largest |sum_i A_i F_ij / A_j - sum_j' F_jj'| over patches j: light made or lost
    double repair_change = 0.0;      ///< sum |F' - F| A / sum F A: what the repair moved
};

/// All rows of a building in compressed rows. Geometry alone: one set serves every sky, sun, reflectance and band.
struct FormFactors {
    std::vector<std::uint64_t> row_begin{};  ///< [gather_patch_count + 1]
    std::vector<std::uint32_t> column{};     ///< [entries], increasing in a row
    std::vector<double> value{};             ///< [entries], F_ij
    FormFactorQuality quality{};

    std::size_t row_count() const { return row_begin.empty() ? 0 : row_begin.size() - 1; }
};

enum class FormFactorRepair {
    none,        ///< rows as the visibility method gave them
    renormalise, ///< each row scaled to 1 - lost: gives back what was truncated
    reciprocal,  ///< both estimates of an exchange averaged, then scaled symmetrically to the same sums: conserves flux
};

struct FormFactorOptions {
    FormFactorRepair repair = FormFactorRepair::reciprocal;
};

/// Asks `visibility` for every row, in parallel.
FormFactors compute_form_factors(const Visibility& visibility, const PatchGrid& grid, const FormFactorOptions& options,
                                 Progress& progress);

}  // namespace naturel
