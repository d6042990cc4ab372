#include "core/aperture_light.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {
namespace {

/// Coordinates are rounded to 1 nm when facets are made (core/planar_region.h): rays this close to an edge are
/// inside, so that none slips between two convex parts.
constexpr double edge_slack_m = 2e-9;

Opening make_opening(const Scene& scene, const Building& building, const Aperture& aperture) {
    Opening opening{.inner = aperture.inner,
                    .normal = aperture.normal,
                    .centre_m = aperture.centroid_m,
                    .parts = {},
                    .glazing = GlazingTransmission(scene.glazings[index(aperture.glazing)])};
    for (const FacetId id : aperture.facets) {
        const std::vector<glm::dvec3>& vertices = building.facets[index(id)].vertices_m;
        Opening::Part part{vertices, {}};
        for (std::size_t k = 0; k < vertices.size(); ++k) {
            const glm::dvec3 edge = vertices[(k + 1) % vertices.size()] - vertices[k];
            part.edge_inwards.push_back(glm::normalize(glm::cross(opening.normal, edge)));
            opening.radius_m = std::max(opening.radius_m, glm::length(vertices[k] - opening.centre_m));
        }
        opening.parts.push_back(std::move(part));
    }
    opening.offset_m = glm::dot(opening.normal, opening.parts.front().vertices_m.front());
    return opening;
}

bool covers(const Opening::Part& part, const glm::dvec3& point_m) {
    for (std::size_t k = 0; k < part.vertices_m.size(); ++k) {
        if (glm::dot(part.edge_inwards[k], point_m - part.vertices_m[k]) < -edge_slack_m) return false;
    }
    return true;
}

/// Whether any of an opening lies on the outer side of another's plane.
bool reaches_behind(const Opening& opening, const Opening& plane) {
    for (const Opening::Part& part : opening.parts) {
        for (const glm::dvec3& vertex : part.vertices_m) {
            if (plane.height_m(vertex) < -edge_slack_m) return true;
        }
    }
    return false;
}

double distance_to_plane_m(const Facet& facet, const glm::dvec3& from_m, const glm::dvec3& direction) {
    return glm::dot(facet.normal, facet.vertices_m.front() - from_m) / glm::dot(facet.normal, direction);
}

}  // namespace

double Opening::height_m(const glm::dvec3& point_m) const { return glm::dot(normal, point_m) - offset_m; }

std::optional<double> Opening::crossing_m(const glm::dvec3& from_m, const glm::dvec3& direction) const {
    const glm::dvec3 to_centre = centre_m - from_m;
    const double along = glm::dot(to_centre, direction);
    if (along < -radius_m || glm::dot(to_centre, to_centre) - along * along > radius_m * radius_m) return {};
    const double slope = glm::dot(normal, direction);
    if (slope == 0.0) return {};
    const double distance = -height_m(from_m) / slope;
    if (!(distance > 0.0)) return {};
    const glm::dvec3 point = from_m + distance * direction;
    if (std::none_of(parts.begin(), parts.end(), [&](const Part& part) { return covers(part, point); })) return {};
    return distance;
}

ApertureOutlook::ApertureOutlook(const Scene& scene, const Building& building) : building_(building) {
    openings_.reserve(building.apertures.size());
    for (const Aperture& aperture : building.apertures) {
        openings_.push_back(make_opening(scene, building, aperture));
    }
    // A ray through both crosses one of them behind the plane of the other. An inner one may be crossed either way.
    companions_.resize(openings_.size());
    for (std::size_t a = 0; a < openings_.size(); ++a) {
        for (std::size_t b = 0; b < openings_.size(); ++b) {
            if (a == b) continue;
            if (openings_[b].inner || reaches_behind(openings_[a], openings_[b]) || reaches_behind(openings_[b], openings_[a])) {
                companions_[a].push_back(b);
            }
        }
    }
}

