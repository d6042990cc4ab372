#include "core/picture.h"

#include <cmath>
#include <cstring>
#include <functional>
#include <glm/geometric.hpp>

#include "core/isolines.h"
#include "core/parallel.h"
#include "core/scene_reader.h"
#include "core/sky_table.h"
#include "core/tone_mapping.h"
#include "core/view.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

using namespace naturel;
using namespace naturel::tests;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using glm::dvec3;

namespace {

/// A scene with a light on its nodes that nobody has computed: what pictures make of a solution does not depend on it.
struct Painted {
    Scene scene;
    Building building;
    PatchGrid grid;
    std::unique_ptr<Visibility> visibility;
    DaylightSolution solution;

    Painted(const Scene& description, const Backend& backend, const std::function<double(const PatchGrid&, const Node&)>& light_lx,
            bool zones = true)
        : scene(description),
          building(assemble(scene)),
          grid(make_patch_grid(building, scene.grid, zones ? find_light_zones(scene, building) : LightZones{})),
          visibility(backend.make(building, grid)),
          solution{.outdoors = light_outdoors(scene, building, grid, *visibility, quiet())} {
        for (const Node& node : grid.nodes) {
            solution.nodes.emplace_back();
            solution.nodes.back().direct.sky_lx = grey(light_lx(grid, node));
        }
        solution.radiosity.exitance_lm_m2.resize(grid.gather_patch_count);
    }

    Picture draw(const View& view) const { return draw_view(scene, building, grid, *visibility, solution, view, quiet()); }

    static NoProgress& quiet() {
        static NoProgress progress;
        return progress;
    }
};

Scene shipped(const std::string& name) {
    return read_scene(std::string(NATUREL_SOURCE_DIR) + "/scenes/" + name + ".json");
}

/// Smooth, and not the same anywhere.
double smooth_lx(const PatchGrid&, const Node& node) {
    return 100 + 10 * node.position_m.x + 7 * node.position_m.y + 3 * node.position_m.z;
}

View small(View view, int width, int samples) {
    view.height = std::max(1, view.height * width / view.width);
    view.width = width;
    view.samples = samples;
    return view;
}

}  // namespace

TEST_CASE("a pixel on a patch shows the luminance of light that is linear between its nodes", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = closed_room({3, 4, 2.5}, 0.6);
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 1}, {2, 0, 2}));
    scene.materials[0].exitance_lm_m2 = {3, 5, 7};
    scene.grid.spacing_m = 0.5;
    const Painted painted(scene, backend, smooth_lx);
    for (std::size_t p = 0; p < painted.grid.indoor_patch_count; p += 7) {
        const Patch& patch = painted.grid.patches[p];
        if (patch.corner_count != 4) continue;
        const dvec3 to_corner = painted.grid.polygon_of(make_id<PatchId>(p))[0] - patch.centroid_m, aside = glm::normalize(to_corner);
        for (const double share : {0.0, 0.5}) {
            for (const int samples : {1, 4}) {
                const dvec3 place_m = patch.centroid_m + share * to_corner;
                const View view{.id = "", .from_m = place_m + 0.05 * patch.normal + 0.03 * aside, .to_m = place_m,
                                .up = glm::cross(patch.normal, aside), .field_of_view_rad = 0.02, .width = 1, .height = 1, .samples = samples};
                const Picture picture = painted.draw(view);
                // Of a pixel of 1 mm, seen at a slant, the middle lies 1e-5 m beside its centre.
                const double expected_lx = smooth_lx(painted.grid, {.position_m = place_m});
                CHECK_THAT(picture.luminance_cd_m2[0].g, WithinRel((0.6 * expected_lx + 5) / pi, 1e-6));
                CHECK_THAT(picture.illuminance_lx[0].r, WithinRel(expected_lx, 1e-6));
                CHECK(picture.coverage[0] == 1.0f);
            }
        }
    }
}

TEST_CASE("interpolation stays linear up to the edges of a patch", "[picture][grid]") {
    const Scene scene = closed_room({3, 4, 2.5});
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.5});
    const auto polygon = grid.polygon_of(PatchId{0});
    const auto linear = [](const dvec3& p) { return 1 + 2 * p.x - 3 * p.y + p.z; };
    std::vector<double> weights(polygon.size());
    for (double share = 1e-3; share > 1e-15; share /= 3) {
        for (const double along : {0.1, 0.37, 0.5}) {
            const dvec3 point_m = polygon[0] + along * (polygon[1] - polygon[0]) + share * (polygon[3] - polygon[0]);
            grid.interpolation_weights(PatchId{0}, point_m, weights);
            double sum = 0;
            for (std::size_t k = 0; k < weights.size(); ++k) sum += weights[k] * linear(polygon[k]);
            // Closer than 1e-9 of its length a point counts as on the edge.
            CHECK(std::abs(sum - linear(point_m)) < 1e-7);
        }
    }
}

