#pragma once
#include <glm/vec3.hpp>

#include "core/outdoors.h"
#include "core/view_pieces.h"

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

/// What light meets on its way to a point, whatever shines.
class Outlook {
public:
    Outlook() = default;
    Outlook(const Outlook&) = default;
    virtual ~Outlook() = default;

    /// Cuts a view along the outlines of what changes the light of a ray without stopping it.
    /// through: exterior aperture by which the rays leave.
    virtual void cut_further(const glm::dvec3& from_m, std::size_t through, ViewPieces& pieces) const = 0;

    /// True where no light can come from. seen: of first_seen().
    virtual bool is_dark(const glm::dvec3& direction, FacetId seen) const = 0;
};

/// Light as a function of direction and of what first_seen() said there: what integrate_adaptively() integrates.
class DirectionalLight {
public:
    DirectionalLight() = default;
    DirectionalLight(const DirectionalLight&) = default;
    virtual ~DirectionalLight() = default;

    virtual const Outlook& outlook() const = 0;

    /// through: exterior aperture by which the ray leaves. Where one thing is seen, it differs smoothly but for the edges that
    /// the outlook cuts along.
    virtual IncomingLight along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                                std::size_t through) const = 0;

    virtual const OutdoorLight& outdoors() const = 0;
};

/// From a point in the open air; `through` is without meaning.
class OpenAir final : public Outlook {
public:
    explicit OpenAir(const Building& building) : building_(building) {}
    void cut_further(const glm::dvec3&, std::size_t, ViewPieces&) const override {}
    bool is_dark(const glm::dvec3& direction, FacetId seen) const override {
        return outdoor_source(building_, direction, seen) == OutdoorSource::dark;
    }

private:
    const Building& building_;
};

/// What a point in the open air sees; `through` is without meaning. Refers to its arguments: keep them alive.
class OpenAirLight final : public DirectionalLight {
public:
    OpenAirLight(const OutdoorLight& light, const Building& building, const PatchGrid& grid)
        : light_(light), building_(building), grid_(grid), outlook_(building) {}

    IncomingLight along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen, std::size_t) const override {
        const OutdoorSource source = outdoor_source(building_, direction, seen);
        const LightBySource luminance = outdoor_luminance(light_, building_, grid_, from_m, direction, seen);
        if (source == OutdoorSource::sky) return {.sky = luminance.sky};
        return {.outdoor = luminance, .from_ground = source == OutdoorSource::ground};
    }
    const Outlook& outlook() const override { return outlook_; }
    const OutdoorLight& outdoors() const override { return light_; }

private:
    const OutdoorLight& light_;
    const Building& building_;
    const PatchGrid& grid_;
    OpenAir outlook_;
};

}  // namespace naturel
