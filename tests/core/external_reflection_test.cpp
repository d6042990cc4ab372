// The externally reflected component of masks in front of a window, against quadrature: a facade opposite, an endless wall, a
// side screen and a canopy, shaded by the window's own facade.
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "core/direct.h"
#include "core/sun.h"
#include "tests/catch.h"
#include "tests/reference/aperture_quadrature.h"
#include "tests/reference/brute_force_visibility.h"
#include "tests/reference/light_by_clipping.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

/// An upright rectangle in the plane y = d; counter-clockwise from the south, or from the north.
std::vector<dvec3> from_south(double x0, double x1, double z0, double z1, double d) {
    return {{x0, d, z0}, {x1, d, z0}, {x1, d, z1}, {x0, d, z1}};
}
std::vector<dvec3> from_north(double x0, double x1, double z0, double z1, double d) {
    return {{x1, d, z0}, {x0, d, z0}, {x0, d, z1}, {x1, d, z1}};
}
std::vector<dvec3> corners_of(const Parallelogram& p) {
    return {p.origin_m, p.origin_m + p.u_m, p.origin_m + p.u_m + p.v_m, p.origin_m + p.v_m};
}

/// A function on a parallelogram by its values at Chebyshev's points, count x count.
class SmoothOn {
public:
    SmoothOn(const Parallelogram& where, int count, const std::function<double(const dvec3&)>& f) : where_(where), count_(count) {
        for (int k = 0; k < count; ++k) nodes_.push_back(0.5 - 0.5 * std::cos(pi * (k + 0.5) / count));
        for (const double t : nodes_)
            for (const double s : nodes_) values_.push_back(f(where.origin_m + s * where.u_m + t * where.v_m));
    }
    /// Where a ray meets the plane of the parallelogram.
    double along(const dvec3& from_m, const dvec3& direction) const {
        const dvec3 normal = glm::cross(where_.u_m, where_.v_m);
        const dvec3 hit = from_m + glm::dot(where_.origin_m - from_m, normal) / glm::dot(direction, normal) * direction - where_.origin_m;
        const std::vector<double> s = weights(glm::dot(hit, where_.u_m) / glm::dot(where_.u_m, where_.u_m));
        const std::vector<double> t = weights(glm::dot(hit, where_.v_m) / glm::dot(where_.v_m, where_.v_m));
        double sum = 0.0;
        for (std::size_t j = 0; j < t.size(); ++j)
            for (std::size_t i = 0; i < s.size(); ++i) sum += t[j] * s[i] * values_[j * s.size() + i];
        return sum;
    }

private:
    /// Barycentric, J.-P. Berrut & L. N. Trefethen 2004.
    std::vector<double> weights(double x) const {
        std::vector<double> w;
        double total = 0.0;
        for (int k = 0; k < count_; ++k) {
            const double gap = x - nodes_[static_cast<std::size_t>(k)];
            const double own = (k % 2 ? -1.0 : 1.0) * std::sin(pi * (k + 0.5) / count_) / (gap == 0.0 ? 1e-300 : gap);
            w.push_back(own);
            total += own;
        }
        for (double& own : w) own /= total;
        return w;
    }

    Parallelogram where_;
    int count_;
    std::vector<double> nodes_, values_;
};

struct Mask {
    const char* name;
    Parallelogram shape;  ///< rectangle; its normal cross(u, v) is that of its lit side
    Parallelogram seen;   ///< the same, or the part of it that the points below can see
};

constexpr double window_y = 2.0, mask_reflectance = 0.4, ground_reflectance = 0.2;
const std::vector<dvec3> window = from_south(-1.0, 1.0, 1.0, 2.4, window_y);
/// Black, the window within it; what the masks see of it is dark.
const std::vector<dvec3> own_facade = from_north(-6.0, 5.0, 0.0, 7.0, window_y);

const Parallelogram facade_shape{{-9, 9, 0}, {13, 0, 0}, {0, 0, 6}}, screen_shape{{1.4, 2.0, 0}, {0, 0, 4}, {0, 1.8, 0}},
    canopy_shape{{-2, 2.0, 3.0}, {0, 1.5, 0}, {4, 0, 0}};
const Mask facade_opposite{"facade opposite", facade_shape, facade_shape};
const Mask endless_wall{"endless wall", {{-50, 6, 0}, {100, 0, 0}, {0, 0, 3.2}}, {{-4, 6, 0}, {10.4, 0, 0}, {0, 0, 3.2}}};
const Mask side_screen{"side screen", screen_shape, screen_shape};
const Mask canopy{"canopy", canopy_shape, canopy_shape};

Scene make_scene(const Mask& mask, SkyModel model) {
    Scene scene;
    scene.materials = {{.name = "black", .reflectance = {}}, {.name = "mask", .reflectance = grey(mask_reflectance)}};
    scene.glazings = {{.name = "unglazed", .angular_law = AngularLaw::constant}};
    scene.ground = {.z_m = 0.0, .reflectance = grey(ground_reflectance)};
    scene.sky = {.model = model, .horizontal_illuminance_lx = 1.0};
    scene.apertures = {{.id = "window", .vertices_m = window}};
    scene.polygons = {{.id = "own facade", .vertices_m = own_facade, .side = Environment::outdoor},
                      {.id = mask.name, .vertices_m = corners_of(mask.shape), .material = make_id<MaterialId>(1), .side = Environment::outdoor}};
    // A black room, else the masks would see the sky through the window. Small: they must not see it past the facade.
    const double x0 = -2.2, x1 = 2.2, y0 = -1.2, y1 = window_y, z0 = 0.1, z1 = 3.5;
    for (const std::vector<dvec3>& side : {from_south(x0, x1, z0, z1, y0), {{x0, y0, z0}, {x1, y0, z0}, {x1, y1, z0}, {x0, y1, z0}},
                                           {{x0, y0, z1}, {x1, y0, z1}, {x1, y1, z1}, {x0, y1, z1}},
                                           {{x0, y0, z0}, {x0, y1, z0}, {x0, y1, z1}, {x0, y0, z1}},
                                           {{x1, y0, z0}, {x1, y1, z0}, {x1, y1, z1}, {x1, y0, z1}}})
        scene.polygons.push_back({.id = "room " + std::to_string(scene.polygons.size()), .vertices_m = side});
    return scene;
}

