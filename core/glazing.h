#pragma once
#include <optional>
#include <vector>

#include "core/band3.h"
#include "core/scene.h"

namespace naturel {

/// Transmittance of a glazing against the angle of incidence, prepared once.
class GlazingTransmission {
public:
    explicit GlazingTransmission(const Glazing& glazing);

    /// cos_incidence in [0, 1]; dimensionless, maintenance and frame included.
    Band3 transmittance(double cos_incidence) const;

    /// For diffuse light: 2 x integral of transmittance(c) c dc over [0, 1].
    Band3 diffuse_transmittance() const { return diffuse_; }

private:
    AngularLaw law_;            // `diffuse` has become `constant`
    Band3 normal_;              // at normal incidence, maintenance and frame included
    std::vector<Band3> table_;  // the same at equal steps of the root of the cosine; laws fresnel and table
    Band3 diffuse_{};
};

/// One slab of refractive index `n` in air at one angle of incidence.
struct SlabResponse {
    double transmittance_s = 0.0, transmittance_p = 0.0;
    double reflectance_s = 0.0, reflectance_p = 0.0;
};

/// internal_transmittance: share that survives one perpendicular passage through the glass alone, [0, 1].
SlabResponse slab_response(double cos_incidence, double internal_transmittance, double n);

/// What a pile of panes does with unpolarised light.
struct PileResponse {
    double transmittance = 0.0, reflectance = 0.0;
};

/// `panes` identical slabs behind each other, all reflections between them counted.
PileResponse multi_pane_response(double cos_incidence, double internal_transmittance, int panes, double n);
double multi_pane_transmittance(double cos_incidence, double internal_transmittance, int panes, double n);

/// What one pane must let survive between its faces so that the unit has this transmittance at normal incidence: for
/// one pane, what Radiance's material "glass" calls transmissivity. In [0, 1]; 1 also where even glass without
/// absorption would transmit less (docs/method.md eqs. (Glazing 4) and (Glazing 5)).
double internal_transmittance(double normal_transmittance, int panes, double n);

/// Diffuse reflectance that clear panes of the glazing's normal transmittance have, times its frame factor; black for
/// the laws that say nothing about panes (`constant`, `table`). In no band more than what is not transmitted.
/// normal_reflectance: where measured, the result is scaled by it over that of the clear panes.
Band3 pane_reflectance(const Glazing& glazing, const std::optional<Band3>& normal_reflectance = {});

}  // namespace naturel
