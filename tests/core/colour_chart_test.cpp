#include <cmath>
#include <cstdlib>

#include "core/daylight.h"
#include "core/picture.h"
#include "core/scene_reader.h"
#include "core/tone_mapping.h"
#include "core/view.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using namespace naturel::tests;

TEST_CASE("the pixels of the colour chart are its 8-bit values", "[scenes][picture][colour]") {
    Scene scene = read_scene(NATUREL_SOURCE_DIR "/scenes/colour_chart.json");
    const Backend backend = GENERATE(from_range(all_backends()));
    if (backend.name.find("single") != std::string::npos) return;  // the same path as the hemi-cube
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building));
    const auto visibility = backend.make(building, grid);
    NoProgress progress;
    const DaylightSolution solution = compute_daylight(scene, building, grid, *visibility, {}, progress);
    View& view = scene.views[0];
    const Picture picture = draw_view(scene, building, grid, *visibility, solution, view, progress);
    const Primaries primaries(scene.primaries);
    const ScreenPicture screen = map_to_screen(picture, primaries, view.picture, grey(1.0));

    const CsvTable expected = read_csv("macbeth24_d65.csv");
    const double width = view.width, height = view.height;
    const double pixels_per_m = 0.5 * width / std::tan(0.5 * view.field_of_view_rad) / 1.79;  // eye to tiles
    int worst = 0;
    for (std::size_t swatch = 0; swatch < 24; ++swatch) {
        INFO(backend.name << ", " << expected.text(swatch, "name"));
        const double x_m = 0.75 + 0.25 * static_cast<double>(swatch % 6) + 0.125;
        const double z_m = 1.0 + 0.25 * static_cast<double>(3 - swatch / 6) + 0.125;
        // Middle and four places near the corners of the tile of 0.2 m.
        for (const auto& [dx, dz] : {std::pair{0.0, 0.0}, {-0.09, -0.09}, {0.09, -0.09}, {-0.09, 0.09}, {0.09, 0.09}}) {
            const auto column = static_cast<std::size_t>(0.5 * width + (x_m + dx - 1.5) * pixels_per_m);
            const auto row = static_cast<std::size_t>(0.5 * height - (z_m + dz - 1.5) * pixels_per_m);
            const auto pixel = srgb8(screen.linear_srgb[row * static_cast<std::size_t>(view.width) + column]);
            for (std::size_t band = 0; band < 3; ++band) {
                const char* const names[] = {"sR8", "sG8", "sB8"};
                const int gap = std::abs(pixel[band] - static_cast<int>(expected.number(swatch, names[band])));
                worst = std::max(worst, gap);
                CHECK(gap <= 1);
            }
        }
    }
    UNSCOPED_INFO("worst difference " << worst);
    CHECK(worst <= 1);
    // Only cyan leaves the sRGB gamut.
    for (const Material& material : scene.materials) {
        INFO(material.name);
        if (material.name == "cyan")
            CHECK(std::abs(material.desaturation.saturation_kept - 0.856) < 0.5e-3);
        else
            CHECK(material.desaturation.saturation_kept == 1.0);
    }
}

TEST_CASE("a room white in three bands is the grey room in each band, bit for bit", "[daylight][colour]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const auto solve = [&](const std::string& wall, const std::string& primaries) {
        const std::string text = R"({"naturel": 1, "primaries": ")" + primaries + R"(",
            "materials": {"wall": )" + wall + R"(, "glass": {"glazing": {"normal_transmittance": 0.8, "panes": 2}}},
            "polyhedra": [
              {"id": "shell", "kind": "parallelepiped", "effect": "fill", "material": "wall",
               "vertices": [[-0.2, -0.2, 0], [3.2, -0.2, 0], [-0.2, 4.2, 0], [-0.2, -0.2, 3]]},
              {"id": "room", "kind": "parallelepiped", "effect": "carve", "material": "wall",
               "vertices": [[0, 0, 0.2], [3, 0, 0.2], [0, 4, 0.2], [0, 0, 2.8]]},
              {"id": "window", "kind": "parallelepiped", "effect": "carve", "material": "wall", "glazing": "glass",
               "vertices": [[1, -0.4, 1], [2, -0.4, 1], [1, 0, 1], [1, -0.4, 2]]}],
            "sky": {"model": "moon_spencer", "horizontal_illuminance_lx": 10000},
            "sun": {"altitude_deg": 40, "azimuth_deg": 170, "direct_normal_illuminance_lx": 50000},
            "grid": {"spacing_m": 1, "outdoor_spacing_m": 3},
            "sensors": [{"id": "p", "points": [[1, 1, 0.9], [1.5, 3, 0.9]]}]})";
        const Scene scene = read_scene_text(text, "room.json");
        const Building building = assemble(scene);
        const PatchGrid grid = make_patch_grid(building, scene.grid, find_light_zones(scene, building));
        const auto visibility = backend.make(building, grid);
        NoProgress progress;
        return compute_daylight(scene, building, grid, *visibility, {}, progress);
    };
    const DaylightSolution plain = solve(R"({"reflectance": 0.62})", "ebu");
    const auto same = [&](const DaylightSolution& other) {
        REQUIRE(other.nodes.size() == plain.nodes.size());
        bool equal = true;
        const auto compare = [&](const Band3& a, const Band3& b) {
            equal = equal && a == b && a.r == a.g && a.g == a.b;
        };
        for (std::size_t k = 0; k < plain.nodes.size(); ++k)
            compare(other.nodes[k].total_lx(), plain.nodes[k].total_lx());
        for (std::size_t k = 0; k < plain.sensor_values.size(); ++k)
            compare(other.sensor_values[k].total_lx(), plain.sensor_values[k].total_lx());
        for (std::size_t k = 0; k < plain.radiosity.exitance_lm_m2.size(); ++k)
            compare(other.radiosity.exitance_lm_m2[k].total(), plain.radiosity.exitance_lm_m2[k].total());
        CHECK(equal);
    };
    same(plain);
    same(solve(R"({"rgb": [0.62, 0.62, 0.62]})", "srgb"));
    same(solve(R"({"xyY": [0.3127, 0.3290, 0.62]})", "p22"));
}
