#pragma once
#include <optional>
#include <random>

#include "core/building.h"
#include "core/scene.h"

namespace naturel::tests {

/// Uniform over a convex facet. Not by std::uniform_real_distribution: its values differ between standard libraries.
glm::dvec3 point_in(const Facet& facet, std::mt19937_64& random);

double uniform(std::mt19937_64& random, double low, double high);

/// What a ray from a point of a face towards the sun crosses before it is in the open.
struct SunPath {
    std::optional<ApertureId> exit{};  ///< the first exterior aperture that leads outdoors; none: the point is not lit
    Band3 transmittance = grey(1.0);   ///< of all apertures on the way
    bool operator==(const SunPath&) const = default;
};

/// Tries every facet, in double precision.
SunPath path_to_sun(const Scene& scene, const Building& building, const Face& face, const glm::dvec3& point_m, const glm::dvec3& to_sun);

/// True when a point of a face sees a point of the room side of an aperture. Tries every facet, in double precision.
bool sees(const Building& building, const Face& face, const glm::dvec3& point_m, const Aperture& aperture,
          const glm::dvec3& aperture_point_m);

}  // namespace naturel::tests
