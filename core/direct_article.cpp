#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/direct_integrators.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

// Solid angles of an aperture at which the article goes from 16 to 64 and from 64 to 256 aperture elements.
constexpr double limit_16_sr = 0.7;
constexpr double limit_64_sr = 1.5;

/// An aperture nearer than this many element sizes is integrated over sky zones instead. The article does not say
/// when it changes over; solid angle cannot tell, since it falls again close to the plane of the aperture, where the
/// elements fail (docs/method.md, "Direct illuminance").
constexpr double near_sizes = 2.0;

/// The article's sky zones: "256 zones seen under the same solid angle (0,00237 sr)". 256 equal zones of a hemisphere
/// are 2 pi / 256 = 0.0245 sr each, which is what we take: 16 bands uniform in sin(altitude) x 16 azimuths.
constexpr int zone_bands = 16;
constexpr int zone_azimuths = 16;
constexpr double zone_sr = 2.0 * pi / (zone_bands * zone_azimuths);

using ApertureElement = ArticleElements::ApertureElement;
using Division = ArticleElements::Division;

/// What an aperture is divided along: the parallelogram with the directions of its face's frame that just encloses the
/// opening, or the opening itself when it is a triangle.
struct Outline {
    glm::dvec3 origin_m{}, u_m{}, v_m{};
    bool triangle = false;
};

Outline outline_of(const Face& face) {
    if (face.region.size() == 1 && face.region[0].size() == 3) {
        const Ring& ring = face.region[0];
        const glm::dvec3 origin = face.plane.to_world(ring[0]);
        return {origin, face.plane.to_world(ring[1]) - origin, face.plane.to_world(ring[2]) - origin, true};
    }
    const glm::dvec3 across_v = glm::cross(face.frame.v_m, face.normal);
    const glm::dvec3 across_u = glm::cross(face.frame.u_m, face.normal);
    const glm::dvec3 to_s = across_v / glm::dot(across_v, face.frame.u_m);
    const glm::dvec3 to_t = across_u / glm::dot(across_u, face.frame.v_m);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    double s0 = infinity, s1 = -infinity, t0 = infinity, t1 = -infinity;
    for (const Ring& ring : face.region) {
        for (const PlanePoint& vertex : ring) {
            const glm::dvec3 point = face.plane.to_world(vertex) - face.frame.origin_m;
            const double s = glm::dot(to_s, point), t = glm::dot(to_t, point);
            s0 = std::min(s0, s), s1 = std::max(s1, s);
            t0 = std::min(t0, t), t1 = std::max(t1, t);
        }
    }
    return {face.frame.origin_m + s0 * face.frame.u_m + t0 * face.frame.v_m, (s1 - s0) * face.frame.u_m,
            (t1 - t0) * face.frame.v_m, false};
}

/// Centroid and area of a region; holes count negative.
ApertureElement element_of(const Region& region, const PlaneFrame& plane) {
    const PlanePoint reference = region[0][0];
    double twice_area = 0.0, x = 0.0, y = 0.0;  // nm from the reference: small numbers, so that differences stay exact
    for (const Ring& ring : region) {
        for (std::size_t k = 0; k < ring.size(); ++k) {
            const PlanePoint& p = ring[k];
            const PlanePoint& q = ring[(k + 1) % ring.size()];
            const double px = static_cast<double>(p.X - reference.X), py = static_cast<double>(p.Y - reference.Y);
            const double qx = static_cast<double>(q.X - reference.X), qy = static_cast<double>(q.Y - reference.Y);
            const double cross = px * qy - qx * py;
            twice_area += cross;
            x += cross * (px + qx) / 3.0;
            y += cross * (py + qy) / 3.0;
        }
    }
    const double metres = 1.0 / nanometres_per_metre;
    return {plane.to_world(reference) + metres / twice_area * (x * plane.x + y * plane.y),
            0.5 * twice_area * metres * metres};
}

/// n^2 triangles similar to the whole.
void divide_triangle(const Outline& outline, int n, Division& division) {
    const double area = 0.5 * glm::length(glm::cross(outline.u_m, outline.v_m)) / (n * n);
    const auto add = [&](double s, double t) {
        division.elements.push_back({outline.origin_m + (s / n) * outline.u_m + (t / n) * outline.v_m, area});
    };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i + j < n; ++i) {
            add(i + 1.0 / 3.0, j + 1.0 / 3.0);
            if (i + j + 1 < n) add(i + 2.0 / 3.0, j + 2.0 / 3.0);
        }
    }
}

/// The cells of an n x n grid, cut by what is left of the face.
void divide_parallelogram(const Outline& outline, const Face& face, int n, Division& division) {
    const auto corner = [&](int i, int j) {
        return face.plane.to_plane(outline.origin_m + (static_cast<double>(i) / n) * outline.u_m +
                                   (static_cast<double>(j) / n) * outline.v_m);
    };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            const Region cell{{corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)}};
            const Region left = without_slivers(intersect(face.region, cell));
            if (!left.empty()) division.elements.push_back(element_of(left, face.plane));
        }
    }
}

double distance_to_edge_m(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& point_m) {
    const glm::dvec3 edge = b - a;
    const double share = std::clamp(glm::dot(point_m - a, edge) / glm::dot(edge, edge), 0.0, 1.0);
    return glm::length(a + share * edge - point_m);
}

