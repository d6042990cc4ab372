#pragma once
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "core/sky_description.h"

namespace naturel {

/// How the luminance of a sky is distributed, on a scale of its own. Const and thread-safe.
class SkyShape {
public:
    SkyShape() = default;
    SkyShape(const SkyShape&) = delete;
    SkyShape& operator=(const SkyShape&) = delete;
    virtual ~SkyShape() = default;

    /// direction: unit, z >= 0.
    virtual double luminance(const glm::dvec3& direction) const = 0;

    /// Integral of luminance x sin(altitude) over the sky: what the ground gets on the same scale.
    virtual double horizontal() const = 0;

    /// False if the luminance jumps.
    virtual bool is_smooth() const { return true; }
};

// One maker per model, each in the file of its name. sun: unit, towards the sun.
std::unique_ptr<SkyShape> make_uniform_sky(const SkyDescription&, const glm::dvec3& sun);       // sky_overcast.cpp
std::unique_ptr<SkyShape> make_moon_spencer_sky(const SkyDescription&, const glm::dvec3& sun);  // sky_overcast.cpp
std::unique_ptr<SkyShape> make_clear_sky(const SkyDescription&, const glm::dvec3& sun);         // sky_clear.cpp
std::unique_ptr<SkyShape> make_intermediate_sky(const SkyDescription&, const glm::dvec3& sun);  // sky_intermediate.cpp
std::unique_ptr<SkyShape> make_cie_general_sky(const SkyDescription&, const glm::dvec3& sun);   // sky_cie_general.cpp
/// In cd/m2.
std::unique_ptr<SkyShape> make_perez_sky(const SkyDescription&, const glm::dvec3& sun);         // perez.cpp
std::unique_ptr<SkyShape> make_table_sky(const SkyDescription&, const glm::dvec3& sun);         // sky_table.cpp
std::unique_ptr<SkyShape> make_expression_sky(const SkyDescription&, const glm::dvec3& sun);    // sky_expression.cpp

}  // namespace naturel
