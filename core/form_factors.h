#pragma once
#include <cstdint>
#include <vector>

#include "core/patch_grid.h"
#include "core/progress.h"
#include "core/visibility.h"

namespace naturel {

/// A row that loses more than this is no matter of rounding (docs/embree.md, "Rays that escape, and ties").
constexpr double leaking_share = 0.01;

/// How well the rows fulfil the two laws of form factors before any repair.
struct FormFactorQuality {
    double mean_lost = 0.0;       ///< area-weighted mean of FormFactorRow::lost
    double worst_lost = 0.0;
    std::size_t leaking_rows = 0;  ///< that lose more than leaking_share
    std::size_t worst_row = 0;     ///< the first that loses most
    double mean_truncated = 0.0;  ///< area-weighted mean of FormFactorRow::truncated
    double worst_truncated = 0.0;
    double mean_escaped = 0.0;       ///< area-weighted mean of FormFactorRow::escaped
    double worst_escaped = 0.0;
    double reciprocity_gap = 0.0;    ///< sum |A_i F_ij - A_j F_ji| / sum (A_i F_ij + A_j F_ji)
    double worst_flux_error = 0.0;   ///< largest |sum_i A_i F_ij / A_j - sum_j' F_jj'| over patches j: light made or lost
    double worst_excess = 0.0;       ///< largest amount by which a row with what it lost and truncated exceeds 1
    double repair_change = 0.0;      ///< sum |F' - F| A / sum F A: what the repair moved
};

/// All rows of a building in compressed rows. Geometry alone: one set serves every sky, sun, reflectance and band.
struct FormFactors {
    std::vector<std::uint64_t> row_begin{};  ///< [gather_patch_count + 1]
    std::vector<std::uint32_t> column{};     ///< [entries], increasing in a row
    std::vector<double> value{};             ///< [entries], F_ij
    std::vector<float> error{};              ///< [entries] estimates before any repair; empty unless asked for and known
    std::vector<double> lost{};              ///< [row], as FormFactorRow::lost
    std::vector<double> truncated{};         ///< [row]
    std::vector<double> escaped{};           ///< [row]
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
    bool errors = false;  ///< keep the estimated error of every value; repaired values may have none
};

/// Each row's own share of FormFactorQuality::reciprocity_gap, of the values as they are: [row],
/// sum_j |A_i F_ij - A_j F_ji| / sum_j (A_i F_ij + A_j F_ji); 0 for an empty row.
std::vector<double> reciprocity_gaps(const FormFactors& form_factors, const PatchGrid& grid);

/// Rows of some patches of every face: what all rows will be like.
struct FormFactorSample {
    double mean_row_length = 0.0;  ///< entries
    double worst_lost = 0.0;       ///< largest FormFactorRow::lost
    PatchId worst_patch{};         ///< whose row that is
};

/// Asks `visibility` for about 512 rows, in parallel.
FormFactorSample sample_form_factors(const Visibility& visibility, const PatchGrid& grid, Progress& progress);

/// The most memory that compute_form_factors() takes at a time, bytes, where a row has so many entries on average.
double forecast_memory_bytes(std::size_t row_count, double mean_row_length);

/// Throws InputError when the form factors of a grid need more than `memory_bytes`. Asks for a sample of the rows only
/// where rows that see everything would not fit.
void refuse_excessive_memory(const Visibility& visibility, const PatchGrid& grid, double memory_bytes,
                             Progress& progress);

/// Asks `visibility` for every row, in parallel.
FormFactors compute_form_factors(const Visibility& visibility, const PatchGrid& grid, const FormFactorOptions& options,
                                 Progress& progress);

}  // namespace naturel
