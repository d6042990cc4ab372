#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "tests/catch.h"
#include "tests/cli/program.h"
#include "tests/cli/xml.h"

using namespace naturel::tests;

namespace {

struct Change {
    std::string_view before, after;
};

/// The small room with pieces of its text replaced, and what `naturel zones` makes of it.
class ZonedRoom {
public:
    explicit ZonedRoom(const std::vector<Change>& changes = {}) {
        std::string text(small_room);
        for (const auto& [before, after] : changes) {
            const std::size_t position = text.find(before);
            REQUIRE(position != std::string::npos);
            text.replace(position, before.size(), after);
        }
        write(scene(), text);
    }

    std::string scene() const { return (folder_ / "room.json").string(); }
    std::filesystem::path out() const { return folder_ / "out"; }

    Outcome zones(std::vector<std::string> arguments = {}) const {
        arguments.insert(arguments.begin(), {"zones", scene(), "--out", out().string()});
        return run_naturel(arguments);
    }
    nlohmann::json json() const { return nlohmann::json::parse(content_of(out() / "zones.json")); }
    std::string drawing(const char* name) const { return content_of(out() / name); }

private:
    TemporaryFolder folder_;
};

std::vector<std::string> names_below(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    for (const auto& [name, content] : files_below(folder))
        names.push_back(name);
    return names;
}

nlohmann::json face_named(const nlohmann::json& zones, const std::string& name) {
    for (const auto& face : zones["faces"])
        if (face["name"] == name) return face;
    FAIL("no face " << name);
    return {};
}

/// The numbers of the first path of a class in the group with a title.
std::vector<double> path_numbers(const std::string& svg, const std::string& title,
                                 const std::string& css_class) {
    const std::size_t group = svg.find("<title>" + title + "</title>");
    const std::size_t path = svg.find("<path class=\"" + css_class + "\" d=\"", group);
    REQUIRE(group != std::string::npos);
    REQUIRE(path != std::string::npos);
    const std::size_t begin = svg.find(" d=\"", path) + 4;
    std::string data = svg.substr(begin, svg.find('"', begin) - begin);
    std::ranges::replace_if(
        data, [](char c) { return c == 'M' || c == 'L' || c == 'Z'; }, ' ');
    std::istringstream stream(data);
    std::vector<double> numbers;
    for (double number = 0.0; stream >> number;)
        numbers.push_back(number);
    return numbers;
}

}  // namespace

TEST_CASE("zones leaves zones.json, the drawings only on demand, and nothing else", "[cli]") {
    const ZonedRoom room;
    const Outcome outcome = room.zones();
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    CHECK(names_below(room.out()) == std::vector<std::string>{"zones.json"});
    const std::string before = content_of(room.out() / "zones.json");
    REQUIRE(room.zones({"--svg", "--grid-spacing", "0.4"}).exit_code == 0);
    CHECK(names_below(room.out()) ==
          std::vector<std::string>{"floor_1_plan.svg", "floor_1_walls.svg", "zones.json"});
    CHECK(content_of(room.out() / "zones.json") == before);  // zones do not depend on the grid
}

