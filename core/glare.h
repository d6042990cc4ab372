#pragma once
#include <span>
#include <vector>

#include "core/units.h"
#include "core/view.h"

// Discomfort glare from daylight (docs/pictures.md, "Glare").
namespace naturel {

/// DGPs = 6.22e-5 Ev + 0.184, at most 1, from the vertical illuminance at the eye alone (Wienold 2009). Made for eyes that neither the sun nor its
/// mirror image reaches.
double simplified_glare_probability(Illuminance at_eye);

/// What the probabilities were fitted to: at least this at the eye, and results in between (Wienold & Christoffersen 2006).
inline constexpr Illuminance least_for_glare_probability{380.0};
inline constexpr double least_glare_probability = 0.2, largest_glare_probability = 0.8;

/// How much less a source disturbs away from the line of sight: Guth's index above it, as Levin's formula gives it, and Iwata and
/// Tokura's below; 1 on the line of sight, at most 16. forward, up: unit, perpendicular; direction: unit, in front.
double position_index(const glm::dvec3& direction, const glm::dvec3& forward, const glm::dvec3& up);

struct GlareSource {
    glm::dvec3 direction{};  ///< unit: mean, weighted by light
    double solid_angle_sr = 0.0;
    double luminance_cd_m2 = 0.0;  ///< mean
    double position_index = 1.0;
};

/// Connected pixels whose luminance is at least `threshold`, each group one source, in the order of their first pixels. Pixels of at
/// least `peak` are sources of their own within them: the sun, else averaged away.
/// luminance_cd_m2: [width x height] of the camera, 0 where nothing is shown.
std::vector<GlareSource> find_glare_sources(std::span<const double> luminance_cd_m2, const Camera& camera, Luminance threshold,
                                            Luminance peak);

/// The defaults of evalglare 2.
inline constexpr Luminance glare_threshold{2000.0}, glare_peak{50000.0};

/// DGP = 5.87e-5 Ev + 0.0918 log10(1 + sum L^2 omega / (Ev^1.87 P^2)) + 0.16, at most 1 (Wienold & Christoffersen 2006). 0 in the dark.
double glare_probability(Illuminance at_eye, std::span<const GlareSource> sources);

/// Illuminance of the plane that a fisheye of 180 degrees looks away from: the sum of L cos(theta) d omega over its pixels.
Illuminance illuminance_of_picture(std::span<const double> luminance_cd_m2, const Camera& camera);

}  // namespace naturel
