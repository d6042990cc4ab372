#include "core/direct.h"

#include <atomic>
#include <cstdio>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>

#include "core/parallel.h"
#include "core/sun.h"
#include "tests/catch.h"
#include "tests/csv_table.h"
#include "tests/reference/aperture_quadrature.h"
#include "tests/reference/brute_force_visibility.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Counts the directions asked for.
class CountedVisibility final : public Visibility {
public:
    explicit CountedVisibility(const Building& building) : exact_(building) {}
    std::string_view name() const noexcept override { return "counted"; }
    std::vector<std::pair<std::string, std::string>> settings() const override { return {}; }
    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                    std::span<FacetId> seen) const override {
        rays += directions.size();
        exact_.first_seen(from, directions, seen);
    }
    void form_factor_row(PatchId from, FormFactorRow& row) const override { exact_.form_factor_row(from, row); }
    void gather_row(const GatherPoint& from, FormFactorRow& row) const override { exact_.gather_row(from, row); }
    void view_facets(const View& view, std::span<FacetId> seen) const override { exact_.view_facets(view, seen); }

    mutable std::atomic<std::size_t> rays = 0;

private:
    BruteForceVisibility exact_;
};

/// A scene with everything a DirectLight refers to.
struct Lit {
    explicit Lit(const Scene& description)
        : scene(description),
          building(assemble(scene)),
          grid(make_patch_grid(building, scene.grid)),
          visibility(building),
          outdoors(light_outdoors(scene, building, grid, visibility, progress)),
          direct(scene, building, grid, outdoors, visibility) {
        visibility.rays = 0;
    }

    Scene scene;
    Building building;
    PatchGrid grid;
    CountedVisibility visibility;
    NoProgress progress;
    OutdoorLight outdoors;
    DirectLight direct;
};

/// A sky of 1 lx on the ground, which is black.
Scene make_scene(SkyModel model) {
    Scene scene;
    scene.materials = {{.name = "black", .reflectance = {}}};
    scene.glazings = {{.name = "unglazed", .angular_law = AngularLaw::constant}};
    scene.ground = {.z_m = -1.0, .reflectance = {}};
    scene.sky = {.model = model, .horizontal_illuminance_lx = 1.0};
    return scene;
}

/// In the plane y = d, seen from the south.
AperturePolygon window(double x0, double x1, double z0, double z1, double d) {
    return {.id = "window", .vertices_m = {{x0, d, z0}, {x1, d, z0}, {x1, d, z1}, {x0, d, z1}}, .holes_m = {}};
}

/// In the plane z = c, seen from below.
AperturePolygon rooflight(double x0, double x1, double y0, double y1, double c) {
    return {.id = "rooflight", .vertices_m = {{x0, y0, c}, {x0, y1, c}, {x1, y1, c}, {x1, y0, c}}, .holes_m = {}};
}

/// Blocks and reflects nothing. In the plane y = d, seen from the south.
SurfacePolygon screen(double x0, double x1, double z0, double z1, double d) {
    return {.id = "screen", .vertices_m = {{x0, d, z0}, {x1, d, z0}, {x1, d, z1}, {x0, d, z1}}, .holes_m = {}};
}

/// Sky component on a horizontal plane through a vertical window from the plane up to height h and from the foot of the
/// perpendicular to width w (either sign), at distance d; share of the horizontal illuminance.
/// Source: angular integration of the sky; docs/method.md, "Direct illuminance".
double window_corner(SkyModel model, double w, double h, double d) {
    if (h <= 0.0) return 0.0;
    const double beta = std::atan(w / d), gamma = std::atan(h / d), beta_head = std::atan(w / std::hypot(d, h));
    const double uniform = beta - beta_head * std::cos(gamma);
    if (model == SkyModel::uniform) return uniform / (2 * pi);
    return 3 / (14 * pi) * uniform + 2 / (7 * pi) * (std::asin(std::sin(beta) * std::sin(gamma)) -
                                                      0.5 * std::sin(2 * gamma) * std::sin(beta_head));
}

double window_sky_component(SkyModel model, double x0, double x1, double z0, double z1, double d) {
    return window_corner(model, x1, z1, d) - window_corner(model, x0, z1, d) - window_corner(model, x1, z0, d) +
           window_corner(model, x0, z0, d);
}

/// The same for a horizontal opening a x b at height c with a corner above the point.
double rooflight_corner(SkyModel model, double a, double b, double c) {
    const double p = a / c, q = b / c, root_p = std::sqrt(1 + p * p), root_q = std::sqrt(1 + q * q);
    const double uniform = (p / root_p * std::atan(q / root_p) + q / root_q * std::atan(p / root_q)) / (2 * pi);
    if (model == SkyModel::uniform) return uniform;
    const double r = std::sqrt(a * a + b * b + c * c);
    const double height_moment = (std::atan(a * b / (c * r)) +
                                  a * b * c * (r * r + c * c) / (r * (a * a + c * c) * (b * b + c * c))) / 3;
    return 3 / (7 * pi) * (pi * uniform + 2 * height_moment);
}