TEST_CASE("pixels of the sky show the sky model behind the glass", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = closed_room({3, 4, 2.5});
    scene.glazings.push_back({.name = "glass", .normal_transmittance = {0.8, 0.7, 0.6}});
    scene.polyhedra.push_back(box("window", Effect::carve, {0.5, -0.5, 0.5}, {2.5, 0, 2.4}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    scene.sky.model = SkyModel::cie_clear;
    scene.sun = SunDescription{.altitude_rad = 0.6, .azimuth_rad = 2.0, .direct_normal_illuminance_lx = 0.0};
    const Painted painted(scene, backend, smooth_lx);
    const GlazingTransmission glass(scene.glazings[1]);
    for (const ViewKind kind : {ViewKind::perspective, ViewKind::fisheye, ViewKind::panorama}) {
        const View view{.id = "", .kind = kind, .from_m = {1.2, 1, 1}, .to_m = {1.6, 0, 1.3}, .field_of_view_rad = 1.4, .width = 60, .height = 30, .samples = 1};
        const Picture picture = painted.draw(view);
        const Camera camera = make_camera(view);
        std::vector<FacetId> seen(60 * 30);
        painted.visibility->view_facets(camera, 0, 30, seen);
        INFO("kind " << static_cast<int>(kind));
        int sky = 0;
        for (int k = 0; k < 60 * 30; ++k) {
            const dvec3 direction = camera.ray(k % 60 + 0.5, k / 60 + 0.5).direction;
            if (seen[static_cast<std::size_t>(k)] != FacetId::none || direction.z < 0.0 || !camera.shows(k % 60 + 0.5, k / 60 + 0.5)) continue;
            ++sky;
            INFO("pixel " << k % 60 << ", " << k / 60);
            const double expected = painted.solution.outdoors.sky.luminance(direction).value * glass.transmittance(-direction.y).g;
            CHECK_THAT(picture.luminance_cd_m2[static_cast<std::size_t>(k)].g, WithinRel(expected, 1e-12));
        }
        CHECK(sky > 10);
    }
}

TEST_CASE("a pixel is the mean of its samples where light jumps within it", "[picture][embree]") {
    // A sky in steps, and a grid that knows nothing of the sun's spots, of which light is gathered.
    std::vector<double> steps;
    for (int k = 0; k < 145; ++k) steps.push_back(k % 2 == 0 ? 1000.0 : 5000.0);
    Scene scene = closed_room({3, 4, 2.5});
    scene.ground.reflectance = {};
    scene.polyhedra.push_back(box("window", Effect::carve, {0.5, -0.5, 0.9}, {2.5, 0, 2.2}));
    scene.sky = {.model = SkyModel::table, .table = std::make_shared<const SkyTable>(tregenza_patches(), steps, false)};
    scene.sun = SunDescription{.altitude_rad = 0.5, .azimuth_rad = 2.9, .direct_normal_illuminance_lx = 60000.0};
    scene.grid.spacing_m = 1.0;
    const auto dark = [](const PatchGrid&, const Node&) { return 0.0; };
    const Painted in_steps(scene, all_backends().back(), dark, false);
    scene.sky = {.model = SkyModel::uniform, .horizontal_illuminance_lx = 0.0};
    const Painted sun_alone(scene, all_backends().back(), dark, false);
    REQUIRE_FALSE(sun_alone.grid.follows_zones);
    constexpr int n = 3;
    const auto largest_gap = [&](const Painted& painted, View view, const auto& value_of) {
        view.samples = n;
        const Picture picture = painted.draw(view);
        view.samples = 1, view.width *= n, view.height *= n;
        const Picture samples = painted.draw(view);
        std::vector<double> mean(picture.coverage.size());
        for (int row = 0; row < view.height; ++row)
            for (int column = 0; column < view.width; ++column)
                mean[static_cast<std::size_t>(row / n * picture.width + column / n)] +=
                    value_of(samples, static_cast<std::size_t>(row * view.width + column)) / (n * n);
        double gap = 0.0, most = 0.0;
        for (std::size_t k = 0; k < mean.size(); ++k) {
            gap = std::max(gap, std::abs(value_of(picture, k) - mean[k]));
            most = std::max(most, mean[k]);
        }
        CHECK(most > 0.0);
        return gap / most;
    };
    const View to_sky{.id = "", .from_m = {1.5, 1, 1}, .to_m = {1.5, 0, 1.4}, .field_of_view_rad = 1.0, .width = 16, .height = 16};
    CHECK(largest_gap(in_steps, to_sky, [](const Picture& p, std::size_t k) { return p.luminance_cd_m2[k].g; }) < 1e-12);
    const View to_floor{.id = "", .from_m = {1.5, 3.5, 2}, .to_m = {1.5, 1.8, 0}, .field_of_view_rad = 0.5, .width = 8, .height = 8,
                        .quality = PictureQuality::gather};
    CHECK(largest_gap(sun_alone, to_floor, [](const Picture& p, std::size_t k) { return p.illuminance_lx[k].g; }) < 1e-12);
}

TEST_CASE("light does not bleed across edges of faces, furniture and sunspots", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    // A table against the wall that the sun shines on.
    Scene scene = closed_room({3, 4, 2.5});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 0.9}, {2, 0, 2.2}));
    scene.polyhedra.push_back(box("table", Effect::fill, {2.2, 1, 0.7}, {3, 2.5, 0.75}));
    scene.sun = SunDescription{.altitude_rad = 0.5, .azimuth_rad = 3.9, .direct_normal_illuminance_lx = 50000.0};
    scene.grid.spacing_m = 0.5;
    // Each face has its own light, and another one in the sun.
    const auto light_of = [](FaceId face, bool sunny) { return static_cast<double>(1 + index(face)) + (sunny ? 1000.0 : 0.0); };
    const Painted painted(scene, backend, [&](const PatchGrid&, const Node& node) { return light_of(node.face, node.sunspot != no_sunspot); });
    const View view{.id = "", .from_m = {0.4, 0.5, 1.6}, .to_m = {2.8, 2, 0.7}, .field_of_view_rad = 1.5, .width = 160, .height = 120, .samples = 1};
    const Picture picture = painted.draw(view);
    int in_sun = 0, wrong = 0;
    std::vector<FacetId> seen(160 * 120);
    painted.visibility->view_facets(make_camera(view), 0, 120, seen);
    for (std::size_t k = 0; k < seen.size(); ++k) {
        if (seen[k] == FacetId::none || painted.building.facets[index(seen[k])].environment == Environment::outdoor) continue;
        const FaceId face = painted.building.facets[index(seen[k])].face;
        const double found = picture.illuminance_lx[k].g;
        const bool sunny = std::abs(found - light_of(face, true)) < 1e-9;
        in_sun += sunny;
        wrong += !sunny && !(std::abs(found - light_of(face, false)) < 1e-9);
    }
    CHECK(wrong == 0);
    CHECK(in_sun > 50);
}

