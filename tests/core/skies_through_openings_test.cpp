// The sky component of the standard skies through one opening, against an integral that shares nothing with the program:
// formulas written anew from the tables in tests/data, over the area of the opening instead of the directions.
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "core/direct.h"
#include "core/sun.h"
#include "tests/catch.h"
#include "tests/csv_table.h"
#include "tests/reference/aperture_quadrature.h"
#include "tests/reference/brute_force_visibility.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinRel;

namespace {

/// Luminance of a standard sky of ISO 15469:2004 whose zenith has 1 cd/m2, from its five parameters; type 16 is the overcast
/// sky of Moon and Spencer.
std::function<double(const glm::dvec3&)> standard_sky(int type, const glm::dvec3& sun) {
    if (type == 16) return [](const glm::dvec3& d) { return (1.0 + 2.0 * d.z) / 3.0; };
    static const CsvTable table = read_csv("cie_general_sky_params.csv");
    const std::size_t row = table.row_where("type", std::to_string(type));
    const auto number = [&](const char* column) { return table.number(row, column); };
    const double a = number("a"), b = number("b"), c = number("c"), d = number("d"), e = number("e");
    const auto relative = [=](double sin_altitude, double chi) {
        const double gradation = 1.0 + a * std::exp(b / sin_altitude);
        const double scattering = 1.0 + c * (std::exp(d * chi) - std::exp(0.5 * d * pi)) + e * std::cos(chi) * std::cos(chi);
        return gradation * scattering;
    };
    const double zenith = relative(1.0, std::acos(sun.z));
    return [=](const glm::dvec3& direction) {
        const double chi = std::atan2(glm::length(glm::cross(direction, sun)), glm::dot(direction, sun));
        return relative(direction.z, chi) / zenith;
    };
}

/// Two equal panes of lossless surfaces, index 1.52: share of light that passes at an angle of incidence; docs/method.md, "Glazing".
/// By adding up what goes to and fro in each polarisation.
double double_glazing(double cos_incidence, double internal_transmittance) {
    const double n = 1.52, inside = std::sqrt(1.0 - (1.0 - cos_incidence * cos_incidence) / (n * n));
    const double tau = std::pow(internal_transmittance, 1.0 / inside);
    double sum = 0.0;
    for (const double amplitude : {(cos_incidence - n * inside) / (cos_incidence + n * inside),
                                   (inside - n * cos_incidence) / (inside + n * cos_incidence)}) {
        const double r = amplitude * amplitude;
        const double pane = tau * (1 - r) * (1 - r) / (1 - r * r * tau * tau);
        const double mirror = r * (1 + tau * pane);
        sum += 0.5 * pane * pane / (1 - mirror * mirror);
    }
    return sum;
}

struct Place {
    const char* name;
    Parallelogram opening;
    std::vector<glm::dvec3> vertices_m;
};

/// Where the light comes in, seen from points about the origin.
const Place side_opening{"side", {{-1.0, 2.0, 0.3}, {2.2, 0, 0}, {0, 0, 1.5}},
                         {{-1.0, 2.0, 0.3}, {1.2, 2.0, 0.3}, {1.2, 2.0, 1.8}, {-1.0, 2.0, 1.8}}};
const Place roof_opening{"roof", {{-0.4, -0.9, 2.1}, {0, 1.6, 0}, {1.2, 0, 0}},
                         {{-0.4, -0.9, 2.1}, {-0.4, 0.7, 2.1}, {0.8, 0.7, 2.1}, {0.8, -0.9, 2.1}}};

double sky_component(const Scene& scene, const GatherPoint& point) {
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid);
    const BruteForceVisibility visibility(building);
    NoProgress progress;
    const OutdoorLight outdoors = light_outdoors(scene, building, grid, visibility, progress);
    return DirectLight(scene, building, grid, outdoors, visibility).without_sun(point).sky_lx.g;
}

}  // namespace

TEST_CASE("every standard sky gives through roof and side openings what quadrature gives", "[direct][sky][analytic]") {
    const int type = GENERATE(range(1, 17));
    const bool glazed = GENERATE(false, true);
    const Place& place = GENERATE(std::cref(side_opening), std::cref(roof_opening));
    // Out of sight; in sight through the side opening from one of two points and beside it from the other; in sight through the roof.
    for (const auto& [altitude_deg, azimuth_deg] : {std::pair{40.0, 180.0}, {35.0, -35.0}, {80.0, 100.0}}) {
        const glm::dvec3 sun = direction_from_angles(radians_from_degrees(altitude_deg), radians_from_degrees(azimuth_deg));
        const auto luminance = standard_sky(type, sun);
        Scene scene;
        scene.materials = {{.name = "black", .reflectance = {}}};
        scene.glazings = {{.name = "unglazed", .angular_law = AngularLaw::constant}};
        scene.ground = {.z_m = -1.0, .reflectance = {}};
        scene.sky = {.model = SkyModel::cie_general, .zenith_luminance_cd_m2 = 1.0, .cie_type = type};
        scene.sun = {.altitude_rad = std::asin(sun.z), .azimuth_rad = std::atan2(sun.x, sun.y)};
        const double internal = 0.95;
        scene.glazings.push_back({.name = "double", .normal_transmittance = grey(double_glazing(1.0, internal)), .panes = 2});
        scene.apertures = {{.id = "opening", .vertices_m = place.vertices_m, .glazing = make_id<GlazingId>(glazed ? 1 : 0)}};
        const glm::dvec3 out = -glm::normalize(glm::cross(place.opening.u_m, place.opening.v_m));
        const auto through = [&](const glm::dvec3& direction) {
            return luminance(direction) * (glazed ? double_glazing(glm::dot(out, direction), internal) : 1.0);
        };
        for (const glm::dvec3& position : {glm::dvec3{0, 0, 0}, glm::dvec3{1.4, 1.1, 0.2}}) {
            for (const glm::dvec3& normal : {glm::dvec3{0, 0, 1}, glm::normalize(glm::dvec3{-0.3, 0.8, 0.7})}) {
                const GatherPoint point{position, normal};
                const double expected = illuminance_by_quadrature(point, place.opening, 4, through);
                const double finer = illuminance_by_quadrature(point, place.opening, 6, through);
                INFO(place.name << ", type " << type << (glazed ? ", glazed" : ", unglazed") << ", sun " << altitude_deg << ' '
                                << azimuth_deg << ", from " << position.x << ", normal " << normal.y);
                // The cusp at the sun limits it, where that is in sight.
                CHECK_THAT(expected, WithinRel(finer, 1e-5));
                const double found = sky_component(scene, point);
                // The default tolerance of direct light; 6e-4 is the worst measured.
                CHECK_THAT(found, WithinRel(finer, 1e-3));
            }
        }
    }
}
