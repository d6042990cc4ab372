#include "core/sensors.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace naturel {

namespace {

using glm::dvec3;

// Nearer than this to a surface, a point lies on it; it is lifted off by as much, so that it does not sit inside.
constexpr double lift_m = 1e-5;

bool lies_on(const Facet& facet, const dvec3& point_m) {
    if (std::abs(glm::dot(point_m - facet.vertices_m[0], facet.normal)) >= lift_m) return false;
    for (std::size_t i = 0; i < facet.vertices_m.size(); ++i) {
        const dvec3& a = facet.vertices_m[i];
        const dvec3 edge = facet.vertices_m[(i + 1) % facet.vertices_m.size()] - a;
        if (glm::dot(glm::cross(facet.normal, edge), point_m - a) < -lift_m * glm::length(edge)) return false;
    }
    return true;
}

// Membership knows polyhedra alone. Where polygons enclose the rooms, only what is filled is certain.
Medium medium_of(const Scene& scene, const dvec3& point_m) {
    const Medium medium = medium_at(scene, point_m);
    const bool rooms_of_polygons = std::any_of(scene.polygons.begin(), scene.polygons.end(),
                                               [](const SurfacePolygon& p) { return p.side == Environment::indoor; });
    return rooms_of_polygons && medium == Medium::outdoor_air ? Medium::indoor_air : medium;
}

// Points of a grid over one room: as many as fit at the spacing, centred.
std::vector<double> centred_row(double low_m, double high_m, double spacing_m) {
    const auto count = static_cast<std::size_t>(std::floor((high_m - low_m) / spacing_m + 1e-9)) + 1;
    const double first = 0.5 * (low_m + high_m - static_cast<double>(count - 1) * spacing_m);
    std::vector<double> row;
    for (std::size_t i = 0; i < count; ++i) row.push_back(first + static_cast<double>(i) * spacing_m);
    return row;
}

std::vector<dvec3> grid_points(const Scene& scene, const SensorGrid& grid) {
    std::vector<dvec3> points;
    const PlaneFrame plane{{0, 0, grid.z_m}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Region region = indoor_air_at_height(scene, grid.z_m);
    if (grid.margin_m > 0.0) region = offset(region, -grid.margin_m);
    for (const Region& room : connected_parts(region)) {
        dvec3 low(1e9), high(-1e9);
        for (const PlanePoint& p : room.front()) low = min(low, plane.to_world(p)), high = max(high, plane.to_world(p));
        for (const double y : centred_row(low.y, high.y, grid.spacing_m)) {
            for (const double x : centred_row(low.x, high.x, grid.spacing_m)) {
                const dvec3 point(x, y, grid.z_m);
                if (contains(room, plane.to_plane(point))) points.push_back(point);
            }
        }
    }
    return points;
}

}  // namespace

std::vector<Sensor> place_sensors(const Scene& scene, const Building& building) {
    std::vector<Sensor> sensors;
    for (std::size_t s = 0; s < scene.sensors.size(); ++s) {
        const SensorSet& set = scene.sensors[s];
        std::size_t number = 0;
        const auto add = [&](dvec3 position_m, const dvec3& normal) {
            for (const Facet& facet : building.facets)
                if (!facet.is_aperture && lies_on(facet, position_m)) position_m += lift_m * facet.normal;
            sensors.push_back({.set = s,
                               .id = set.id + "/" + std::to_string(++number),
                               .point = {position_m, normal},
                               .medium = medium_of(scene, position_m)});
        };
        if (set.grid) {
            for (const dvec3& position_m : grid_points(scene, *set.grid)) add(position_m, {0, 0, 1});
        } else {
            for (const SensorPoint& point : set.points) add(point.position_m, point.normal);
        }
    }
    return sensors;
}

}  // namespace naturel