/// By quadrature: light of sky, sun and ground on the mask as far as the window's facade leaves them, its reflection through the window.
/// normal: of the mask. sun_lx: on the mask, all of which it reaches.
double masked_light(const Mask& mask, const GatherPoint& point, const Sky& sky, double sun_lx, double ground_cd_m2,
                    const GlazingTransmission& glazing, int nodes) {
    const dvec3 normal = glm::normalize(glm::cross(mask.shape.u_m, mask.shape.v_m));
    const LuminanceOf outdoors = [&](const dvec3& d) { return d.z >= 0.0 ? sky.luminance(d).value : ground_cd_m2; };
    const double open_lx = sky.plane_illuminance(normal).value + 0.5 * (1.0 - normal.z) * pi * ground_cd_m2 + sun_lx;
    const SmoothOn arriving(mask.seen, nodes, [&](const dvec3& place) {
        return open_lx - illuminance_by_clipping({place, normal}, {own_facade, {}}, {}, outdoors);
    });
    const Blocker shining{corners_of(mask.shape), [&](const dvec3& d) {
        return glazing.transmittance(d.y).g * mask_reflectance / pi * arriving.along(point.position_m, d);  // the window looks north
    }};
    return illuminance_by_clipping(point, {window, {}}, {shining}, [](const dvec3&) { return 0.0; });
}

/// Compares the externally reflected component without the ground's at three points in the room with quadrature.
void check_mask(const Mask& mask, SkyModel model, const Glazing& glazing, double spacing_m) {
    Scene scene = make_scene(mask, model);
    scene.glazings.push_back(glazing);
    scene.apertures[0].glazing = make_id<GlazingId>(1);
    scene.grid.outdoor_spacing_m = spacing_m;
    // High behind the own facade: none of the masks is in its shadow.
    const double azimuth = pi - 0.4, altitude = 1.15, direct_normal_lx = model == SkyModel::cie_clear ? 3.0 : 0.0;
    scene.sun = {.altitude_rad = altitude, .azimuth_rad = azimuth, .direct_normal_illuminance_lx = direct_normal_lx};
    const dvec3 sun = direction_from_angles(altitude, azimuth);
    const Sky sky(scene.sky, sun);
    const dvec3 normal = glm::normalize(glm::cross(mask.shape.u_m, mask.shape.v_m));
    const double sun_lx = direct_normal_lx * std::max(0.0, glm::dot(normal, sun));
    const double ground_cd_m2 = ground_reflectance / pi * (1.0 + direct_normal_lx * sun.z);

    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    const BruteForceVisibility visibility(building);
    NoProgress progress;
    const OutdoorLight light = light_outdoors(scene, building, grid, visibility, progress);
    const DirectLight direct(scene, building, grid, light, visibility);
    for (const GatherPoint& point : {GatherPoint{{0.3, 0, 0.85}, {0, 0, 1}},
                                     GatherPoint{{-0.8, 0.6, 0.3}, glm::normalize(dvec3{0.5, 0.5, 1})},
                                     GatherPoint{{-1.5, -0.5, 0.6}, glm::normalize(dvec3{0.5, 0.5, 0.4})}}) {
        INFO(mask.name << ", sky " << static_cast<int>(model) << ", point at " << point.position_m.x);
        // 9 nodes: 1.3e-4 from 7 at most, next to which 9 and 14 differ by a tenth.
        const double expected = masked_light(mask, point, sky, sun_lx, ground_cd_m2, GlazingTransmission(glazing), 9);
        const DirectIlluminance found = direct.without_sun(point);
        // Interpolation between nodes, second order in the spacing: 0.16 % for the wall at 0.4 m.
        CHECK_THAT((found.outdoor_lx.total() - found.ground_lx.total()).g, WithinRel(expected, 2e-3));
    }
}

}  // namespace

TEST_CASE("masks before a glazed window give under an overcast sky the light that quadrature gives", "[outdoors][direct][analytic]") {
    const auto mask = GENERATE(std::cref(facade_opposite), std::cref(side_screen), std::cref(canopy));
    check_mask(mask, SkyModel::moon_spencer, {.name = "double", .normal_transmittance = grey(0.78), .panes = 2}, 0.5);
}

TEST_CASE("masks before a window give the light that quadrature gives", "[outdoors][direct][analytic][slow]") {
    const auto mask = GENERATE(std::cref(facade_opposite), std::cref(endless_wall), std::cref(side_screen), std::cref(canopy));
    const SkyModel model = GENERATE(SkyModel::uniform, SkyModel::moon_spencer, SkyModel::cie_clear);
    check_mask(mask, model, {.name = "open", .angular_law = AngularLaw::constant}, 0.4);
}
