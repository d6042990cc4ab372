#pragma once
#include <memory>
#include <vector>

#include "core/outdoors.h"
#include "core/visibility.h"

namespace naturel {

/// Direct illuminance of a point indoors, by origin, before any reflection inside.
struct DirectIlluminance {
    Band3 sky_lx{};             ///< sky component
    Band3 sun_lx{};             ///< straight from the sun
    LightBySource outdoor_lx{}; ///< externally reflected component (ERC): ground and outdoor facets
    LightBySource ground_lx{};  ///< the ground's part of it

    LightBySource by_source() const { return {sky_lx + outdoor_lx.sky, sun_lx + outdoor_lx.other}; }
};

/// Computes direct illuminance through the apertures of a building (docs/method.md, "Direct illuminance").
/// Refers to its arguments: keep them alive.
class DirectLight {
public:
    DirectLight(const Scene& scene, const Building& building, const PatchGrid& grid, const OutdoorLight& outdoors,
                const Visibility& visibility);
    ~DirectLight();

    /// Sky, sun and outdoor light. Thread-safe.
    DirectIlluminance at(const GatherPoint& point) const;

    /// The same but for the sun, where that is known from the zones of light.
    DirectIlluminance without_sun(const GatherPoint& point) const;

    /// The sun alone, at n points of one plane: for means over a patch.
    void sun_at(std::span<const glm::dvec3> positions_m, const glm::dvec3& normal, std::span<Band3> sun_lx) const;

private:
    struct Implementation;
    std::unique_ptr<const Implementation> implementation_;
};

}  // namespace naturel
