#include "core/sunspot.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/plane_bounds.h"

namespace naturel {

namespace {

using glm::dvec3;

// A face that the sun grazes at less than this sine gets no sun worth a zone: 0.1 lx of 100 000 lx.
constexpr double smallest_cosine = 1e-6;

// Nearer than this to the plane of the face, a polygon lies in it and throws no shadow on it.
constexpr double in_plane_m = 1e-7;

// A face's plane, onto which polygons in front of it are projected along the sun.
class SunProjection {
public:
    SunProjection(const Face& face, const dvec3& to_sun) : face_(face), to_sun_(to_sun), cosine_(glm::dot(face.normal, to_sun)) {}

    double cosine() const { return cosine_; }

    // The shadow of a convex polygon, as far as it is in front of the plane; empty when it throws none.
    Ring shadow(const std::vector<dvec3>& polygon_m) {
        heights_.clear();
        double highest = 0.0;
        for (const dvec3& v : polygon_m) {
            heights_.push_back(glm::dot(v - face_.plane.origin_m, face_.normal));
            highest = std::max(highest, heights_.back());
        }
        Ring ring;
        if (highest < in_plane_m) return ring;
        const std::size_t n = polygon_m.size();
        for (std::size_t i = 0; i < n; ++i) {
            const std::size_t j = (i + 1) % n;
            if (heights_[i] >= 0.0) ring.push_back(project(polygon_m[i], heights_[i]));
            if ((heights_[i] < 0.0) != (heights_[j] < 0.0)) {
                const double t = heights_[i] / (heights_[i] - heights_[j]);
                ring.push_back(project(polygon_m[i] + t * (polygon_m[j] - polygon_m[i]), 0.0));
            }
        }
        if (ring.size() < 3) return {};
        if (!ClipperLib::Orientation(ring)) ClipperLib::ReversePath(ring);
        return ring;
    }

private:
    PlanePoint project(const dvec3& point_m, double height_m) const {
        return face_.plane.to_plane(point_m - height_m / cosine_ * to_sun_);
    }

    const Face& face_;
    dvec3 to_sun_;
    double cosine_;
    std::vector<double> heights_;
};

}  // namespace

SunspotFinder::SunspotFinder(const Scene& scene, const Building& building, const SunBeam& sun) : building_(building), sun_(sun) {
    for (const Aperture& aperture : building.apertures) glazings_.emplace_back(scene.glazings[index(aperture.glazing)]);
    for (std::size_t f = 0; f < building.facets.size(); ++f) {
        const Facet& facet = building.facets[f];
        const double cosine = glm::dot(facet.normal, sun.direction);
        if (!facet.is_aperture && (cosine < 0.0 || (cosine > 0.0 && building.faces[index(facet.face)].sheet)))
            blockers_.push_back(make_id<FacetId>(f));
    }
}

std::vector<Sunspot> SunspotFinder::on_face(FaceId id) const {
    const Face& face = building_.faces[index(id)];
    SunProjection projection(face, sun_.direction);
    if (face.environment == Environment::outdoor || face.aperture || projection.cosine() < smallest_cosine || face.region.empty())
        return {};

    // Apertures as the face sees them along the sun.
    struct Opening {
        std::size_t aperture;
        Region region;
    };
    std::vector<Opening> openings;
    Region all;
    const PlaneBounds face_bounds(face.region);
    for (std::size_t a = 0; a < building_.apertures.size(); ++a) {
        Opening opening{a, {}};
        for (const FacetId part : building_.apertures[a].facets) {
            Ring ring = projection.shadow(building_.facets[index(part)].vertices_m);
            if (PlaneBounds(ring).touches(face_bounds)) opening.region.push_back(std::move(ring));
        }
        opening.region = intersect(opening.region, face.region);
        if (opening.region.empty()) continue;
        const bool leads_to_sun = glm::dot(building_.apertures[a].normal, sun_.direction) < 0.0;
        if (!building_.apertures[a].inner && leads_to_sun) all = unite(all, opening.region);
        openings.push_back(std::move(opening));
    }
    if (all.empty()) return {};

    // What stands between the face and the sun.
    Region shadows;
    const PlaneBounds lit_bounds(all);
    for (const FacetId blocker : blockers_) {
        const Facet& facet = building_.facets[index(blocker)];
        if (facet.face == id) continue;
        Ring ring = projection.shadow(facet.vertices_m);
        if (PlaneBounds(ring).touches(lit_bounds)) shadows.push_back(std::move(ring));
    }
    const Region lit = without_slivers(subtract(all, shadows));

    // Each part of what is left by the apertures that its ray crosses; it counts as coming through the first of them that
    // leads outdoors.
    struct Beam {
        Region region;
        Band3 transmittance = grey(1.0);
        double exit_m = std::numeric_limits<double>::infinity();
        std::size_t exit = 0;
    };
    std::vector<Beam> beams{{lit}};
    for (const Opening& opening : openings) {
        const Aperture& aperture = building_.apertures[opening.aperture];
        const double incidence = glm::dot(aperture.normal, sun_.direction);
        std::vector<Beam> split;
        for (Beam& beam : beams) {
            Region through = without_slivers(intersect(beam.region, opening.region));
            if (through.empty()) {
                split.push_back(std::move(beam));
                continue;
            }
            Beam rest = beam;
            rest.region = without_slivers(subtract(beam.region, opening.region));
            Beam crossing{std::move(through), beam.transmittance * glazings_[opening.aperture].transmittance(std::abs(incidence)),
                          beam.exit_m, beam.exit};
            if (!aperture.inner && incidence < 0.0) {
                const dvec3 start = face.plane.to_world(crossing.region[0][0]);
                const double distance_m = glm::dot(aperture.centroid_m - start, aperture.normal) / incidence;
                if (distance_m < crossing.exit_m) crossing.exit_m = distance_m, crossing.exit = opening.aperture;
            }
            split.push_back(std::move(crossing));
            if (!rest.region.empty()) split.push_back(std::move(rest));
        }
        beams = std::move(split);
    }
    std::vector<Sunspot> spots;
    for (Beam& beam : beams) {
        if (beam.region.empty() || beam.exit_m == std::numeric_limits<double>::infinity()) continue;
        spots.push_back({.face = id,
                         .aperture = make_id<ApertureId>(beam.exit),
                         .region = std::move(beam.region),
                         .transmittance = beam.transmittance,
                         .illuminance_lx = sun_.direct_normal_illuminance_lx * projection.cosine() * (sun_.colour * beam.transmittance)});
    }
    return spots;
}

}  // namespace naturel
