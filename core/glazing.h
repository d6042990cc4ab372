#pragma once
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
    AngularLaw law_;
    Band3 normal_;              // at normal incidence, maintenance and frame included
    std::vector<Band3> table_;  // the same at equal steps of the root of the cosine; fresnel law only
    Band3 diffuse_{};
};

/// One slab of refractive index `n` in air at one angle of incidence.
struct SlabResponse {
    double transmittance_s = 0.0, transmittance_p = 0.0;
    double reflectance_s = 0.0, reflectance_p = 0.0;
};

/// internal_transmittance: share that survives one perpendicular passage through the glass alone, [0, 1].
SlabResponse slab_response(double cos_incidence, double internal_transmittance, double n);

/// Unpolarised transmittance of `panes` identical slabs behind each other, all reflections between them counted.
double multi_pane_transmittance(double cos_incidence, double internal_transmittance, int panes, double n);

}  // namespace naturel