TEST_CASE("a plan shows walls that are cut in black, as large as they are", "[picture][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    // Rooms of 3 m x 4 m within walls of 0.3 m, with a door of 1 m through the south wall.
    Scene scene = closed_room({3, 4, 2.5});
    scene.polyhedra.push_back(box("door", Effect::carve, {1, -0.5, 0}, {2, 0, 2}));
    scene.polyhedra.push_back(box("cupboard", Effect::fill, {2, 3, 0}, {3, 4, 1.2}));
    const Painted painted(scene, backend, [](const PatchGrid&, const Node&) { return 100.0; });
    const auto black_m2 = [&](double z, SeeThrough see_through) {
        const View view{.id = "", .kind = ViewKind::parallel, .from_m = {1.5, 2, 8}, .to_m = {1.5, 2, 0}, .up = {0, 1, 0}, .width_m = 5,
                        .width = 50, .height = 60, .cut_planes = {{{0, 0, z}, {0, 0, 1}}}, .see_through = see_through};
        const Picture picture = painted.draw(view);
        // Pixels of 0.1 m, on whose outlines the walls lie.
        double area = 0;
        for (const Band3& luminance : picture.luminance_cd_m2) area += luminance == Band3{} ? 0.01 : 0.0;
        for (const float share : picture.coverage) CHECK(share == 1.0f);
        return area;
    };
    const double walls = 3.6 * 4.6 - 3 * 4 - 0.3 * 1;
    CHECK(std::abs(black_m2(1.0, SeeThrough::backs) - walls - 1) < 1e-9);
    CHECK(std::abs(black_m2(1.2, SeeThrough::backs) - walls) < 1e-9);  // its top lies in the plane and stays
    CHECK(std::abs(black_m2(1.3, SeeThrough::nothing) - walls) < 1e-9);
    CHECK(std::abs(black_m2(2.5, SeeThrough::backs) - walls - 0.3) < 1e-9);  // through the ceiling, which goes, and above the door
}