/// On the far side of Sky: luminance times a transmittance that depends on the angle to one plane.
double glazed_quadrature(const Lit& lit, const GatherPoint& point, const Parallelogram& opening, int panels) {
    const GlazingTransmission glazing(lit.scene.glazings.back());
    const glm::dvec3 normal = glm::normalize(glm::cross(opening.u_m, opening.v_m));
    return illuminance_by_quadrature(point, opening, panels, [&](const glm::dvec3& d) {
        return lit.outdoors.sky.luminance(d).value * glazing.transmittance(-glm::dot(normal, d)).g;
    });
}

const GatherPoint origin_up{{0, 0, 0}, {0, 0, 1}};

}  // namespace

TEST_CASE("the sky component of an unglazed window is its closed form", "[direct][analytic]") {
    const CsvTable table = read_csv("aperture_sc_vectors.csv");
    const auto model = GENERATE(SkyModel::uniform, SkyModel::moon_spencer);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const auto value = [&](const char* column) { return table.number(row, column); };
        Scene scene = make_scene(model);
        scene.apertures = {window(value("x0"), value("x1"), value("z0"), value("z1"), value("d"))};
        const Lit lit(scene);
        const double expected = value(model == SkyModel::uniform ? "SC_uniform" : "SC_cie_overcast");
        CAPTURE(row, value("d"));
        const double found = lit.direct.at(origin_up).sky_lx.g;
        // The table has 8 decimals. Uniform: exact but for rounding; Moon & Spencer: the default tolerance.
        if (model == SkyModel::uniform) CHECK_THAT(found, WithinAbs(expected, 6e-9));
        else CHECK_THAT(found, WithinRel(expected, 1e-3));
        CHECK(lit.visibility.rays <= 500);
    if(0)    std::printf("%g %g %zu\n", value("d"), found / expected - 1, lit.visibility.rays.load());
    }
}
TEST_CASE("the sky component is accurate from 5 m down to 1 mm from a window", "[direct][analytic]") {
    const auto model = GENERATE(SkyModel::uniform, SkyModel::moon_spencer);
    const double d = GENERATE(5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.001);
    const double sill = GENERATE(-0.5, 0.0, 0.1);
    Scene scene = make_scene(model);
    scene.apertures = {window(-1.0, 1.0, sill, 1.6, d)};
    const Lit lit(scene);
    const double expected = window_sky_component(model, -1.0, 1.0, sill, 1.6, d);
    CAPTURE(d, sill);
    const double found = lit.direct.at(origin_up).sky_lx.g;
    // Uniform: contour integrals are exact, 1e-9 is rounding next to an edge. Moon & Spencer: the default tolerance.
    CHECK_THAT(found, WithinRel(expected, model == SkyModel::uniform ? 1e-9 : 1e-3));
    if(0)    std::printf("%g %g %g %zu\n", d, sill, found / expected - 1, lit.visibility.rays.load());
}

#include "core/spherical_polygon.h"
#include <random>
TEST_CASE("calib", "[calib]") {
  for (double tol : {1e-2, 3e-3, 1e-3, 3e-4}) {
   double s2=0, s1=0, rays=0, worst=0; int n=200;
   for (int seed=0; seed<n; ++seed) {
    std::mt19937 g(seed); std::uniform_real_distribution<double> u(0,1);
    Scene scene = make_scene(SkyModel::uniform);
    scene.direct.tolerance = tol;
    double d = 1+2*u(g);
    scene.apertures = {window(-1.0, 1.0, 0.1, 1.6, d)};
    double ds = d*0.6, cx = (u(g)-0.5), cz = 0.5+0.6*u(g), r=0.1+0.3*u(g), a0 = 6*u(g);
    std::vector<glm::dvec3> t;
    int k = 3 + seed%3;
    for (int i=0;i<k;++i) t.push_back({0.6*(cx+r*std::cos(a0+i*2*pi/k)), ds, 0.6*std::max(0.1,cz+r*std::sin(a0+i*2*pi/k))});
    SurfacePolygon s; s.id="s"; s.vertices_m=t; scene.polygons={s};
    const Lit lit(scene);
    double truth = (vector_solid_angle(scene.apertures[0].vertices_m).z-vector_solid_angle(t).z)/pi;
    double f = lit.direct.at(origin_up).sky_lx.g;
    double e = f/truth-1;
    s1+=e; s2+=e*e; rays+=lit.visibility.rays; worst=std::max(worst,std::abs(e));
   }
   std::printf("tol %g mean %g rms %g worst %g rays %g\n", tol, s1/n, std::sqrt(s2/n), worst, rays/n);
  }
}