Band3 ApertureOutlook::transmittance(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen, std::size_t through) const {
    const Opening& own = openings_[through];
    Band3 of_others = grey(1.0);
    if (!companions_[through].empty()) {
        const double own_distance = -own.height_m(from_m) / glm::dot(own.normal, direction);
        const double end = seen == FacetId::none
                               ? std::numeric_limits<double>::infinity()
                               : distance_to_plane_m(building_.facets[index(seen)], from_m, direction);
        for (const std::size_t k : companions_[through]) {
            const Opening& other = openings_[k];
            const auto distance = other.crossing_m(from_m, direction);
            if (!distance || *distance >= end) continue;
            if (!other.inner && (*distance < own_distance || (*distance == own_distance && k < through))) return {};
            const double slope = std::abs(glm::dot(other.normal, direction));
            of_others = of_others * other.glazing.transmittance(std::min(1.0, slope));
        }
    }
    return own.glazing.transmittance(std::min(1.0, std::abs(glm::dot(own.normal, direction)))) * of_others;
}

void ApertureOutlook::cut_further(const glm::dvec3& from_m, std::size_t through, ViewPieces& pieces) const {
    for (const std::size_t k : companions_[through]) {
        for (const Opening::Part& part : openings_[k].parts) pieces.cut_along(from_m, part.vertices_m);
    }
}

bool ApertureOutlook::is_dark(const glm::dvec3& direction, FacetId seen) const {
    return outdoor_source(building_, direction, seen) == OutdoorSource::dark;
}

std::optional<Band3> ApertureOutlook::transmittance_to_sky(const glm::dvec3& from_m, const glm::dvec3& direction) const {
    Band3 transmittance = grey(1.0);
    bool leaves = false;
    for (const Opening& opening : openings_) {
        if (!opening.crossing_m(from_m, direction)) continue;
        const double slope = glm::dot(opening.normal, direction);
        transmittance = transmittance * opening.glazing.transmittance(std::min(1.0, std::abs(slope)));
        leaves = leaves || (!opening.inner && slope < 0.0);
    }
    if (!leaves) return {};
    return transmittance;
}

ApertureLight::ApertureLight(const Scene& scene, const Building& building, const PatchGrid& grid,
                             const OutdoorLight& outdoors)
    : building_(building), grid_(grid), outdoors_(outdoors), outlook_(scene, building) {}

IncomingLight ApertureLight::along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                                   std::size_t through) const {
    const OutdoorSource source = outdoor_source(building_, direction, seen);
    if (source == OutdoorSource::dark) return {};
    const Band3 transmittance = outlook_.transmittance(from_m, direction, seen, through);
    if (largest(transmittance) <= 0.0) return {};
    const LightBySource luminance = outdoor_luminance(outdoors_, building_, grid_, from_m, direction, seen);
    if (source == OutdoorSource::sky) return {.sky = transmittance * luminance.sky};
    return {.outdoor = transmittance * luminance, .from_ground = source == OutdoorSource::ground};
}

Band3 ApertureLight::sun_lx(const GatherPoint& point, const Visibility& visibility) const {
    return sun_through_apertures(point, outlook_, outdoors_, visibility);
}

Band3 sun_through_apertures(const GatherPoint& point, const ApertureOutlook& apertures, const OutdoorLight& outdoors,
                            const Visibility& visibility) {
    const glm::dvec3& sun = outdoors.sun_direction;
    const double cos_incidence = glm::dot(point.normal, sun);
    if (outdoors.direct_normal_illuminance_lx <= 0.0 || cos_incidence <= 0.0) return {};
    const std::optional<Band3> transmittance = apertures.transmittance_to_sky(point.position_m, sun);
    if (!transmittance) return {};
    FacetId seen{};
    visibility.first_seen(point, {&sun, 1}, {&seen, 1});
    if (seen != FacetId::none) return {};
    return (outdoors.direct_normal_illuminance_lx * cos_incidence) * (outdoors.sun_colour * *transmittance);
}

}  // namespace naturel
