#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/method_combinations.h"

namespace naturel {

/// One ingredient of the method under study.
struct Ingredient {
    std::string name;       ///< "truncation"
    std::string group;      ///< "form factors", "direct light" or "result"
    std::string replaces;   ///< in words: what takes the place of what
    LightState in_sequence{};  ///< with this ingredient and all before it
    LightState alone{};        ///< with this ingredient and no other
};

/// What the method under study costs, ingredient by ingredient: in sequence the signed differences add up to the total.
struct ErrorBudget {
    std::vector<Sensor> sensors{};
    LightState reference{};
    LightState again{};  ///< the reference by an independent way: their difference says how good it is
    std::vector<Ingredient> ingredients{};
    double outdoor_horizontal_lx = 0.0;
    std::optional<DaylightSolution> reference_solution{}, method_solution{};  ///< for pictures

    const LightState& method() const { return ingredients.back().in_sequence; }
};

/// Ways of seeing that the budget is made from. All for one building and grid.
struct BudgetVisibilities {
    const Visibility& reference;   ///< form factors and gathering as good as can be
    const Visibility& again;       ///< an independent way, nearly as good
    const Visibility& projection;  ///< the method under study
};

struct BudgetOptions {
    DirectOptions direct{.method = DirectMethod::article};  ///< of the method under study
    IndirectMethod indirect = IndirectMethod::patch;        ///< the same, at nodes; sensors gather
    FormFactorRepair repair = FormFactorRepair::none;       ///< the same
    std::optional<double> half_side_over_height{};          ///< the same, of its square; none: it leaves nothing out
    double reference_tolerance = 1e-4;                      ///< of direct light
    RadiosityOptions radiosity{};
};

/// Form factors that the budget compares, for tables of their own.
struct BudgetFormFactors {
    FormFactors reference{}, again{}, method{};
};

/// Replaces one ingredient of the reference after the other by that of the method under study (docs/method.md, "Error budget").
ErrorBudget compute_error_budget(const Scene& scene, const Building& building, const PatchGrid& grid,
                                 const BudgetVisibilities& visibilities, const BudgetOptions& options,
                                 BudgetFormFactors& form_factors, Progress& progress);

// Form factors with one ingredient of a projection in place of another. All of these are in closed form where nothing stands
// in the way.

/// Times F_ij (centroid) / F_ij (patch), both as if nothing stood in the way: what one viewpoint costs by nearness alone.
FormFactors seen_from_centroids(const FormFactors& form_factors, const PatchGrid& grid);

/// From the centroids of patches, behind whatever stands there. Where `reference` says that all of a patch is seen from all over
/// another, or nothing, in closed form; else from gather_row() at the centroid.
FormFactors visible_from_centroids(const FormFactors& reference, const FormFactors& near, const PatchGrid& grid,
                                   const Visibility& visibility, Progress& progress);

/// What a square of half side d at height h over the centroids catches: each value times the share of its patch that lies in the
/// pyramid of the square, as if nothing stood in the way. The sides of the square are those of the faces' grids.
FormFactors caught_by_square(const FormFactors& form_factors, const Building& building, const PatchGrid& grid,
                             double half_side_over_height);

}  // namespace naturel
