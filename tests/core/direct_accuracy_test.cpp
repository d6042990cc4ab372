// How honest the tolerance of direct light is: hard cases against an integration that casts no rays.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <random>

#include "core/aperture_light.h"
#include "core/direct.h"
#include "core/sun.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"
#include "tests/reference/brute_force_visibility.h"
#include "tests/reference/light_by_clipping.h"

using namespace naturel;
using namespace naturel::tests;
using glm::dvec3;

namespace {

/// Uniform numbers of one case.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : random_(seed * 7919 + 17) {}
    double between(double low, double high) { return low + (high - low) * share_(random_); }
    bool coin() { return share_(random_) < 0.5; }
    dvec3 direction() {
        const double z = between(-1, 1), angle = between(0, 2 * pi), r = std::sqrt(1 - z * z);
        return {r * std::cos(angle), r * std::sin(angle), z};
    }

private:
    std::mt19937_64 random_;
    std::uniform_real_distribution<double> share_{0.0, 1.0};
};

struct HardCase {
    Scene scene;
    GatherPoint point;
    std::vector<Blocker> blockers;  ///< what the scene's polygons are, from near to far
};

Scene bare_scene(SkyModel model) {
    Scene scene;
    scene.materials = {{.name = "black", .reflectance = {}},
                       {.name = "lit", .reflectance = {}, .exitance_lm_m2 = grey(0.4)}};
    scene.glazings = {{.name = "unglazed", .angular_law = AngularLaw::constant},
                      {.name = "single", .normal_transmittance = grey(0.88)},
                      {.name = "double", .normal_transmittance = grey(0.78), .panes = 2}};
    scene.ground = {.z_m = -20.0, .reflectance = grey(0.2)};
    scene.sky = {.model = model, .horizontal_illuminance_lx = 1.0};
    return scene;
}

/// In the plane y = d, seen from the south.
std::vector<dvec3> upright(double x0, double x1, double z0, double z1, double d) {
    return {{x0, d, z0}, {x1, d, z0}, {x1, d, z1}, {x0, d, z1}};
}

void add_window(HardCase& hard, std::vector<dvec3> outline, std::size_t glazing = 0) {
    hard.scene.apertures.push_back({.id = "w" + std::to_string(hard.scene.apertures.size()),
                                    .vertices_m = std::move(outline),
                                    .glazing = make_id<GlazingId>(glazing)});
}

void add_screen(HardCase& hard, std::vector<dvec3> outline, bool lit = false) {
    hard.blockers.push_back({outline, {}});
    if (lit) hard.blockers.back().luminance_cd_m2 = [](const dvec3&) { return 0.4 / pi; };
    hard.scene.polygons.push_back({.id = "s" + std::to_string(hard.scene.polygons.size()),
                                   .vertices_m = std::move(outline),
                                   .material = make_id<MaterialId>(lit ? 1 : 0),
                                   .side = lit ? Environment::outdoor : Environment::indoor});
}

dvec3 towards_window(Dice& dice) {
    for (;;) {
        const dvec3 n = dice.direction();
        if (n.y > -0.3) return n;
    }
}

/// A clear sky with the sun behind a small window.
HardCase peak(Dice& dice) {
    HardCase hard{bare_scene(dice.coin() ? SkyModel::cie_clear_polluted : SkyModel::cie_clear), {}, {}};
    const double d = dice.between(1.5, 4);
    const double x = dice.between(-1, 1), z = dice.between(0.5, 3), w = dice.between(0.2, 0.6), h = dice.between(0.2, 0.6);
    add_window(hard, upright(x, x + w, z, z + h, d), dice.coin() ? 1 : 0);
    const dvec3 sun = glm::normalize(dvec3(x + dice.between(-0.3, 1.3) * w, d, z + dice.between(-0.3, 1.3) * h));
    hard.scene.sun = {.altitude_rad = std::asin(sun.z), .azimuth_rad = std::atan2(sun.x, sun.y)};
    hard.point = {{0, 0, 0}, towards_window(dice)};
    return hard;
}

