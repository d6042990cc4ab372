#include "tests/reference/occluded_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <ranges>
#include <span>
#include <string>

#include "core/units.h"
#include "tests/random_scenes.h"

namespace naturel::tests {
namespace {

using glm::dvec3;

class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double operator()(double low, double high) { return low + (high - low) * static_cast<double>(bits_() >> 11) * 0x1p-53; }
    int whole(int low, int high) { return low + static_cast<int>(bits_() % static_cast<std::uint64_t>(high - low + 1)); }
    dvec3 direction() {
        for (;;) {
            const dvec3 v{(*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1)};
            if (glm::length(v) > 0.1 && glm::length(v) < 1) return glm::normalize(v);
        }
    }

private:
    std::mt19937_64 bits_;
};

/// A polygon on an ellipse, or a rectangle.
std::vector<dvec3> random_polygon(Random& random, const dvec3& middle, const dvec3& normal) {
    const dvec3 u = glm::normalize(glm::cross(normal, random.direction())), v = glm::cross(normal, u);
    const double a = random(0.1, 0.6), b = random(0.1, 0.6);
    std::vector<dvec3> polygon;
    if (random.whole(0, 1) == 0) return {middle - a * u - b * v, middle + a * u - b * v, middle + a * u + b * v, middle - a * u + b * v};
    const int corners = random.whole(3, 6);
    for (int k = 0; k < corners; ++k) {
        const double angle = 2 * pi * (k + random(0.1, 0.9)) / corners;
        polygon.push_back(middle + a * std::cos(angle) * u + b * std::sin(angle) * v);
    }
    return polygon;
}

Polyhedron random_solid(Random& random, const dvec3& middle, double size) {
    Polyhedron p{.effect = Effect::fill, .material = MaterialId{}};
    p.kind = static_cast<PolyhedronKind>(random.whole(0, 2));
    const dvec3 u = random.direction(), v = glm::normalize(glm::cross(u, random.direction())), w = glm::cross(u, v);
    const dvec3 a = random(0.1, 1) * size * u, b = random(0.1, 1) * size * v, c = random(0.1, 1) * size * (w + random(-0.3, 0.3) * u);
    const dvec3 origin = middle - 0.5 * (a + b + c);
    p.vertices_m = {origin, origin + a, origin + b, origin + c};
    return p;
}

}  // namespace

Scene random_occluded_pair(std::uint64_t seed) {
    Random random(seed);
    Scene scene = empty_scene();
    const dvec3 way = random.direction(), start(0, 0, 20);  // well above the ground
    const double distance = random(0.3, 3.0);
    const auto towards = [&](const dvec3& d) { return glm::normalize(d + random(0, 0.8) * random.direction()); };
    scene.polygons.push_back({.id = "emitter", .vertices_m = random_polygon(random, start, towards(way))});
    scene.polygons.push_back({.id = "receiver", .vertices_m = random_polygon(random, start + distance * way, towards(-way))});
    // Clear of the planes of both: what reaches into a patch would leave less of it.
    const auto between = [&](std::span<const dvec3> corners) {
        return std::ranges::all_of(scene.polygons | std::views::take(2), [&](const SurfacePolygon& p) {
            const dvec3& o = p.vertices_m[0];
            const dvec3 normal = glm::normalize(glm::cross(p.vertices_m[1] - o, p.vertices_m[2] - o));
            return std::ranges::all_of(corners, [&](const dvec3& c) { return glm::dot(normal, c - o) > 0.01 * distance; });
        });
    };
    const int count = random.whole(1, 3);
    for (int k = 0; k < count; ++k)
        for (int attempt = 0; attempt < 30; ++attempt) {
            const dvec3 place = start + random(0.2, 0.8) * distance * way + 0.3 * distance * random.direction();
            const double size = random(0.05, 0.5) * distance;
            const std::string id = "p" + std::to_string(k);
            if (random.whole(0, 3) == 0) {
                SurfacePolygon sheet{.id = id, .vertices_m = random_polygon(random, place, random.direction()), .side = Environment::outdoor};
                if (!between(sheet.vertices_m)) continue;
                scene.polygons.push_back(sheet);
            } else {
                Polyhedron solid = random_solid(random, place, size);
                const auto& [o, a, b, c] = solid.vertices_m;
                if (!between(std::array{o, a, b, c, a + b - o, a + c - o, b + c - o, a + b + c - 2.0 * o})) continue;
                solid.id = id;
                scene.polyhedra.push_back(solid);
            }
            break;
        }
    return scene;
}

Scene random_furnished_room(std::uint64_t seed) {
    Random random(seed);
    Scene scene = closed_room({4, 3, 2.5});
    const int count = random.whole(5, 10);
    for (int k = 0; k < count; ++k) {
        const std::string id = "box " + std::to_string(k);
        const dvec3 size(random(0.1, 1.2), random(0.1, 1.2), random(0.05, 1.5));
        const dvec3 place(random(0.1, 3.9 - size.x), random(0.1, 2.9 - size.y), random(0.1, 2.4 - size.z));
        const int kind = random.whole(0, 3);
        if (kind == 3) {
            scene.polyhedra.push_back(random_solid(random, {random(0.8, 3.2), random(0.8, 2.2), random(0.8, 1.7)}, 0.7));
            scene.polyhedra.back().id = id;
        } else {
            const dvec3 low = kind == 2 ? place : dvec3(place.x, place.y, 0.0);
            scene.polyhedra.push_back(box(id, Effect::fill, low, low + size));
        }
    }
    return scene;
}

Scene room_of_oblique_solids(std::uint64_t seed, int count) {
    Random random(seed);
    Scene scene = closed_room({4, 3, 2.5});
    for (int k = 0; k < count; ++k) {
        scene.polyhedra.push_back(random_solid(random, {random(0.7, 3.3), random(0.7, 2.3), random(0.7, 1.8)}, random(0.1, 1.0)));
        scene.polyhedra.back().id = "solid " + std::to_string(k);
    }
    return scene;
}

Scene room_with_boxes(int count) {
    Scene scene = closed_room({6, 5, 3});
    for (int k = 0; k < count; ++k) {
        const dvec3 low{0.3 + 0.95 * (k % 6), 0.4 + 1.2 * (k / 6), 0.0};
        scene.polyhedra.push_back(box("box " + std::to_string(k), Effect::fill, low, low + dvec3(0.4, 0.5, 0.5 + 0.25 * (k % 4))));
    }
    return scene;
}

std::vector<std::vector<dvec3>> facet_polygons(const Building& building) {
    std::vector<std::vector<dvec3>> polygons;
    for (const Facet& f : building.facets) {
        polygons.push_back(f.vertices_m);
        if (building.faces[index(f.face)].sheet) polygons.emplace_back(f.vertices_m.rbegin(), f.vertices_m.rend());
    }
    return polygons;
}

}  // namespace naturel::tests