TEST_CASE("the sunspot and the umbra on the floor of a room lie where geometry says", "[cli]") {
    const ZonedRoom room;
    REQUIRE(room.zones().exit_code == 0);
    const auto zones = room.json();
    const auto floor = face_named(zones, "room/bottom");
    // The sun stands in the south. Its rays pass the upper edge of the aperture at y = 0, z = 2.5 and the
    // inner edge of the sill at y = 0.5, z = 1; the floor is at z = 0.2.
    const double tangent = std::tan(40.0 / 180.0 * std::numbers::pi),
                 sine = std::sin(40.0 / 180.0 * std::numbers::pi);
    const double near_m = 0.5 + 0.8 / tangent, far_m = 2.3 / tangent;
    REQUIRE(floor["sunspots"].size() == 1);
    const auto& spot = floor["sunspots"][0];
    CHECK(spot["aperture"] == "window");
    REQUIRE(spot["polygons"].size() == 1);
    CHECK(spot["polygons"][0]["holes"].empty());
    const auto& outer = spot["polygons"][0]["outer"];
    REQUIRE(outer.size() == 4);
    for (const auto& corner : outer) {
        const double x = corner[0], y = corner[1], z = corner[2];
        INFO(x << " " << y << " " << z);
        // Corners are rounded to the nanometre, twice.
        CHECK(std::min(std::abs(x - 1.0), std::abs(x - 3.0)) <= 2e-9);
        CHECK(std::min(std::abs(y - near_m), std::abs(y - far_m)) <= 2e-9);
        CHECK(z == 0.2);
    }
    // The area of corners that are off by 1 nm.
    CHECK(std::abs(spot["area_m2"].get<double>() - 2.0 * (far_m - near_m)) <= 1e-8);
    CHECK(floor["sunspot_area_m2"] == spot["area_m2"]);

    // Clear glass under 40 degrees lets through a little less than at right angles.
    const double transmittance = spot["transmittance"];
    CHECK(transmittance < 0.88);
    CHECK(transmittance > 0.85);
    CHECK(std::abs(spot["illuminance_lx"].get<double>() - 50000.0 * sine * transmittance) <= 1e-6);
    for (int band = 0; band < 3; ++band)
        CHECK(std::abs(spot["illuminance_rgb_lx"][band].get<double>() -
                       50000.0 * sine * spot["transmittance_rgb"][band].get<double>()) <= 1e-6);

    // From y = 0.5 to where the upper edge of the aperture rises over the sill, over the whole width.
    CHECK(std::abs(floor["umbra_area_m2"].get<double>() - 3.0 * 0.8 / 3.0) <= 1e-8);
    // A wall cannot see a window that lies behind it.
    const auto front = face_named(zones, "room/front");
    CHECK(front["umbra_area_m2"] == front["area_m2"]);
    // The rest of the front wall is one polygon around the way to the window.
    REQUIRE(front["umbra"].size() == 1);
    CHECK(front["umbra"][0]["holes"].size() == 1);
    CHECK(face_named(zones, "building/front")["environment"] == "outdoor");
}

TEST_CASE("what the sun gives to the surfaces of a room is what passes the glass", "[cli]") {
    const ZonedRoom room;
    REQUIRE(room.zones().exit_code == 0);
    const auto zones = room.json();
    const double transmittance = face_named(zones, "room/bottom")["sunspots"][0]["transmittance"];
    double flux_lm = 0.0, sunspot_m2 = 0.0, umbra_m2 = 0.0;
    for (const auto& face : zones["faces"]) {
        sunspot_m2 += face["sunspot_area_m2"].get<double>();
        umbra_m2 += face["umbra_area_m2"].get<double>();
        for (const auto& spot : face["sunspots"])
            flux_lm += spot["area_m2"].get<double>() * spot["illuminance_lx"].get<double>();
    }
    const auto& totals = zones["totals"];
    const double arriving_lm = totals["unobstructed_sun_flux_at_apertures_lm"];
    CHECK(std::abs(arriving_lm - 50000.0 * std::cos(40.0 / 180.0 * std::numbers::pi) * 3.0) <= 1e-6);
    // Outlines are rounded to 1 nm: 1e-8 m2 of 3 m2.
    CHECK(std::abs(flux_lm - transmittance * arriving_lm) <= 1e-8 * arriving_lm);
    CHECK(std::abs(totals["sun_flux_on_indoor_surfaces_lm"].get<double>() - flux_lm) <= 1e-12 * flux_lm);
    CHECK(std::abs(zones["apertures"][0]["sun_flux_on_indoor_surfaces_lm"].get<double>() - flux_lm) <=
          1e-12 * flux_lm);
    CHECK(std::abs(totals["sunspot_area_m2"].get<double>() - sunspot_m2) <= 1e-12);
    CHECK(std::abs(totals["umbra_area_m2"].get<double>() - umbra_m2) <= 1e-12);
}