/// A point millimetres from a glazed window.
HardCase near_pane(Dice& dice) {
    HardCase hard{bare_scene(dice.coin() ? SkyModel::moon_spencer : SkyModel::cie_clear), {}, {}};
    hard.scene.sun = {.altitude_rad = dice.between(0.2, 1.2), .azimuth_rad = dice.between(-1, 1)};
    const double d = std::pow(10.0, dice.between(-3, -2));
    add_window(hard, upright(dice.between(-1, 0.2), dice.between(0.3, 1), dice.between(-1, 0.1), dice.between(0.2, 1), d),
               dice.coin() ? 1 : 2);
    hard.point = {{0, 0, 0}, towards_window(dice)};
    return hard;
}

/// A long bright facade across the line of sight, nearly edge on.
HardCase grazing_facade(Dice& dice) {
    HardCase hard{bare_scene(SkyModel::moon_spencer), {}, {}};
    const double d = dice.between(0.5, 3);
    add_window(hard, upright(-1, 1, 0, 1.5, d));
    const double x = dice.between(-1, 1), slant = dice.between(-0.3, 0.3), top = dice.between(2, 20);
    add_screen(hard, {{x + 0.1, d + 0.5, -10}, {x + 0.1, d + 0.5, top}, {x + slant * 50, d + 50, top}, {x + slant * 50, d + 50, -10}}, true);
    // The lit side is the one the point sees.
    auto& polygon = hard.scene.polygons[0].vertices_m;
    const dvec3 normal = glm::cross(polygon[1] - polygon[0], polygon[2] - polygon[0]);
    if (glm::dot(normal, polygon[0]) > 0.0) std::reverse(polygon.begin(), polygon.end());
    hard.scene.grid.outdoor_spacing_m = 10.0;
    hard.point = {{0, 0, 0}, towards_window(dice)};
    return hard;
}

/// Screens of random shape in front of a window.
HardCase partly_blocked(Dice& dice) {
    HardCase hard{bare_scene(dice.coin() ? SkyModel::moon_spencer : SkyModel::cie_clear), {}, {}};
    hard.scene.sun = {.altitude_rad = dice.between(0.2, 1.2), .azimuth_rad = dice.between(-1, 1)};
    const double d = dice.between(0.7, 4);
    add_window(hard, upright(-1, 1, -0.2, 1.3, d), dice.coin() ? 1 : 0);
    for (int k = 0; k < 3; ++k) {
        const double depth = dice.between(0.3, 1.5), x = dice.between(-1, 1), z = dice.between(0, 1.2), r = dice.between(0.08, 0.5);
        const int corners = 3 + static_cast<int>(dice.between(0, 4));
        const double turn = dice.between(0, 6);
        std::vector<dvec3> outline;
        for (int c = 0; c < corners; ++c) {
            const double angle = turn + 2 * pi * c / corners;
            outline.push_back(depth * dvec3(x + r * std::cos(angle), d, z + r * std::sin(angle)));
        }
        add_screen(hard, outline);
    }
    hard.point = {{0, 0, 0}, towards_window(dice)};
    return hard;
}

