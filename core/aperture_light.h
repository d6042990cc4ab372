#pragma once
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/directional_light.h"
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

/// The apertures of a building as rays from indoors cross them. Refers to the building: keep it alive.
class ApertureOutlook final : public Outlook {
public:
    ApertureOutlook(const Scene& scene, const Building& building);

    std::span<const Opening> openings() const { return openings_; }  ///< in the order of Building::apertures

    /// What is left of light along a ray that leaves through the exterior aperture `through` and on which first_seen() said `seen`.
    /// It counts at the first exterior aperture it crosses, and is zero at any further one, so that nothing counts
    /// twice; every aperture it crosses takes its share, indoors and outdoors, up to the opaque facet it meets.
    Band3 transmittance(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen, std::size_t through) const;

    /// Along the outlines of the other apertures that rays through this one may cross.
    void cut_further(const glm::dvec3& from_m, std::size_t through, ViewPieces& pieces) const override;
    bool is_dark(const glm::dvec3& direction, FacetId seen) const override;

    /// Of the sun, as far as apertures are concerned: nothing where the ray to it does not leave through an exterior one.
    std::optional<Band3> transmittance_to_sky(const glm::dvec3& from_m, const glm::dvec3& direction) const;

private:
    const Building& building_;
    std::vector<Opening> openings_;
    /// [openings] those that a ray out through this one can cross, too: not its neighbours in one wall.
    std::vector<std::vector<std::size_t>> companions_;
};

/// What comes in through the apertures of a building along given rays. Refers to its arguments: keep them alive.
class ApertureLight final : public DirectionalLight {
public:
    ApertureLight(const Scene& scene, const Building& building, const PatchGrid& grid, const OutdoorLight& outdoors);

    std::span<const Opening> openings() const { return outlook_.openings(); }
    const ApertureOutlook& outlook() const override { return outlook_; }
    const OutdoorLight& outdoors() const override { return outdoors_; }

    IncomingLight along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                        std::size_t through) const override;

    /// Illuminance from the sun, lx. Asks for visibility only where the ray to the sun leaves through an aperture.
    Band3 sun_lx(const GatherPoint& point, const Visibility& visibility) const;

private:
    const Building& building_;
    const PatchGrid& grid_;
    const OutdoorLight& outdoors_;
    ApertureOutlook outlook_;
};

/// Illuminance of a point indoors from the sun alone, lx.
Band3 sun_through_apertures(const GatherPoint& point, const ApertureOutlook& apertures, const OutdoorLight& outdoors,
                            const Visibility& visibility);

}  // namespace naturel