TEST_CASE("a parallel view from beside a building shows ground that is cut, not sky, under the ground", "[picture][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    // Walls of 0.3 m around a room from 1 m under the ground to 1.5 m over it.
    const Painted painted(closed_room({3, 4, 2.5}, 0.5, -1.0), backend, smooth_lx);
    const auto draw = [&](const dvec3& direction, std::vector<CutPlane> cut_planes, SeeThrough see_through) {
        return painted.draw({.id = "", .kind = ViewKind::parallel, .from_m = {1.5, -10, 1}, .to_m = dvec3{1.5, -10, 1} + direction, .width_m = 8,
                             .width = 80, .height = 80, .cut_planes = std::move(cut_planes), .see_through = see_through});
    };
    // Pixels of 0.1 m, on whose outlines ground and walls lie.
    const auto x_m = [](std::size_t pixel) { return -2.5 + 0.1 * (static_cast<double>(pixel % 80) + 0.5); };
    const auto z_m = [](std::size_t pixel) { return 5 - 0.1 * (static_cast<double>(pixel / 80) + 0.5); };
    const double horizon_cd_m2 = painted.solution.outdoors.sky.luminance({0, 1, 0}).value;
    const Picture elevation = draw({0, 1, 0}, {}, SeeThrough::nothing);
    const Picture section = draw({0, 1, 0}, {{{0, 2, 0}, {0, -1, 0}}}, SeeThrough::backs);
    int underground_room = 0;
    for (std::size_t k = 0; k < elevation.surface.size(); ++k) {
        INFO("x " << x_m(k) << ", z " << z_m(k));
        const bool beside = std::abs(x_m(k) - 1.5) > 1.8, in_room = std::abs(x_m(k) - 1.5) < 1.5 && z_m(k) > -1 && z_m(k) < 1.5;
        CHECK(elevation.coverage[k] == 1.0f);
        if (z_m(k) < 0) {
            CHECK(elevation.luminance_cd_m2[k] == Band3{});
            CHECK(elevation.shown[k] == PixelContent::solid);
        } else if (beside || z_m(k) > 1.8) {
            CHECK_THAT(elevation.luminance_cd_m2[k].g, WithinRel(horizon_cd_m2, 1e-12));
        }
        CHECK((section.shown[k] == PixelContent::indoors) == in_room);
        if (!in_room && z_m(k) < 0) CHECK(section.luminance_cd_m2[k] == Band3{});
        underground_room += in_room && z_m(k) < 0;
    }
    CHECK(underground_room == 300);
    // From above, the ground that lies before the picture's plane hides what is under it; from below there is only earth.
    const double ground_cd_m2 = painted.solution.outdoors.ground_luminance_cd_m2.total().g;
    const Picture from_above = draw({0, 1, -0.5}, {}, SeeThrough::nothing), from_below = draw({0, 1, 0.5}, {}, SeeThrough::nothing);
    for (std::size_t k = 75 * 80; k < from_above.surface.size(); ++k) {
        CHECK_THAT(from_above.luminance_cd_m2[k].g, WithinRel(ground_cd_m2, 1e-12));
        CHECK(from_below.shown[k] == PixelContent::solid);
    }
    // Nor does a basement show, whose near wall a ray that looks down a little would meet.
    const Picture down_a_little = draw({0, 1, -0.02}, {}, SeeThrough::nothing);
    for (std::size_t k = 51 * 80; k < down_a_little.surface.size(); ++k) CHECK_THAT(down_a_little.luminance_cd_m2[k].g, WithinRel(ground_cd_m2, 1e-12));
}