/// Triangles, an L, a slanted ring: glazed, under a clear sky.
HardCase shapes(Dice& dice) {
    HardCase hard{bare_scene(SkyModel::cie_clear), {}, {}};
    hard.scene.sun = {.altitude_rad = dice.between(0.2, 1.2), .azimuth_rad = dice.between(-1, 1)};
    const double kind = dice.between(0, 3);
    std::vector<dvec3> flat;
    if (kind < 1) flat = {{-1, 0, -0.5}, {1, 0, -0.3}, {dice.between(-1, 1), 0, 1}};
    else flat = {{-1, 0, -1}, {1, 0, -1}, {1, 0, -0.2}, {0.1, 0, -0.2}, {0.1, 0, 0.9}, {-1, 0, 0.9}};
    const double tilt = dice.between(-0.5, 1.5), turn = dice.between(-1, 1), d = dice.between(0.3, 3);
    const auto place = [&](const dvec3& p) {
        const dvec3 tilted{p.x, -p.z * std::sin(tilt), p.z * std::cos(tilt)};
        return dvec3(tilted.x * std::cos(turn) - tilted.y * std::sin(turn), d + tilted.x * std::sin(turn) + tilted.y * std::cos(turn),
                     dice.between(0, 0) + 0.6 + tilted.z);
    };
    std::vector<dvec3> outline;
    for (const dvec3& p : flat) outline.push_back(place(p));
    add_window(hard, outline, dice.coin() ? 1 : 2);
    if (kind >= 2) {
        std::vector<dvec3> hole;
        for (const dvec3& p : {dvec3{-0.8, 0, -0.8}, dvec3{-0.2, 0, -0.8}, dvec3{-0.2, 0, 0.5}}) hole.push_back(place(p));
        hard.scene.apertures[0].holes_m = {hole};
    }
    // Somewhere on the room's side of it.
    const dvec3 normal = glm::normalize(glm::cross(outline[1] - outline[0], outline[2] - outline[0]));
    const dvec3 middle = (outline[0] + outline[1] + outline[2]) / 3.0;
    dvec3 position;
    do position = middle + dice.between(0.3, 3) * dice.direction();
    while (glm::dot(normal, position - outline[0]) < 0.1);
    hard.point = {position, glm::normalize(middle - position + 0.7 * dice.direction() * glm::length(middle - position))};
    return hard;
}

/// Double glazing seen nearly edge on.
HardCase grazing_glass(Dice& dice) {
    HardCase hard{bare_scene(SkyModel::cie_clear), {}, {}};
    hard.scene.sun = {.altitude_rad = dice.between(0.2, 1.2), .azimuth_rad = dice.between(-1.4, 1.4)};
    const double x = dice.between(0.05, 2);
    add_window(hard, upright(x, x + 1.5, dice.between(-0.5, 0.2), 1.3, dice.between(0.01, 0.2)), 2);
    hard.point = {{0, 0, 0}, towards_window(dice)};
    return hard;
}

/// A window behind slender bars.
HardCase bars(Dice& dice) {
    HardCase hard{bare_scene(SkyModel::moon_spencer), {}, {}};
    const double d = dice.between(0.3, 4);
    add_window(hard, upright(-1, 1, 0.1, 1.6, d));
    for (int k = 0; k < 4; ++k) {
        const double x = -0.9 + 0.5 * k + dice.between(0, 0.1), w = dice.between(0.03, 0.08);
        add_screen(hard, upright(x, x + w, 0.1, 1.6, d - 0.01));
    }
    hard.point = {{dice.between(-0.5, 0.5), 0, dice.between(0, 1)}, towards_window(dice)};
    return hard;
}

/// Four glazed windows in a wall 30 cm thick, a desk and a building opposite.
HardCase office(Dice& dice) {
    HardCase hard{bare_scene(SkyModel::cie_clear), {}, {}};
    hard.scene.sun = {.altitude_rad = dice.between(0.2, 1.2), .azimuth_rad = dice.between(-1, 1)};
    hard.point = {{dice.between(-4, 4), dice.between(-6, -0.3), 0.85}, {0, 0, 1}};
    const double desk = dice.between(-3, 3);
    add_screen(hard, upright(desk, desk + 1.5, 0.9, 1.4, 0.5 * hard.point.position_m.y));
    for (int k = 0; k < 4; ++k) {
        const double x0 = -4.5 + 2.4 * k, x1 = x0 + 1.7, z0 = 0.9, z1 = 2.4;
        add_window(hard, upright(x0, x1, z0, z1, 0.3), 2);
        add_screen(hard, {{x0, 0, z0}, {x0, 0, z1}, {x0, 0.3, z1}, {x0, 0.3, z0}});
        add_screen(hard, {{x1, 0, z0}, {x1, 0.3, z0}, {x1, 0.3, z1}, {x1, 0, z1}});
        add_screen(hard, {{x0, 0, z1}, {x1, 0, z1}, {x1, 0.3, z1}, {x0, 0.3, z1}});
        add_screen(hard, {{x0, 0, z0}, {x0, 0.3, z0}, {x1, 0.3, z0}, {x1, 0, z0}});
    }
    // The wall between the windows, as seen: all there is in the plane y = 0 but the openings.
    add_screen(hard, upright(-50, 50, 2.4, 30, 0));
    add_screen(hard, upright(-50, 50, -30, 0.9, 0));
    for (int k = 0; k < 5; ++k) {
        add_screen(hard, upright(k == 0 ? -50 : -4.5 + 2.4 * (k - 1) + 1.7, k == 4 ? 50 : -4.5 + 2.4 * k, 0.9, 2.4, 0));
    }
    // Its lit side is the south.
    const double left = dice.between(-15, 0), right = left + dice.between(5, 20), top = dice.between(5, 15);
    add_screen(hard, upright(left, right, -10, top, dice.between(8, 20)), true);
    hard.scene.grid.outdoor_spacing_m = 30.0;
    return hard;
}

