#include "cli/storeys.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/polyhedra.h"

namespace naturel {
namespace {

using glm::dvec3;

// What people need to stand, and how far floors are apart at least.
constexpr double headroom_m = 1.9, standing_area_m2 = 2.0, storey_m = 2.0;

// Faces that differ by less in height make one level, and planes nearer than this are one.
constexpr double same_level_m = 0.01, same_plane_m = 1e-5;

bool is_level(const Face& face) {
    return face.environment == Environment::indoor && !face.aperture && face.normal.z > 1.0 - 1e-9;
}

dvec3 middle_of(const std::vector<dvec3>& polygon) {
    dvec3 sum{};
    for (const dvec3& v : polygon)
        sum += v;
    return sum / static_cast<double>(polygon.size());
}

/// How far it is from a point straight up to the next facet that looks down.
double clear_height_m(const Building& building, const dvec3& point_m) {
    double least_m = std::numeric_limits<double>::infinity();
    for (const Facet& facet : building.facets) {
        if (facet.normal.z > -1e-9) continue;
        const double height_m = glm::dot(facet.vertices_m[0] - point_m, facet.normal) / facet.normal.z;
        if (height_m < same_plane_m || height_m >= least_m) continue;
        const dvec3 above = point_m + dvec3{0, 0, height_m};
        bool inside = true;
        for (std::size_t k = 0; k < facet.vertices_m.size() && inside; ++k) {
            const dvec3& a = facet.vertices_m[k];
            const dvec3 edge = facet.vertices_m[(k + 1) % facet.vertices_m.size()] - a;
            inside = glm::dot(glm::cross(facet.normal, edge), above - a) >= 0.0;
        }
        if (inside) least_m = height_m;
    }
    return least_m;
}

struct Level {
    double z_m;
    double standing_m2;  // where people can stand
};

std::vector<Level> levels_of(const Building& building) {
    std::vector<Level> levels;
    for (const Facet& facet : building.facets) {
        if (facet.is_aperture || !is_level(building.faces[index(facet.face)])) continue;
        const dvec3 middle = middle_of(facet.vertices_m);
        levels.push_back({middle.z, clear_height_m(building, middle) >= headroom_m ? facet.area_m2 : 0.0});
    }
    std::ranges::sort(levels, {}, &Level::z_m);
    std::vector<Level> merged;
    for (const Level& level : levels) {
        if (merged.empty() || level.z_m > merged.back().z_m + same_level_m)
            merged.push_back(level);
        else
            merged.back().standing_m2 += level.standing_m2;
    }
    return merged;
}

struct Heights {
    double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
};

std::vector<Heights> face_heights(const Building& building) {
    std::vector<Heights> heights(building.faces.size());
    for (const Facet& facet : building.facets)
        for (const dvec3& v : facet.vertices_m) {
            Heights& h = heights[index(facet.face)];
            h.low_m = std::min(h.low_m, v.z);
            h.high_m = std::max(h.high_m, v.z);
        }
    return heights;
}

/// Walls that the section meets come first, as somebody sees them who turns to the right, from the south-west
/// corner of each room.
void order_walls(const Scene& scene, const Building& building, Storey& storey) {
    struct Trace {
        FaceId wall;
        dvec3 middle_m;
    };
    std::vector<Trace> traces;
    std::vector<char> is_wall(building.faces.size(), 0);
    for (const FaceId wall : storey.walls)
        is_wall[index(wall)] = 1;
    for (const Facet& facet : building.facets) {
        if (is_wall[index(facet.face)] == 0) continue;
        const std::vector<dvec3> ends = cut_at_height(facet.vertices_m, storey.cut_m);
        if (ends.size() == 2) traces.push_back({facet.face, 0.5 * (ends[0] + ends[1])});
    }

    std::vector<FaceId> ordered;
    const auto append = [&](FaceId wall) {
        if (is_wall[index(wall)] != 0) ordered.push_back(wall);
        is_wall[index(wall)] = 0;
    };
    const PlaneFrame plan = plan_frame(storey.cut_m);
    for (Ring ring : indoor_air_at_height(scene, storey.cut_m)) {
        std::ranges::reverse(ring);
        std::ranges::rotate(ring,
                            std::ranges::min_element(ring, [](const PlanePoint& a, const PlanePoint& b) {
                                return a.X != b.X ? a.X < b.X : a.Y < b.Y;
                            }));
        for (std::size_t k = 0; k < ring.size(); ++k) {
            const dvec3 a = plan.to_world(ring[k]), b = plan.to_world(ring[(k + 1) % ring.size()]);
            const double length_m = glm::distance(a, b);
            std::vector<std::pair<double, FaceId>> along;
            for (const Trace& trace : traces) {
                const double t_m = glm::dot(trace.middle_m - a, b - a) / length_m;
                const double off_m = glm::distance(trace.middle_m, a + t_m / length_m * (b - a));
                if (t_m > 0.0 && t_m < length_m && off_m < same_plane_m) along.emplace_back(t_m, trace.wall);
            }
            std::ranges::sort(along);
            for (const auto& [t_m, wall] : along)
                append(wall);
        }
    }
    for (const FaceId wall : storey.walls)
        append(wall);
    storey.walls = std::move(ordered);
}

Ring section(const Polyhedron& polyhedron, const PlaneFrame& plan) {
    Ring points;
    for (const PolyhedronFace& face : polyhedron_faces(polyhedron))
        for (std::size_t k = 0; k < face.vertices_m.size(); ++k) {
            const dvec3 &a = face.vertices_m[k], &b = face.vertices_m[(k + 1) % face.vertices_m.size()];
            const double below_m = plan.origin_m.z - a.z, above_m = b.z - plan.origin_m.z;
            if ((below_m > 0.0) != (above_m > 0.0)) continue;
            points.push_back(plan.to_plane(a + below_m / (below_m + above_m) * (b - a)));
        }
    return convex_hull(std::move(points));
}

}  // namespace

PlaneFrame plan_frame(double z_m) {
    return {{0, 0, z_m}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
}

std::vector<dvec3> cut_at_height(const std::vector<dvec3>& polygon, double z_m) {
    std::vector<dvec3> ends;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const dvec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
        if ((a.z < z_m) != (b.z < z_m)) ends.push_back(a + (z_m - a.z) / (b.z - a.z) * (b - a));
    }
    return ends;
}

Region solid_at_height(const Scene& scene, double z_m, const Ring& rectangle) {
    // Above faces that lie in the plane, and clear of their rounding.
    const PlaneFrame plan = plan_frame(z_m + same_plane_m);
    Region solid;
    if (plan.origin_m.z < scene.ground.z_m) solid = {rectangle};
    for (const Polyhedron& polyhedron : scene.polyhedra) {
        const Ring cut = section(polyhedron, plan);
        if (cut.empty()) continue;
        solid = polyhedron.effect == Effect::fill ? unite(solid, intersect({cut}, {rectangle}))
                                                  : subtract(solid, {cut});
    }
    return without_slivers(solid);
}

std::vector<Storey> find_storeys(const Scene& scene, const Building& building) {
    const std::vector<Heights> heights = face_heights(building);
    Heights indoors;
    for (std::size_t f = 0; f < heights.size(); ++f) {
        if (building.faces[f].environment == Environment::outdoor) continue;
        indoors.low_m = std::min(indoors.low_m, heights[f].low_m);
        indoors.high_m = std::max(indoors.high_m, heights[f].high_m);
    }
    if (indoors.low_m > indoors.high_m) return {};

    // The lowest level is a floor even where nobody can stand, as in a model room made of board.
    std::vector<Storey> storeys;
    for (const Level& level : levels_of(building))
        if (storeys.empty() ||
            (level.standing_m2 >= standing_area_m2 && level.z_m >= storeys.back().floor_m + storey_m))
            storeys.push_back({.floor_m = level.z_m});
    if (storeys.empty()) storeys.push_back({.floor_m = indoors.low_m});

    const auto storey_of = [&](double z_m) -> Storey& {
        std::size_t k = storeys.size() - 1;
        while (k > 0 && storeys[k].floor_m > z_m + same_level_m)
            --k;
        return storeys[k];
    };
    for (std::size_t f = 0; f < building.faces.size(); ++f) {
        const Face& face = building.faces[f];
        if (face.environment == Environment::outdoor || face.aperture || heights[f].low_m > heights[f].high_m)
            continue;
        Storey& storey = storey_of(0.5 * (heights[f].low_m + heights[f].high_m));
        if (is_level(face))
            storey.levels.push_back(make_id<FaceId>(f));
        else if (face.normal.z > -1.0 + 1e-9)
            storey.walls.push_back(make_id<FaceId>(f));
    }
    for (std::size_t a = 0; a < building.apertures.size(); ++a)
        storey_of(building.apertures[a].centroid_m.z).apertures.push_back(make_id<ApertureId>(a));
    for (std::size_t k = 0; k < storeys.size(); ++k) {
        Storey& storey = storeys[k];
        storey.ceiling_m = k + 1 < storeys.size() ? storeys[k + 1].floor_m : indoors.high_m;
        storey.cut_m = storey.floor_m + std::min(1.0, 0.5 * (storey.ceiling_m - storey.floor_m));
        std::ranges::stable_sort(storey.levels, {}, [&](FaceId id) { return heights[index(id)].low_m; });
        order_walls(scene, building, storey);
    }
    return storeys;
}

}  // namespace naturel