TEST_CASE("lines of equal value run over surfaces, not along outlines and edges of sunspots", "[picture][isolines][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const auto points_of_lines = [](const Picture& picture, double value_lx, bool by_surface) {
        std::vector<double> field;
        for (const Band3& band : picture.illuminance_lx) field.push_back(band.g);
        std::size_t points = 0;
        for (const Isoline& line : isolines(field, picture.width, picture.height, value_lx, by_surface ? std::span(picture.surface) : std::span<const std::uint32_t>{}))
            points += line.points.size();
        return points;
    };
    {
        Scene scene = closed_room({3, 4, 2.5});
        scene.polyhedra.push_back(box("box", Effect::fill, {1, 1.5, 0.6}, {2, 2, 1.2}));
        scene.grid.spacing_m = 0.5;
        const Painted painted(scene, backend, [](const PatchGrid&, const Node& node) {
            const dvec3& p = node.position_m;
            return p.x > 0.9 && p.x < 2.1 && p.y > 1.4 && p.y < 2.1 && p.z > 0.5 && p.z < 1.3 ? 1000.0 : 100 + 10 * p.z;
        });
        const Picture picture = painted.draw({.id = "", .from_m = {1.5, 0.2, 1.3}, .to_m = {1.5, 4, 1.3}, .field_of_view_rad = 1.5, .width = 160, .height = 120});
        CHECK(points_of_lines(picture, 500.0, false) > 50);
        CHECK(points_of_lines(picture, 500.0, true) == 0);
        // At z = 1.5 m on the far wall, 3 m wide in 3.8 m, and on both sides of the room.
        const double far_wall_pixels = 3 / 3.8 / (2 * std::tan(0.75)) * 160;
        CHECK(static_cast<double>(points_of_lines(picture, 115.0, true)) > far_wall_pixels);
    }
    Scene scene = closed_room({3, 4, 2.5});
    scene.polyhedra.push_back(box("window", Effect::carve, {1, -0.5, 0.9}, {2, 0, 2.2}));
    scene.sun = SunDescription{.altitude_rad = 0.5, .azimuth_rad = 3.9, .direct_normal_illuminance_lx = 50000.0};
    scene.grid.spacing_m = 0.5;
    const Painted painted(scene, backend, [](const PatchGrid&, const Node& node) { return node.sunspot != no_sunspot ? 1000.0 : 1.0; });
    const Picture picture = painted.draw({.id = "", .from_m = {0.4, 0.5, 1.6}, .to_m = {2.8, 2, 0.7}, .field_of_view_rad = 1.5, .width = 160, .height = 120});
    CHECK(points_of_lines(picture, 500.0, false) > 50);
    CHECK(points_of_lines(picture, 500.0, true) == 0);
}

TEST_CASE("an automatic exposure of rooms that are cut open knows neither walls nor what is around them", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const auto white_cd_m2 = [&](double wall_m, double width_m, const dvec3& normal) {
        Scene scene = closed_room({3, 4, 2.5});
        scene.polyhedra[0] = box("building", Effect::fill, dvec3(-wall_m), dvec3(3, 4, 2.5) + wall_m);
        scene.polyhedra.push_back(box("window", Effect::carve, {1, -wall_m - 0.1, 1}, {2, 0, 2}));
        const Painted painted(scene, backend, smooth_lx);
        const dvec3 middle_m{1.5, 2, 1.25};
        const Picture picture = painted.draw({.id = "", .kind = ViewKind::parallel, .from_m = middle_m + normal, .to_m = middle_m,
                                              .up = normal.z > 0 ? dvec3{0, 1, 0} : dvec3{0, 0, 1}, .width_m = width_m, .width = 150, .height = 150,
                                              .cut_planes = {{middle_m, normal}}, .see_through = SeeThrough::backs});
        return map_to_screen(picture, Primaries(PrimariesName::srgb), {}, grey(1.0)).white_luminance_cd_m2;
    };
    for (const dvec3& normal : {dvec3{0, 0, 1}, dvec3{1, 0, 0}}) {
        const double white = white_cd_m2(0.2, 5, normal);
        // The brightest hundredth of a floor or wall of 100 to 160 lx with reflectance 0.5.
        CHECK(white > 0.5 / pi * 100);
        CHECK(white < 0.5 / pi * 160);
        // One row of pixels of the room shifts the percentile by less than that.
        CHECK_THAT(white_cd_m2(1.5, 5, normal), WithinRel(white, 0.01));
        CHECK_THAT(white_cd_m2(0.2, 15, normal), WithinRel(white, 0.03));
    }
}