struct Family {
    const char* name;
    HardCase (*make)(Dice&);
};
constexpr std::array<Family, 8> families{{{"sun behind a small window", peak},
                                          {"millimetres from a pane", near_pane},
                                          {"facade edge on", grazing_facade},
                                          {"partly blocked", partly_blocked},
                                          {"triangles, L, holes, slants", shapes},
                                          {"glass at grazing incidence", grazing_glass},
                                          {"glazing bars", bars},
                                          {"office, 4 windows", office}}};

/// Counts the directions asked for.
class CountedVisibility final : public Visibility {
public:
    explicit CountedVisibility(const Building& building) : exact_(building) {}
    std::string_view name() const noexcept override { return "counted"; }
    std::vector<std::pair<std::string, std::string>> settings() const override { return {}; }
    void first_seen(const GatherPoint& from, std::span<const dvec3> directions, std::span<FacetId> seen) const override {
        rays += directions.size();
        exact_.first_seen(from, directions, seen);
    }
    void form_factor_row(PatchId from, FormFactorRow& row) const override { exact_.form_factor_row(from, row); }
    void gather_row(const GatherPoint& from, FormFactorRow& row) const override { exact_.gather_row(from, row); }
    void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const override {
        exact_.view_facets(camera, row_begin, row_end, seen);
    }

    mutable std::size_t rays = 0;

private:
    BruteForceVisibility exact_;
};

/// Relative errors of all cases of a family, increasing, and the mean number of directions.
struct Outcome {
    std::vector<double> errors;
    std::vector<std::uint64_t> seeds;  ///< same order
    double rays = 0.0;

    double quantile(double share) const {
        return errors[std::min(errors.size() - 1, static_cast<std::size_t>(share * static_cast<double>(errors.size())))];
    }
    double within(double tolerance) const {
        return static_cast<double>(std::upper_bound(errors.begin(), errors.end(), tolerance) - errors.begin()) /
               static_cast<double>(errors.size());
    }
};

struct PreparedCase {
    HardCase hard;
    Building building;
    PatchGrid grid;
    double expected_lx = 0.0;
    std::uint64_t seed = 0;
};

std::vector<PreparedCase> prepare(const Family& family, std::uint64_t first_seed, std::uint64_t count) {
    std::vector<PreparedCase> cases;
    for (std::uint64_t seed = first_seed; cases.size() < count; ++seed) {
        Dice dice(seed);
        PreparedCase prepared{.hard = family.make(dice), .building = {}, .grid = {}, .seed = seed};
        const Scene& scene = prepared.hard.scene;
        prepared.building = assemble(scene);
        prepared.grid = make_patch_grid(prepared.building, scene.grid);
        const SunDescription sun = scene.sun.value_or(SunDescription{.altitude_rad = 1.0});
        const Sky sky(scene.sky, direction_from_angles(sun.altitude_rad, sun.azimuth_rad));
        const double ground_cd_m2 = 0.2 * sky.horizontal_illuminance().value / pi;
        double unobstructed_lx = 0.0;
        for (const AperturePolygon& aperture : scene.apertures) {
            const GlazingTransmission glazing(scene.glazings[index(aperture.glazing)]);
            const dvec3 normal = glm::normalize(glm::cross(aperture.vertices_m[1] - aperture.vertices_m[0],
                                                           aperture.vertices_m[2] - aperture.vertices_m[0]));
            const auto through = [&](const dvec3& d) { return glazing.transmittance(std::abs(glm::dot(normal, d))).g; };
            std::vector<Blocker> blockers = prepared.hard.blockers;
            for (Blocker& blocker : blockers) {
                if (blocker.luminance_cd_m2)
                    blocker.luminance_cd_m2 = [&through, own = blocker.luminance_cd_m2](const dvec3& d) { return through(d) * own(d); };
            }
            const LuminanceOf behind = [&](const dvec3& d) {
                return through(d) * (d.z >= 0.0 ? sky.luminance(d).value : ground_cd_m2);
            };
            const PlaneOpening opening{aperture.vertices_m, aperture.holes_m};
            prepared.expected_lx += illuminance_by_clipping(prepared.hard.point, opening, blockers, behind);
            unobstructed_lx += illuminance_by_clipping(prepared.hard.point, opening, {}, behind);
        }
        // What is nearly dark is not held to a relative tolerance (docs/method.md, "Direct illuminance").
        if (prepared.expected_lx > 0.02 * unobstructed_lx && prepared.expected_lx > 1e-6) cases.push_back(std::move(prepared));
    }
    return cases;
}