TEST_CASE("the table of zones names faces, areas and illuminance", "[cli]") {
    const ZonedRoom room;
    const Outcome outcome = room.zones({"--quiet"});
    INFO(outcome.output);
    CHECK(outcome.errors.empty());
    CHECK(outcome.output.starts_with("small room: sun at altitude 40.0 deg, azimuth 180.0 deg, 50000 lx"));
    std::istringstream lines(outcome.output);
    bool found = false;
    for (std::string line; std::getline(lines, line);) {
        if (line.find("room/bottom") == std::string::npos) continue;
        found = true;
        std::istringstream cells(line);
        std::string face, area, sunspot, lx, umbra;
        cells >> face >> area >> sunspot >> lx >> umbra;
        CHECK(area == "9.000");
        CHECK(sunspot == "2.575");
        CHECK(std::abs(std::stod(lx) - 27883.0) <= 1.0);  // the test above knows where it comes from
        CHECK(umbra == "0.800");
    }
    CHECK(found);
    CHECK(outcome.output.find("building/") == std::string::npos);  // no zones outdoors
}

TEST_CASE("without a sun there are umbra zones and no sunspots", "[cli]") {
    const ZonedRoom night(std::vector<Change>{{"\"altitude_deg\": 40", "\"altitude_deg\": -10"}});
    const Outcome outcome = night.zones({"--svg"});
    REQUIRE(outcome.exit_code == 0);
    CHECK(outcome.output.find("the sun is below the horizon") != std::string::npos);
    const auto zones = night.json();
    CHECK(zones["sun"].is_null());
    CHECK(zones["totals"]["sunspot_area_m2"] == 0.0);
    CHECK(zones["totals"]["umbra_area_m2"].get<double>() > 5.0);
    CHECK(night.drawing("floor_1_plan.svg").find("class=\"sun\"") == std::string::npos);
}

TEST_CASE("drawings are well-formed, named, and without a number that is none", "[cli]") {
    const ZonedRoom room({{"\"name\": \"small room\"", "\"name\": \"a < b & \\\"c\\\"\\uffff \\u00e9\""},
                          {"\"id\": \"window\"", "\"id\": \"w<&>\""}});
    const Outcome outcome = room.zones({"--svg"});
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    for (const char* name : {"floor_1_plan.svg", "floor_1_walls.svg"}) {
        INFO(name);
        const std::string svg = room.drawing(name);
        CHECK(xml_fault(svg).empty());
        CHECK(svg.find("viewBox=\"0 0 ") != std::string::npos);
        CHECK(svg.find("<title id=\"title\">a &lt; b &amp; &quot;c&quot;\xef\xbf\xbd \xc3\xa9:") !=
              std::string::npos);
        CHECK(svg.find("<desc id=\"description\">") != std::string::npos);
        for (const char* not_a_number : {"nan", "inf"})
            for (const char* before : {"\"", " ", "M", "L"})
                CHECK(svg.find(std::string(before) + not_a_number) == std::string::npos);
    }
    CHECK(room.drawing("floor_1_plan.svg").find("w&lt;&amp;&gt;</text>") != std::string::npos);
}

TEST_CASE("a plan is drawn to the scale it states, with illuminance, grid and sensors", "[cli]") {
    const ZonedRoom room;
    REQUIRE(room.zones({"--svg"}).exit_code == 0);
    const std::string plan = room.drawing("floor_1_plan.svg");
    const std::size_t at = plan.find("scale 1:");
    REQUIRE(at != std::string::npos);
    const double mm_per_m = 1000.0 / std::stod(plan.substr(at + 8));
    const std::vector<double> numbers = path_numbers(plan, "room/bottom", "sun");
    REQUIRE(numbers.size() == 8);
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (std::size_t k = 0; k < numbers.size(); k += 2) {
        left = std::min(left, numbers[k]), right = std::max(right, numbers[k]);
        top = std::min(top, numbers[k + 1]), bottom = std::max(bottom, numbers[k + 1]);
    }
    const double area_mm2 =
        face_named(room.json(), "room/bottom")["sunspot_area_m2"].get<double>() * mm_per_m * mm_per_m;
    // Coordinates are printed to the micrometre.
    CHECK(std::abs(right - left - 2.0 * mm_per_m) <= 0.002);
    CHECK(std::abs((right - left) * (bottom - top) - area_mm2) <= 0.002 * 60.0);
    CHECK(plan.find("27\xc2\xa0"
                    "900 lx") != std::string::npos);
    CHECK(path_numbers(plan, "room/bottom", "grid").size() >= 2 * 4 * 9);  // at least 3 x 3 cells
    CHECK(plan.find("sensors: ") != std::string::npos);
    // The section shows the walls with the way to the window cut out.
    CHECK(path_numbers(plan, "section at z = 1.20 m", "cut").size() >= 2 * 8);
    CHECK(plan.find("<title>window</title>") != std::string::npos);
    // The umbra of the front wall is on the sheet of the walls.
    CHECK_FALSE(path_numbers(room.drawing("floor_1_walls.svg"), "room/front", "umbra").empty());
}