double distance_m(const Opening& opening, const glm::dvec3& point_m) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Opening::Part& part : opening.parts) {
        bool above_part = true;
        for (std::size_t k = 0; k < part.vertices_m.size(); ++k) {
            const glm::dvec3& a = part.vertices_m[k];
            const glm::dvec3& b = part.vertices_m[(k + 1) % part.vertices_m.size()];
            above_part = above_part && glm::dot(part.edge_inwards[k], point_m - a) >= 0.0;
            nearest = std::min(nearest, distance_to_edge_m(a, b, point_m));
        }
        if (above_part) nearest = std::min(nearest, opening.height_m(point_m));
    }
    return nearest;
}

/// Solid angle of what is in front of the point.
double seen_solid_angle(const Opening& opening, const GatherPoint& point, ArticleScratch& scratch) {
    double sum = 0.0;
    for (const Opening::Part& part : opening.parts) {
        scratch.polygon.clear();
        for (const glm::dvec3& vertex : part.vertices_m) scratch.polygon.push_back(vertex - point.position_m);
        keep_half_space(scratch.polygon, point.normal, scratch.clipped);
        sum += solid_angle(scratch.clipped);
    }
    return sum;
}

void add_elements(const Division& division, std::size_t aperture, const Opening& opening, const GatherPoint& point,
                  ArticleScratch& scratch) {
    for (const ApertureElement& element : division.elements) {
        const glm::dvec3 to_element = element.centre_m - point.position_m;
        const double squared = glm::dot(to_element, to_element);
        const glm::dvec3 direction = to_element / std::sqrt(squared);
        const double cos_point = glm::dot(point.normal, direction);
        if (cos_point <= 0.0) continue;
        const double solid_angle_sr = element.area_m2 * -glm::dot(opening.normal, direction) / squared;
        scratch.rays.push_back({cos_point * solid_angle_sr, aperture});
        scratch.directions.push_back(direction);
    }
}

/// 256 zones of the sky and, mirrored, 256 of the ground: those that are seen through the aperture.
void add_zones(std::size_t aperture, const Opening& opening, const GatherPoint& point, ArticleScratch& scratch) {
    for (int band = -zone_bands; band < zone_bands; ++band) {
        const double sin_altitude = (band + 0.5) / zone_bands;
        const double cos_altitude = std::sqrt(1.0 - sin_altitude * sin_altitude);
        for (int k = 0; k < zone_azimuths; ++k) {
            const double azimuth = 2.0 * pi * (k + 0.5) / zone_azimuths;
            const glm::dvec3 direction{cos_altitude * std::sin(azimuth), cos_altitude * std::cos(azimuth),
                                       sin_altitude};
            const double cos_point = glm::dot(point.normal, direction);
            if (cos_point <= 0.0 || !opening.crossing_m(point.position_m, direction)) continue;
            scratch.rays.push_back({cos_point * zone_sr, aperture});
            scratch.directions.push_back(direction);
        }
    }
}

}  // namespace

ArticleElements::ArticleElements(const Building& building) {
    divisions_.resize(building.apertures.size());
    for (std::size_t a = 0; a < building.apertures.size(); ++a) {
        if (building.apertures[a].inner) continue;
        const Face& face = building.faces[index(building.apertures[a].face)];
        const Outline outline = outline_of(face);
        for (std::size_t k = 0; k < counts_per_side.size(); ++k) {
            const int n = counts_per_side[k];
            Division& division = divisions_[a][k];
            division.size_m = std::max(glm::length(outline.u_m), glm::length(outline.v_m)) / n;
            if (outline.triangle) {
                divide_triangle(outline, n, division);
            } else {
                divide_parallelogram(outline, face, n, division);
            }
        }
    }
}

SkyAndOutdoors integrate_article(const GatherPoint& point, const ApertureLight& light, const ArticleElements& elements,
                                 const ArticleRule& rule, const Visibility& visibility, ArticleScratch& scratch) {
    scratch.rays.clear();
    scratch.directions.clear();
    for (std::size_t a = 0; a < light.openings().size(); ++a) {
        const Opening& opening = light.openings()[a];
        if (opening.inner || opening.height_m(point.position_m) <= 0.0) continue;
        const double seen_sr = seen_solid_angle(opening, point, scratch);
        if (seen_sr <= 0.0) continue;
        const std::size_t fineness = !rule.count_by_solid_angle || seen_sr > limit_64_sr ? 2 : seen_sr > limit_16_sr ? 1 : 0;
        const Division& division = elements.division(a, fineness);
        if (rule.near_zones && distance_m(opening, point.position_m) < near_sizes * division.size_m) {
            add_zones(a, opening, point, scratch);
        } else {
            add_elements(division, a, opening, point, scratch);
        }
    }
    if (scratch.rays.empty()) return {};
    scratch.seen.resize(scratch.rays.size());
    visibility.first_seen(point, scratch.directions, scratch.seen);

    SkyAndOutdoors sum;
    for (std::size_t k = 0; k < scratch.rays.size(); ++k) {
        const ArticleScratch::Ray& ray = scratch.rays[k];
        sum.add(ray.projected_solid_angle_sr,
                light.along(point.position_m, scratch.directions[k], scratch.seen[k], ray.aperture));
    }
    return sum;
}

}  // namespace naturel
