#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace naturel::reference {

struct OccludedFormFactor {
    double value = 0.0;
    double error = 0.0;       ///< estimate of the quadrature
    double unoccluded = 0.0;  ///< by the same quadrature, without the occluders
};

/// Form factor from one convex polygon to another one past convex polygons that block light from their fronts; of a closed solid
/// that is enough, a sheet is listed twice, turned. From a point the shadow of
/// an occluder is what lies in its cone and beyond its plane; it is cut out of the receiver exactly, and what is left has a
/// closed form (Lambert 1760). Over the emitter: nested adaptive Gauss-Kronrod; the inner integral is split wherever the
/// view from the emitter passes an edge and a corner in one line, which is where it is not smooth.
/// Vertices counter-clockwise seen from the front. What lies behind the plane of the other polygon does not
/// count. Occluders in the plane of either polygon are left out.
/// At most 12 corners (std::length_error). tolerance: of the form factor, dimensionless. Good to 1e-9 where the polygons do not touch.
OccludedFormFactor occluded_form_factor(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to,
                                        std::span<const std::vector<glm::dvec3>> occluders, double tolerance = 1e-8);

/// The same from a point.
double occluded_form_factor(const glm::dvec3& point, const glm::dvec3& normal, std::span<const glm::dvec3> to,
                            std::span<const std::vector<glm::dvec3>> occluders);

}  // namespace naturel::reference