TEST_CASE("every floor gets its plan, furniture and sills do not make one", "[cli]") {
    // A second room over the first one, and in it a cupboard of 2.1 m, too low over its top to stand on it.
    const ZonedRoom house(
        {{"[0, 4, 0], [0, 0, 3]", "[0, 4, 0], [0, 0, 6]"},
         {"{\"id\": \"window\"",
          "{\"id\": \"upper room\", \"kind\": \"parallelepiped\", \"effect\": \"carve\", \"material\": "
          "\"wall\","
          "\"vertices\": [[0.5, 0.5, 3.2], [3.5, 0.5, 3.2], [0.5, 3.5, 3.2], [0.5, 0.5, 5.7]]},"
          "{\"id\": \"cupboard\", \"kind\": \"parallelepiped\", \"effect\": \"fill\", \"material\": \"wall\","
          "\"vertices\": [[0.5, 0.5, 3.2], [2.5, 0.5, 3.2], [0.5, 2.5, 3.2], [0.5, 0.5, 5.3]]},"
          "{\"id\": \"window\""}});
    REQUIRE(house.zones({"--svg"}).exit_code == 0);
    CHECK(names_below(house.out()) == std::vector<std::string>{"floor_1_plan.svg", "floor_1_walls.svg",
                                                               "floor_2_plan.svg", "floor_2_walls.svg",
                                                               "zones.json"});
    const std::string lower = house.drawing("floor_1_plan.svg"), upper = house.drawing("floor_2_plan.svg");
    CHECK(lower.find("floor 1 of 2 at z = 0.20 m") != std::string::npos);
    CHECK(upper.find("floor 2 of 2 at z = 3.20 m") != std::string::npos);
    CHECK(lower.find("<title>window/bottom</title>") != std::string::npos);  // the sill
    CHECK(lower.find("<title>upper room/bottom</title>") == std::string::npos);
    CHECK(upper.find("<title>cupboard/top</title>") != std::string::npos);
    // No window above: nothing there sees one.
    const auto upper_floor = face_named(house.json(), "upper room/bottom");
    CHECK(upper_floor["umbra_area_m2"] == upper_floor["area_m2"]);
}

TEST_CASE("zones and their drawings have the same bytes for any number of threads", "[cli]") {
    const ZonedRoom room;
    std::map<std::string, std::string> first;
    for (const char* threads : {"1", "2", "3"}) {
        INFO(threads << " threads");
        REQUIRE(room.zones({"--svg", "--threads", threads}).exit_code == 0);
        const auto files = files_below(room.out());
        if (first.empty()) first = files;
        CHECK((files == first));
    }
}

TEST_CASE("a run leaves the same zones.json as zones does", "[cli]") {
    const ZonedRoom room;
    REQUIRE(room.zones().exit_code == 0);
    const std::string zones = content_of(room.out() / "zones.json");
    std::filesystem::remove(room.out() / "zones.json");
    const Outcome outcome = run_naturel(
        {"run", room.scene(), "--out", room.out().string(), "--backend", "hemicube", "--cells", "16"});
    INFO(outcome.errors);
    REQUIRE(outcome.exit_code == 0);
    CHECK(content_of(room.out() / "zones.json") == zones);
}

TEST_CASE("zones that cannot be written, or drawn, end with exit code 3 and leave no other file", "[cli]") {
    const ZonedRoom room;
    const auto obstacle = room.out() / "zones.json";
    std::filesystem::create_directories(obstacle);
    const Outcome outcome = room.zones({"--svg"});
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.output.empty());
    CHECK(outcome.errors.find(obstacle.string()) != std::string::npos);
    CHECK(names_below(room.out()).empty());

    const ZonedRoom fine;
    const Outcome refused = fine.zones({"--svg", "--grid-spacing", "0.001"});
    CHECK(refused.exit_code == 3);
    CHECK(refused.errors.find("larger than 0.001 m") != std::string::npos);
    CHECK(names_below(fine.out()).empty());
}
