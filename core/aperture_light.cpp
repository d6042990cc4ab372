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

double mean_of_bands(const Band3& band) { return (band.r + band.g + band.b) / 3.0; }

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

double IncomingLight::mean() const { return mean_of_bands(sky + outdoor.total()); }

ApertureLight::ApertureLight(const Scene& scene, const Building& building, const PatchGrid& grid,
                             const OutdoorLight& outdoors)
    : building_(building), grid_(grid), outdoors_(outdoors) {
    openings_.reserve(building.apertures.size());
    for (const Aperture& aperture : building.apertures) {
        openings_.push_back(make_opening(scene, building, aperture));
    }
}

IncomingLight ApertureLight::along(const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen,
                                   std::size_t through) const {
    IncomingLight light;
    light.seen = seen;
    bool is_sky = false;
    const LightBySource luminance =
        outdoor_luminance(outdoors_, building_, grid_, from_m, direction, seen, &is_sky);
    const double source_luminance = mean_of_bands(luminance.total());
    if (source_luminance == 0.0) return light;

    const Opening& own = openings_[through];
    const double own_slope = glm::dot(own.normal, direction);
    Band3 transmittance = own.glazing.transmittance(std::min(1.0, std::abs(own_slope)));
    int crossed = 1;
    if (openings_.size() > 1) {
        const double own_distance = -own.height_m(from_m) / own_slope;
        const double end = seen == FacetId::none
                               ? std::numeric_limits<double>::infinity()
                               : distance_to_plane_m(building_.facets[index(seen)], from_m, direction);
        for (std::size_t k = 0; k < openings_.size(); ++k) {
            const Opening& other = openings_[k];
            const auto distance = k == through ? std::nullopt : other.crossing_m(from_m, direction);
            if (!distance || *distance >= end) continue;
            if (!other.inner && (*distance < own_distance || (*distance == own_distance && k < through))) {
                return light;
            }
            const double slope = std::abs(glm::dot(other.normal, direction));
            transmittance = transmittance * other.glazing.transmittance(std::min(1.0, slope));
            ++crossed;
        }
    }
    light.source_luminance = source_luminance;
    light.apertures_crossed = crossed;
    if (is_sky) {
        light.sky = transmittance * luminance.sky;
    } else {
        light.outdoor = {transmittance * luminance.sky, transmittance * luminance.other};
    }
    return light;
}

Band3 ApertureLight::sun_lx(const GatherPoint& point, const Visibility& visibility) const {
    const glm::dvec3& sun = outdoors_.sun_direction;
    const double cos_incidence = glm::dot(point.normal, sun);
    if (outdoors_.direct_normal_illuminance_lx <= 0.0 || cos_incidence <= 0.0) return {};

    Band3 transmittance = grey(1.0);
    bool leaves = false;
    for (const Opening& opening : openings_) {
        if (!opening.crossing_m(point.position_m, sun)) continue;
        const double slope = glm::dot(opening.normal, sun);
        transmittance = transmittance * opening.glazing.transmittance(std::min(1.0, std::abs(slope)));
        leaves = leaves || (!opening.inner && slope < 0.0);
    }
    if (!leaves) return {};
    FacetId seen{};
    visibility.first_seen(point, {&sun, 1}, {&seen, 1});
    if (seen != FacetId::none) return {};
    return (outdoors_.direct_normal_illuminance_lx * cos_incidence) * (outdoors_.sun_colour * transmittance);
}

}  // namespace naturel
