#include "tests/reference/light_paths.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/glazing.h"

namespace naturel::tests {
namespace {

using glm::dvec3;

// A surface nearer than this, as a share of the way to the target or in metres, is the one that the point lies on.
constexpr double own_surface = 1e-8;

// Where origin + t direction crosses a facet, in either direction; nothing where it does not.
std::optional<double> crossing(const Facet& facet, const dvec3& origin_m, const dvec3& direction) {
    const double slope = glm::dot(facet.normal, direction);
    if (slope == 0.0) return std::nullopt;
    const double t = glm::dot(facet.normal, facet.vertices_m[0] - origin_m) / slope;
    if (t <= own_surface) return std::nullopt;
    const dvec3 point_m = origin_m + t * direction;
    for (std::size_t k = 0; k < facet.vertices_m.size(); ++k) {
        const dvec3 &a = facet.vertices_m[k], &b = facet.vertices_m[(k + 1) % facet.vertices_m.size()];
        if (glm::dot(glm::cross(b - a, point_m - a), facet.normal) < 0.0) return std::nullopt;
    }
    return t;
}

}  // namespace

double uniform(std::mt19937_64& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

dvec3 point_in(const Facet& facet, std::mt19937_64& random) {
    // A triangle of the fan, chosen by area.
    const auto twice_area = [&](std::size_t k) {
        return glm::length(glm::cross(facet.vertices_m[k] - facet.vertices_m[0], facet.vertices_m[k + 1] - facet.vertices_m[0]));
    };
    double left = uniform(random, 0.0, 2.0 * facet.area_m2);
    std::size_t k = 1;
    while (k + 2 < facet.vertices_m.size() && left > twice_area(k)) left -= twice_area(k++);
    double a = uniform(random, 0.0, 1.0), b = uniform(random, 0.0, 1.0);
    if (a + b > 1.0) a = 1.0 - a, b = 1.0 - b;
    return (1.0 - a - b) * facet.vertices_m[0] + a * facet.vertices_m[k] + b * facet.vertices_m[k + 1];
}

SunPath path_to_sun(const Scene& scene, const Building& building, const Face& face, const dvec3& point_m, const dvec3& to_sun) {
    if (glm::dot(face.normal, to_sun) <= 0.0) return {};
    for (const Facet& facet : building.facets)
        if (!facet.is_aperture && crossing(facet, point_m, to_sun)) return {};
    SunPath path;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < building.apertures.size(); ++a) {
        const Aperture& aperture = building.apertures[a];
        for (const FacetId part : aperture.facets) {
            const auto t = crossing(building.facets[index(part)], point_m, to_sun);
            if (!t) continue;
            const double cosine = glm::dot(aperture.normal, to_sun);
            path.transmittance = path.transmittance *
                                 GlazingTransmission(scene.glazings[index(aperture.glazing)]).transmittance(std::abs(cosine));
            if (!aperture.inner && cosine < 0.0 && *t < nearest) nearest = *t, path.exit = make_id<ApertureId>(a);
            break;
        }
    }
    return path.exit ? path : SunPath{};
}

bool sees(const Building& building, const Face& face, const dvec3& point_m, const Aperture& aperture, const dvec3& aperture_point_m) {
    const dvec3 ray = aperture_point_m - point_m;
    if (glm::dot(face.normal, ray) <= 0.0 || glm::dot(aperture.normal, ray) >= 0.0) return false;
    return std::none_of(building.facets.begin(), building.facets.end(), [&](const Facet& facet) {
        if (facet.is_aperture) return false;
        const auto t = crossing(facet, point_m, ray);
        return t && *t < 1.0 - own_surface;
    });
}

}  // namespace naturel::tests