TEST_CASE("where all is cut away a picture is absent, as outside a fisheye", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Painted painted(closed_room({3, 4, 2.5}), backend, smooth_lx);
    View view{.id = "", .kind = ViewKind::fisheye, .from_m = {1.5, 2, 1}, .to_m = {1.5, 0, 1}, .field_of_view_rad = pi, .width = 20, .height = 20};
    Picture picture = painted.draw(view);
    CHECK(picture.coverage[0] == 0.0f);
    CHECK(picture.luminance_cd_m2[0] == Band3{});
    CHECK(std::isnan(picture.illuminance_lx[0].g));
    CHECK(picture.coverage[10 * 20 + 10] == 1.0f);
    int partly = 0;
    double shown = 0;
    for (const float share : picture.coverage) {
        partly += share > 0.0f && share < 1.0f;
        shown += static_cast<double>(share);
    }
    CHECK(partly > 20);
    CHECK_THAT(shown, WithinRel(100 * pi, 0.01));  // 16 samples a pixel along the rim
    view.cut_planes = {{{0, 1, 0}, {0, -1, 0}}};  // takes the south wall
    picture = painted.draw(view);
    CHECK(picture.coverage[10 * 20 + 10] == 0.0f);
    CHECK(picture.coverage[10 * 20 + 0] == 1.0f);
}

TEST_CASE("the sun gives a picture its illuminance at any size of pixels", "[picture][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    // A room without a roof.
    Scene scene = closed_room({3, 4, 2.5});
    scene.polyhedra.push_back(box("roof", Effect::carve, {-0.1, -0.1, 2.4}, {3.1, 4.1, 3}));
    scene.sun = SunDescription{.altitude_rad = 1.2, .azimuth_rad = 2.5, .direct_normal_illuminance_lx = 60000.0};
    scene.sky.horizontal_illuminance_lx = 0.0;
    const Painted painted(scene, backend, [](const PatchGrid&, const Node&) { return 0.0; });
    const dvec3 sun = painted.solution.outdoors.sun_direction;
    const auto sun_lx = [&](const View& view) {
        const Picture picture = painted.draw(view);
        const Camera camera = make_camera(view);
        double sum = 0;
        for (int row = 0; row < view.height; ++row)
            for (int column = 0; column < view.width; ++column)
                sum += picture.luminance_cd_m2[static_cast<std::size_t>(row * view.width + column)].g * pixel_solid_angle_sr(camera, column, row);
        return sum;
    };
    View view{.id = "", .from_m = {1.5, 2, 1}, .to_m = dvec3(1.5, 2, 1) + sun + dvec3(0.002, 0.001, 0), .width = 32, .height = 32};
    for (const double angle_deg : {60.0, 5.0, 1.0}) {
        view.field_of_view_rad = radians_from_degrees(angle_deg);
        // Pixels of 2 degrees to 2 minutes of arc: the disc is spread over samples, whose solid angles differ within a pixel.
        CHECK_THAT(sun_lx(view), WithinRel(60000.0, 2e-3));
    }
    view.kind = ViewKind::fisheye, view.field_of_view_rad = pi;
    CHECK_THAT(sun_lx(view), WithinRel(60000.0, 5e-3));
}

TEST_CASE("pictures of two methods differ in pixels on edges only", "[picture][embree]") {
    const std::string name = GENERATE("test_room", "furnished_office", "l_shaped_rooflight");
    const Scene scene = shipped(name);
    const Painted painted(scene, all_backends().front(), smooth_lx);
    for (const View& description : scene.views) {
        const View view = small(description, 60, 2), centres = small(description, 60, 1);
        INFO(name << ", " << view.id);
        const Picture first = painted.draw(view);
        std::vector<FacetId> seen(first.luminance_cd_m2.size());
        painted.visibility->view_facets(make_camera(centres), 0, view.height, seen);
        for (const Backend& backend : all_backends()) {
            const auto visibility = backend.make(painted.building, painted.grid);
            const Picture other = draw_view(scene, painted.building, painted.grid, *visibility, painted.solution, view, Painted::quiet());
            int within = 0;
            for (int row = 0; row < view.height; ++row) {
                for (int column = 0; column < view.width; ++column) {
                    const auto at = [&](int r, int c) { return static_cast<std::size_t>(r * view.width + c); };
                    if (first.luminance_cd_m2[at(row, column)] == other.luminance_cd_m2[at(row, column)]) continue;
                    bool edge = false;
                    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, view.height - 1); ++r)
                        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, view.width - 1); ++c)
                            edge = edge || seen[at(r, c)] != seen[at(row, column)];
                    within += !edge;
                }
            }
            INFO(backend.name);
            CHECK(within == 0);
        }
    }
}