Outcome run(std::vector<PreparedCase>& cases, double tolerance) {
    std::vector<std::pair<double, std::uint64_t>> found;
    Outcome outcome;
    for (PreparedCase& prepared : cases) {
        Scene& scene = prepared.hard.scene;
        scene.direct.tolerance = tolerance;
        const CountedVisibility visibility(prepared.building);
        NoProgress progress;
        const OutdoorLight outdoors = light_outdoors(scene, prepared.building, prepared.grid, visibility, progress);
        const DirectLight direct(scene, prepared.building, prepared.grid, outdoors, visibility);
        visibility.rays = 0;
        const double lx = direct.without_sun(prepared.hard.point).by_source().total().g;
        found.emplace_back(std::abs(lx / prepared.expected_lx - 1.0), prepared.seed);
        outcome.rays += static_cast<double>(visibility.rays) / static_cast<double>(cases.size());
    }
    std::sort(found.begin(), found.end());
    for (const auto& [error, seed] : found) outcome.errors.push_back(error), outcome.seeds.push_back(seed);
    return outcome;
}

/// share: of the points that must be within the tolerance; none may be five tolerances off.
void check_families(std::uint64_t first_seed, std::uint64_t count, double share, std::initializer_list<double> tolerances, bool print) {
    if (print) std::printf("%-28s %8s %7s %9s %9s %9s %9s %7s %5s\n", "", "tol", "within", "median", "90 %", "99 %", "worst", "rays", "seed");
    for (const Family& family : families) {
        std::vector<PreparedCase> cases = prepare(family, first_seed, count);
        for (const double tolerance : tolerances) {
            const Outcome outcome = run(cases, tolerance);
            if (print) {
                std::printf("%-28s %8g %6.1f%% %9.2g %9.2g %9.2g %9.2g %7.0f %5d\n", family.name, tolerance,
                            100 * outcome.within(tolerance), outcome.quantile(0.5), outcome.quantile(0.9),
                            outcome.quantile(0.99), outcome.errors.back(), outcome.rays, static_cast<int>(outcome.seeds.back()));
                std::fflush(stdout);
            }
            INFO(family.name << ", tolerance " << tolerance << ", worst " << outcome.errors.back() << " at seed "
                             << outcome.seeds.back() << ", " << outcome.rays << " rays");
            CHECK(outcome.within(tolerance) >= share);
            CHECK(outcome.within(5.0 * tolerance) == 1.0);
        }
    }
}

}  // namespace

TEST_CASE("hard points are within the tolerance of direct light as often as documented", "[direct][accuracy]") {
    check_families(0, 4, 1.0, {1e-2, 1e-3}, false);
}

TEST_CASE("many hard points are within the tolerance of direct light as often as documented", "[direct][accuracy][slow]") {
    // The constants of the method were found on seeds 0 to 200. At 1e-4 a few elements where light jumps in its slope, as between the
    // patches of a facade, are less smooth than they look.
    check_families(10000, 200, 0.99, {1e-2, 1e-3}, true);
    check_families(10000, 200, 0.95, {1e-4}, true);
}
