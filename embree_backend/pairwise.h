#pragma once
#include <memory>

#include "core/building.h"
#include "core/patch_grid.h"
#include "core/visibility.h"

namespace naturel {

struct PairwiseOptions {
    /// Largest estimated error of one form factor, absolute, dimensionless: of the larger one of F_ij and F_ji. A row with n partly
    /// visible patches sums to 1 within about sqrt(n) times as much.
    double tolerance = 1e-4;
};

/// How many unique pairs of patches took which way.
struct PairwiseCount {
    std::uint64_t facing = 0;   ///< see each other's fronts, were nothing between
    std::uint64_t blocked = 0;  ///< hidden from each other by one facet
    std::uint64_t partial = 0;  ///< have several or partly covering facets between them
};

/// Form factors of pairs of patches, each unique pair once: the exact unoccluded exchange times the visible share
/// (docs/method.md, "Pairs of patches"). Needs no rays.
class PairwiseExchange {
public:
    PairwiseExchange(const Building& building, const PatchGrid& grid, const PairwiseOptions& options);
    ~PairwiseExchange();

    /// As Visibility::form_factor_row(). `lost` is what the values leave of 1 if that is more than twice the root of the sum of
    /// the squares of their errors, else 0: less than that may be no leak at all.
    void row(PatchId from, FormFactorRow& row) const;
    void row(const GatherPoint& from, FormFactorRow& row) const;

    /// All rows; the values are those of row(), to the last bit.
    FormFactorRows rows(bool with_errors, Progress& progress, PairwiseCount* count = nullptr) const;

private:
    struct Data;
    std::unique_ptr<const Data> data_;
};

}  // namespace naturel