TEST_CASE("pictures are the same bits for any number of threads", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Scene scene = shipped("furnished_office");
    const Painted painted(scene, backend, smooth_lx);
    for (const View& description : scene.views) {
        const View view = small(description, 30, 3);
        std::vector<Picture> pictures;
        for (const int threads : {1, 2, 3}) {
            const ThreadLimit limit(threads);
            pictures.push_back(painted.draw(view));
        }
        const auto same = [](const auto& a, const auto& b) { return std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0; };
        for (const Picture& picture : pictures) {
            CHECK(same(picture.luminance_cd_m2, pictures[0].luminance_cd_m2));
            CHECK(same(picture.illuminance_lx, pictures[0].illuminance_lx));
            CHECK(same(picture.coverage, pictures[0].coverage));
        }
    }
}

namespace {

Painted solved(const Scene& scene, const Backend& backend, const DaylightOptions& options = {}) {
    Painted painted(scene, backend, smooth_lx);
    painted.solution = compute_daylight(scene, painted.building, painted.grid, *painted.visibility, options, Painted::quiet());
    return painted;
}

/// Sum of L cos(theta) dOmega over a fisheye.
double illuminance_lx(const Picture& picture, const View& view) {
    const Camera camera = make_camera(view);
    double sum = 0;
    for (int row = 0; row < view.height; ++row) {
        for (int column = 0; column < view.width; ++column) {
            const auto pixel = static_cast<std::size_t>(row * view.width + column);
            const double cosine = std::max(0.0, glm::dot(camera.ray(column + 0.5, row + 0.5).direction, camera.forward));
            sum += picture.luminance_cd_m2[pixel].g * cosine * pixel_solid_angle_sr(camera, column, row) * static_cast<double>(picture.coverage[pixel]);
        }
    }
    return sum;
}

/// A sunny room with a window and a table against the wall, on a coarse grid.
Scene sunny_room() {
    Scene scene = closed_room({3, 4, 2.5});
    scene.glazings.push_back({.name = "glass", .normal_transmittance = {0.8, 0.7, 0.6}});
    scene.polyhedra.push_back(box("window", Effect::carve, {0.5, -0.5, 0.9}, {2.5, 0, 2.2}));
    scene.polyhedra.back().glazing = make_id<GlazingId>(1);
    scene.polyhedra.push_back(box("table", Effect::fill, {2.2, 1, 0.7}, {3, 2.5, 0.75}));
    scene.sky = {.model = SkyModel::cie_clear, .horizontal_illuminance_lx = 12000.0};
    scene.sun = SunDescription{.altitude_rad = 0.5, .azimuth_rad = 2.9, .direct_normal_illuminance_lx = 60000.0};
    scene.grid.spacing_m = 0.5;
    return scene;
}

}  // namespace

TEST_CASE("a fisheye picture adds up to the illuminance of a sensor at its eye", "[picture][embree][slow]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    if (backend.name == "single plane") return;  // its rows leave out what is below the rim
    // In the sun, and out of it; level, and up. The sun is a point: where the cosine falls fast, it should be that of the sun, not of
    // the middle of its pixel.
    Scene scene = sunny_room();
    scene.glazings[1].inner_reflectance = grey(0.2);
    scene.sensors = {{.id = "eye", .points = {{{1.3, 1.2, 1.1}, {0, -1, 0}}, {{0.4, 3, 1.2}, glm::normalize(dvec3(1, -1, 0))}, {{0.5, 3, 1.1}, {0, 0, 1}}}}};
    const Painted painted = solved(scene, backend);
    CHECK(painted.solution.sensor_values[0].direct.sun_lx.g > 10000);
    CHECK(painted.solution.sensor_values[1].direct.sun_lx.g == 0);
    for (std::size_t s = 0; s < 3; ++s) {
        const Sensor& sensor = painted.solution.sensors[s];
        for (const FisheyeProjection projection : {FisheyeProjection::equidistant, FisheyeProjection::equal_area}) {
            const View view{.id = "", .kind = ViewKind::fisheye, .projection = projection, .from_m = sensor.point.position_m,
                            .to_m = sensor.point.position_m + sensor.point.normal, .up = sensor.point.normal.z > 0.5 ? dvec3(0, 1, 0) : dvec3(0, 0, 1),
                            .field_of_view_rad = pi, .width = 100, .height = 100, .samples = 4};
            INFO("sensor " << s << ", projection " << static_cast<int>(projection));
            // What is asked for. Sampling of the window's outline at this size, and of the sensor's own rows, take most of it.
            CHECK_THAT(illuminance_lx(painted.draw(view), view), WithinRel(painted.solution.sensor_values[s].total_lx().g, 5e-3));
        }
    }
}

