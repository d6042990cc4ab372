#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "core/building.h"
#include "core/glazing.h"

namespace naturel {

/// A part of a face that the sun lights through one sequence of apertures.
struct Sunspot {
    FaceId face{};
    ApertureId aperture{};   ///< the exterior aperture it comes through
    Region region{};         ///< in Face::plane
    Band3 transmittance{};   ///< of all glazings on the way, each at its own angle
    Band3 illuminance_lx{};  ///< E_dn cos(i) transmittance: the same all over the spot
};

/// Where on the indoor faces of a building light comes from directly (docs/method.md, "Sunspots" and "Umbra zones").
struct LightZones {
    std::vector<std::vector<Sunspot>> sunspots;  ///< [face]; empty for apertures and outdoor faces
    std::vector<Region> umbra;                   ///< [face], in Face::plane: no point of any exterior aperture is seen
};

/// The sun as far as shadows are concerned.
struct SunBeam {
    glm::dvec3 direction{0, 0, 1};  ///< unit, towards the sun
    double direct_normal_illuminance_lx = 0.0;
    Band3 colour = grey(1.0);  ///< bands of its light of illuminance 1
};

/// The sun of a scene; empty when there is none, or when it gives no light.
std::optional<SunBeam> sun_beam(const Scene& scene);

/// Exact for sunspots. Umbra zones are cautious: what several occluders hide only together may be missing, what is in
/// them sees no aperture. sun: null when there is none or it is below the horizon.
LightZones find_light_zones(const Scene& scene, const Building& building, const SunBeam* sun);

/// The same with the sun of the scene, or none at all when the scene's grid shall not follow zones.
LightZones find_light_zones(const Scene& scene, const Building& building);

}  // namespace naturel
