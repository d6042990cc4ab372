#pragma once
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/glazing.h"
#include "core/outdoors.h"

namespace naturel {

/// An aperture as rays from indoors meet it.
struct Opening {
    struct Part {
        std::vector<glm::dvec3> vertices_m;    ///< convex, counter-clockwise seen from the room
        std::vector<glm::dvec3> edge_inwards;  ///< unit, in the plane, across the edge from vertex k to k + 1
    };

    bool inner = false;
    glm::dvec3 normal{};     ///< unit, into the room
    double offset_m = 0.0;   ///< of the plane: dot(normal, x) = offset_m
    glm::dvec3 centre_m{};   ///< with `radius_m`, a sphere around all parts
    double radius_m = 0.0;
    std::vector<Part> parts;
    GlazingTransmission glazing;

    /// How far a point is in front of the plane, on the room's side.
    double height_m(const glm::dvec3& point_m) const;

    /// Distance at which a ray crosses the aperture, from either side.
    std::optional<double> crossing_m(const glm::dvec3& from_m, const glm::dvec3& direction) const;
};

/// Luminance that reaches a point indoors along one ray through an exterior aperture, cd/m2.
struct IncomingLight {
    Band3 sky;              ///< straight from the sky
    LightBySource outdoor;  ///< from the ground or an outdoor facet

    // Two rays with the same origin bring light that differs smoothly; between others there is an edge.
    FacetId seen = FacetId::none;
    double source_luminance = 0.0;  ///< mean of the bands before glazing; 0: blocked, or counted at another aperture
    int apertures_crossed = 0;

    /// Mean of the bands: what the errors of numerical integration are measured with.
    double mean() const;
};

/// What comes in through the apertures of a building along given rays. Refers to its arguments: keep them alive.
class ApertureLight {
public:
    ApertureLight(const Scene& scene, const Building& building, const PatchGrid& grid, const OutdoorLight& outdoors);

    std::span<const Opening> openings() const { return openings_; }  ///< in the order of Building::apertures
    const OutdoorLight& outdoors() const { return outdoors_; }

    /// Light along a ray that leaves through the exterior aperture `through` and on which first_seen() said `seen`.
    /// It counts at the first exterior aperture it crosses, and is zero at any further one, so that nothing counts
    /// twice; every aperture it crosses takes its share, indoors and outdoors, up to the opaque facet it meets.
    IncomingLight along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen, std::size_t through) const;

    /// Illuminance from the sun, lx. Asks for visibility only where the ray to the sun leaves through an aperture.
    Band3 sun_lx(const GatherPoint& point, const Visibility& visibility) const;

private:
    const Building& building_;
    const PatchGrid& grid_;
    const OutdoorLight& outdoors_;
    std::vector<Opening> openings_;
};

}  // namespace naturel
