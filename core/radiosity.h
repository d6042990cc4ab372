#pragma once
#include <span>
#include <vector>

#include "core/form_factors.h"
#include "core/outdoors.h"

namespace naturel {

struct RadiosityOptions {
    double tolerance = 1e-6;   ///< bound on the relative error of the flux at which the iteration stops
    int max_iterations = 2000;
};

/// What a surface does with light, per patch.
struct PatchOptics {
    Band3 reflectance{};
    Band3 transmittance{};           ///< diffuse, to `behind`; inner apertures only
    PatchId behind = PatchId::none;
    /// Emitted by itself; of a pane also the direct light it reflects. (What it lets pass is direct light elsewhere, so the
    /// direct illuminance of a pane is not part of the balance.)
    LightBySource exitance_lm_m2{};
};

struct RadiositySolution {
    std::vector<LightBySource> exitance_lm_m2{};          ///< [gather_patch_count]
    std::vector<LightBySource> indirect_illuminance_lx{}; ///< [gather_patch_count], the IRC
    int iterations = 0;
    double relative_residual = 0.0;
    bool converged = false;
    /// Luminous flux, lm, summed over both sources with the weights of the primaries left out (per band).
    Band3 flux_in_lm{};        ///< direct light on surfaces + light emitted by them
    Band3 flux_absorbed_lm{};  ///< by surfaces, and out through apertures
    Band3 flux_lost_lm{};      ///< through leaks and truncation, sum B A (1 - row sum)
};

/// Solves E_ind,i = sum_j F_ij B_j, B_j = M_j + rho_j (E_dir,j + E_ind,j) [+ light transmitted from behind], per band and
/// source (docs/method.md, "Radiosity").
/// area_m2, optics, direct_illuminance_lx: [row_count of F].
RadiositySolution solve_radiosity(const FormFactors& form_factors, std::span<const double> area_m2,
                                  std::span<const PatchOptics> optics,
                                  std::span<const LightBySource> direct_illuminance_lx, const RadiosityOptions& options,
                                  Progress& progress);

}  // namespace naturel
