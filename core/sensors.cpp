#include "core/sensors.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/box_index.h"
#include "core/polyhedra.h"

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

/// Where points are: on which facets, in what medium. Asks only what is near.
class Surroundings {
public:
    Surroundings(const Scene& scene, const Building& building)
        : scene_(scene), building_(building), facets_(boxes(building)), polyhedra_(boxes(scene)) {
        // Membership knows polyhedra alone. Where nothing is carved and polygons face indoor air, they enclose the rooms, and
        // only what is filled is certain.
        const bool carved = std::any_of(scene.polyhedra.begin(), scene.polyhedra.end(),
                                        [](const Polyhedron& p) { return p.effect == Effect::carve; });
        const bool faces_indoors = std::any_of(scene.polygons.begin(), scene.polygons.end(),
                                               [](const SurfacePolygon& p) { return p.side == Environment::indoor; });
        rooms_of_polygons_ = !carved && faces_indoors;
    }

    /// Moved off the facets that it lies on.
    dvec3 lifted(dvec3 position_m) {
        facets_.containing(position_m, near_);
        for (const std::uint32_t f : near_) {
            const Facet& facet = building_.facets[f];
            if (!facet.is_aperture && lies_on(facet, position_m)) position_m += lift_m * facet.normal;
        }
        return position_m;
    }

    Medium medium_of(const dvec3& point_m) {
        polyhedra_.containing(point_m, near_);
        if (!rooms_of_polygons_) return medium_at(scene_, near_, point_m);
        const bool filled =
            std::any_of(near_.begin(), near_.end(), [&](std::uint32_t k) { return contains(scene_.polyhedra[k], point_m); });
        return filled ? Medium::solid : Medium::indoor_air;
    }

private:
    // A point may be lifted off several facets, one after the other.
    static constexpr double near_m = 100.0 * lift_m;

    static std::vector<Box> boxes(const Building& building) {
        std::vector<Box> list;
        for (const Facet& facet : building.facets) list.push_back(box_around(facet.vertices_m, near_m));
        return list;
    }
    static std::vector<Box> boxes(const Scene& scene) {
        std::vector<Box> list;
        for (const Polyhedron& polyhedron : scene.polyhedra) {
            std::vector<dvec3> corners_m;
            for (const PolyhedronFace& face : polyhedron_faces(polyhedron))
                corners_m.insert(corners_m.end(), face.vertices_m.begin(), face.vertices_m.end());
            list.push_back(box_around(corners_m, near_m));
        }
        return list;
    }

    const Scene& scene_;
    const Building& building_;
    BoxIndex facets_, polyhedra_;
    bool rooms_of_polygons_ = false;
    std::vector<std::uint32_t> near_;
};

struct Extent {
    double low_m, high_m;
};

// The extent of a room along y where it is at least half as wide as where it is widest: alcoves and window reveals shall
// not shift the grid of the room.
Extent main_extent(const Region& room, const PlaneFrame& plane) {
    std::vector<ClipperLib::cInt> levels;
    ClipperLib::cInt left = room[0][0].X;
    for (const Ring& ring : room) {
        for (const PlanePoint& p : ring) {
            levels.push_back(p.Y);
            left = std::min(left, p.X);
        }
    }
    std::sort(levels.begin(), levels.end());
    levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
    // Width half-way from one level to the next, where no edge begins or ends; edges that go up have the room on their left.
    std::vector<double> width(levels.size(), 0.0);
    for (const Ring& ring : room) {
        for (std::size_t k = 0; k < ring.size(); ++k) {
            const PlanePoint &a = ring[k], &b = ring[(k + 1) % ring.size()];
            const auto number = [&](ClipperLib::cInt y) {
                return static_cast<std::size_t>(std::lower_bound(levels.begin(), levels.end(), y) - levels.begin());
            };
            const double slope = a.Y == b.Y ? 0.0 : static_cast<double>(b.X - a.X) / static_cast<double>(b.Y - a.Y);
            for (std::size_t i = number(std::min(a.Y, b.Y)); i < number(std::max(a.Y, b.Y)); ++i) {
                // Steps of some nanometres come from rounding and count for nothing.
                if (static_cast<double>(levels[i + 1] - levels[i]) / nanometres_per_metre < 1e-6) continue;
                const double up = 0.5 * static_cast<double>(levels[i] - a.Y + levels[i + 1] - a.Y);
                width[i] += (b.Y > a.Y ? 1.0 : -1.0) * (static_cast<double>(a.X - left) + slope * up);
            }
        }
    }
    const double widest = *std::max_element(width.begin(), width.end());
    std::size_t first = 0, last = width.size() - 1;
    while (width[first] < 0.5 * widest) ++first;
    while (width[last] < 0.5 * widest) --last;
    return {plane.to_world({0, levels[first]}).y, plane.to_world({0, levels[last + 1]}).y};
}

// Coordinates of a grid: as many as fit into `main` at the spacing, centred, and on from there over all of `whole`.
std::vector<double> centred_row(const Extent& main, const Extent& whole, double spacing_m) {
    const double steps = std::floor((main.high_m - main.low_m) / spacing_m + 1e-9);
    const double anchor = 0.5 * (main.low_m + main.high_m - steps * spacing_m);
    std::vector<double> row;
    const double before = std::floor((anchor - whole.low_m) / spacing_m + 1e-9);
    for (double k = -before; anchor + k * spacing_m <= whole.high_m + 1e-9; k += 1.0) row.push_back(anchor + k * spacing_m);
    return row;
}

std::vector<dvec3> grid_points(const Scene& scene, const SensorGrid& grid) {
    std::vector<dvec3> points;
    const PlaneFrame plane{{0, 0, grid.z_m}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Region region = indoor_air_at_height(scene, grid.z_m);
    if (grid.margin_m > 0.0) region = offset(region, -grid.margin_m);
    for (const Region& room : connected_parts(region)) {
        Region transposed;
        dvec3 low(1e9), high(-1e9);
        for (const Ring& ring : room) {
            Ring swapped;
            for (const PlanePoint& p : ring) {
                low = min(low, plane.to_world(p)), high = max(high, plane.to_world(p));
                swapped.emplace_back(p.Y, p.X);
            }
            ClipperLib::ReversePath(swapped);
            transposed.push_back(std::move(swapped));
        }
        const auto columns = centred_row(main_extent(transposed, plane), {low.x, high.x}, grid.spacing_m);
        for (const double y : centred_row(main_extent(room, plane), {low.y, high.y}, grid.spacing_m)) {
            for (const double x : columns) {
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
    Surroundings surroundings(scene, building);
    for (std::size_t s = 0; s < scene.sensors.size(); ++s) {
        const SensorSet& set = scene.sensors[s];
        std::size_t number = 0;
        const auto add = [&](const dvec3& given_m, const dvec3& normal) {
            const dvec3 position_m = surroundings.lifted(given_m);
            sensors.push_back({.set = s,
                               .id = set.id + "/" + std::to_string(++number),
                               .point = {position_m, normal},
                               .medium = surroundings.medium_of(position_m)});
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
