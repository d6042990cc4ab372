#pragma once
#include <cstdint>
#include <glm/vec3.hpp>

#include "core/outdoors.h"

namespace naturel {

/// Luminance that reaches a point along one ray, cd/m2.
struct IncomingLight {
    Band3 sky{};               ///< straight from the sky
    LightBySource outdoor{};   ///< from the ground or an outdoor facet
    bool from_ground = false;  ///< `outdoor` is the ground's

    /// Mean of the bands: what the errors of numerical integration are measured with.
    double mean() const {
        const Band3 all = sky + outdoor.total();
        return (all.r + all.g + all.b) / 3.0;
    }
};

/// Light as a function of direction and of what first_seen() said there: what integrate_adaptively() integrates.
class DirectionalLight {
public:
    DirectionalLight() = default;
    DirectionalLight(const DirectionalLight&) = default;
    virtual ~DirectionalLight() = default;

    /// Names what shines along a ray: 0 is the dark. Two rays with the same origin and the same source bring light that
    /// differs smoothly; between others there is an edge. through: exterior aperture by which the ray leaves.
    virtual std::uint32_t source_along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                                       std::size_t through) const = 0;

    virtual IncomingLight along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                                std::size_t through) const = 0;

    virtual const OutdoorLight& outdoors() const = 0;
};

/// Name of what an unobstructed ray shows; for DirectionalLight::source_along().
inline std::uint32_t source_id(const Building& building, const glm::dvec3& direction, FacetId seen) {
    switch (outdoor_source(building, direction, seen)) {
        case OutdoorSource::dark:
            return 0;
        case OutdoorSource::sky:
            return 1;
        case OutdoorSource::ground:
            return 2;
        case OutdoorSource::building:
            break;
    }
    return 3 + static_cast<std::uint32_t>(index(building.facets[index(seen)].face));
}

/// What a point in the open air sees; `through` is without meaning. Refers to its arguments: keep them alive.
class OpenAirLight final : public DirectionalLight {
public:
    OpenAirLight(const OutdoorLight& light, const Building& building, const PatchGrid& grid)
        : light_(light), building_(building), grid_(grid) {}

    std::uint32_t source_along(const glm::dvec3&, const glm::dvec3& direction, FacetId seen, std::size_t) const override {
        return source_id(building_, direction, seen);
    }
    IncomingLight along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen, std::size_t) const override {
        const OutdoorSource source = outdoor_source(building_, direction, seen);
        const LightBySource luminance = outdoor_luminance(light_, building_, grid_, from_m, direction, seen);
        if (source == OutdoorSource::sky) return {.sky = luminance.sky};
        return {.outdoor = luminance, .from_ground = source == OutdoorSource::ground};
    }
    const OutdoorLight& outdoors() const override { return light_; }

private:
    const OutdoorLight& light_;
    const Building& building_;
    const PatchGrid& grid_;
};

}  // namespace naturel