TEST_CASE("a pane adds what it sends back into the room, to who looks from there", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Painted painted(sunny_room(), backend, smooth_lx);
    const View inside{.id = "", .from_m = {1.5, 2, 1.55}, .to_m = {1.5, 0, 1.55}, .field_of_view_rad = 0.1, .width = 3, .height = 3, .samples = 2};
    View outside = inside;
    std::swap(outside.from_m, outside.to_m);
    outside.from_m.y = -2;
    const Band3 dark = painted.draw(inside).luminance_cd_m2[4], from_outside = painted.draw(outside).luminance_cd_m2[4];
    for (std::size_t p = painted.grid.indoor_patch_count; p < painted.grid.gather_patch_count; ++p)
        painted.solution.radiosity.exitance_lm_m2[p].sky = Band3{100 * pi, 200 * pi, 300 * pi};
    const Band3 bright = painted.draw(inside).luminance_cd_m2[4];
    // Exact but for the rounding of a sum of thousands of cd/m2.
    CHECK_THAT(bright.r - dark.r, WithinAbs(100, 1e-8));
    CHECK_THAT(bright.b - dark.b, WithinAbs(300, 1e-8));
    CHECK(painted.draw(outside).luminance_cd_m2[4] == from_outside);
}

TEST_CASE("a gathered pixel shows what a sensor at its point measures", "[picture][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = sunny_room();
    scene.grid.spacing_m = 1.0;
    const Painted painted = solved(scene, backend);
    const View view{.id = "", .from_m = {0.4, 3.4, 1.6}, .to_m = {2.6, 1, 0.5}, .field_of_view_rad = 1.3, .width = 9, .height = 7, .samples = 1,
                    .quality = PictureQuality::gather};
    const Picture picture = painted.draw(view);
    const Camera camera = make_camera(view);
    std::vector<FacetId> seen(9 * 7);
    painted.visibility->view_facets(camera, 0, 7, seen);
    std::vector<Sensor> sensors;
    std::vector<double> found_lx;
    for (int k = 0; k < 9 * 7; ++k) {
        const FacetId id = seen[static_cast<std::size_t>(k)];
        if (id == FacetId::none || painted.building.facets[index(id)].environment == Environment::outdoor) continue;
        const Facet& facet = painted.building.facets[index(id)];
        const Camera::Ray ray = camera.ray(k % 9 + 0.5, k / 9 + 0.5);
        const double distance_m = glm::dot(facet.normal, facet.vertices_m[0] - ray.origin_m) / glm::dot(facet.normal, ray.direction);
        sensors.push_back({.point = {ray.origin_m + distance_m * ray.direction + 1e-5 * facet.normal, facet.normal}});
        found_lx.push_back(picture.illuminance_lx[static_cast<std::size_t>(k)].g);
    }
    const std::vector<PointIlluminance> values =
        light_on_sensors(painted.scene, painted.building, painted.grid, *painted.visibility, painted.solution.outdoors,
                         painted.solution.radiosity, {}, sensors, Painted::quiet());
    REQUIRE(sensors.size() > 40);
    int in_sun = 0;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
        CHECK_THAT(found_lx[s], WithinRel(values[s].total_lx().g, 1e-9));
        in_sun += values[s].direct.sun_lx.g > 0.0;
    }
    CHECK(in_sun > 0);
}

TEST_CASE("on a coarse grid a gathered picture is nearer to that of a fine grid than an interpolated one", "[picture][embree][slow]") {
    // By one method: it is about the grid.
    const Backend backend = all_backends().back();
    Scene scene = sunny_room();
    scene.sun->direct_normal_illuminance_lx = 0.0;
    scene.grid.spacing_m = 0.1;
    View view{.id = "", .from_m = {0.4, 3.4, 1.6}, .to_m = {2.6, 1, 0.5}, .field_of_view_rad = 1.3, .width = 16, .height = 12, .samples = 1};
    const Picture fine = solved(scene, backend).draw(view);
    scene.grid.spacing_m = 1.0;
    const Painted coarse = solved(scene, backend);
    const auto error = [&](PictureQuality quality) {
        view.quality = quality;
        const Picture picture = coarse.draw(view);
        double sum = 0, all = 0;
        for (std::size_t k = 0; k < picture.luminance_cd_m2.size(); ++k) {
            sum += std::abs(picture.luminance_cd_m2[k].g - fine.luminance_cd_m2[k].g);
            all += fine.luminance_cd_m2[k].g;
        }
        return sum / all;
    };
    const double interpolated = error(PictureQuality::interpolated), gathered = error(PictureQuality::gather);
    INFO(interpolated << " " << gathered);
    CHECK(gathered < 0.25 * interpolated);
}
