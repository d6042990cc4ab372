#pragma once
#include <functional>
#include <span>
#include <vector>

#include "core/radiosity.h"

namespace naturel {

/// How much each of some readings owes to light that leaves a patch: the radiosity solved from its end (docs/method.md, "Series of
/// skies"). A reading is a sum over patches of weight x exitance, its IRC for example; it equals the sum over patches of
/// importance x first exitance, whatever the light.
struct Importance {
    std::size_t readings = 0, bands = 0;
    std::vector<double> value{};  ///< [patch][band][reading]
    int iterations = 0;           ///< most of any reading
    double relative_residual = 0.0;
    bool converged = true;

    std::span<const double> of(std::size_t patch, std::size_t band) const {
        return {value.data() + (patch * bands + band) * readings, readings};
    }
};

/// weights(reading, band, out): writes the weights of a reading, m2/m2: [patch], given as zeros.
/// bands: 1 where every patch is grey, else 3. area_m2, optics: [row_count of F].
/// Stops when the error of every reading is below options.tolerance times the mean exitance of all patches, under any light.
Importance solve_importance(const FormFactors& form_factors, std::span<const double> area_m2, std::span<const PatchOptics> optics,
                            std::size_t readings, std::size_t bands,
                            const std::function<void(std::size_t reading, std::size_t band, std::span<double> out)>& weights,
                            const RadiosityOptions& options, Progress& progress);

}  // namespace naturel
