#include "core/sky_levels.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/scene_reader.h"
#include "core/sky.h"
#include "core/sun.h"
#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A scene of one box; members: "sky" and what else there is, without a comma at the end.
Scene scene_with(const std::string& members) {
    return read_scene_text(R"({"naturel": 1, "materials": {"wall": {"reflectance": 0.5}},
        "polyhedra": [{"id": "box", "kind": "parallelepiped", "effect": "fill", "material": "wall",
                       "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}], )" + members + "}", "t.json");
}

double direct_normal_lx(const std::string& sky, const std::string& formula, double altitude_deg) {
    return scene_with(R"("sky": )" + sky + R"(, "sun": {"azimuth_deg": 180, "altitude_deg": )" + std::to_string(altitude_deg) +
                      R"(, "direct_normal_illuminance_lx": ")" + formula + "\"}")
        .sun->direct_normal_illuminance_lx;
}

const std::string plain_sky = R"({"model": "uniform", "horizontal_illuminance_lx": 1})";

/// A number that Kittler and Darula give of a type of sky. Counted from the end of the row: descriptions have commas in them.
double kittler_darula(int type, const std::string& column) {
    static const tests::CsvTable table = tests::read_csv("cie_general_sky_params.csv");
    const auto found = std::find(table.columns.begin(), table.columns.end(), column);
    const auto& row = table.rows.at(static_cast<std::size_t>(type - 1));
    return std::stod(*(row.end() - (table.columns.end() - found)));
}

SkyDescription standard_sky(int type) { return {.model = SkyModel::cie_general, .cie_type = type}; }

}  // namespace

TEST_CASE("the IES's clear sun has 83.8 klx at 30 degrees, and 127.5 exp(-0.21 / sin h) at any height", "[core][sky][sun]") {
    CHECK_THAT(direct_normal_lx(plain_sky, "ies_clear", 30.0), WithinAbs(83'800.0, 50.0));  // three digits published
    for (const double altitude_deg : {0.5, 5.0, 60.0, 90.0}) {
        const double expected = 127'500.0 * std::exp(-0.21 / std::sin(radians_from_degrees(altitude_deg)));
        CHECK_THAT(direct_normal_lx(plain_sky, "ies_clear", altitude_deg), WithinRel(expected, 1e-12));
    }
    CHECK(direct_normal_lx(plain_sky, "ies_clear", -5.0) == 0.0);
}

TEST_CASE("the sun of luminous turbidity 2.5 has 81.2 klx at 30 degrees, and less the hazier it is", "[core][sky][sun]") {
    CHECK_THAT(direct_normal_lx(plain_sky, "turbid", 30.0), WithinAbs(81'200.0, 50.0));  // three digits published; 2.5 unless given
    const auto hazy = [](double turbidity, double altitude_deg) {
        return direct_normal_lx(R"({"model": "uniform", "horizontal_illuminance_lx": 1, "turbidity": )" + std::to_string(turbidity) + "}",
                                "turbid", altitude_deg);
    };
    // At the zenith the air mass of Kasten and Young is 0.99971, one part in 10^4 of the logarithm below.
    CHECK_THAT(std::log(133'800.0 / hazy(4.0, 90.0)), WithinRel(4.0 / 9.943, 4e-4));
    double before = 1e9;
    for (const double turbidity : {1.5, 2.5, 6.0, 20.0}) {
        // Extinction is proportional to turbidity.
        CHECK_THAT(std::log(133'800.0 / hazy(turbidity, 20.0)) / turbidity, WithinRel(std::log(133'800.0 / hazy(2.0, 20.0)) / 2.0, 1e-12));
        CHECK(hazy(turbidity, 20.0) < before);
        before = hazy(turbidity, 20.0);
    }
    // Grazing: the air mass is 37.9 on the horizon, not endless.
    CHECK_THAT(turbid_direct_normal_lx(0.0, 2.0), WithinRel(133'800.0 * std::exp(-37.92 * 2.0 / (9.9 + 0.043 * 37.92)), 1e-3));
}

TEST_CASE("standard skies without a level have the zenith of Kittler and Darula", "[core][sky]") {
    for (int type = 1; type <= 15; ++type) {
        const auto number = [&](const char* column) { return kittler_darula(type, column); };
        for (const double altitude_deg : {5.0, 30.0, 60.0, 86.0, 87.0, 89.0, 90.0}) {
            INFO("type " << type << ", sun at " << altitude_deg);
            const double h = radians_from_degrees(std::min(altitude_deg, 87.0));  // the cosine below a line
            const double peak = std::pow(std::sin(h), number("KD_C")) / std::pow(std::cos(h), number("KD_D"));
            const auto zenith = [&](double turbidity) {
                const bool sunny = number("KD_A1") != 0.0;
                const double klx = sunny ? (number("KD_A1") * turbidity + number("KD_A2")) * std::sin(h) + 0.7 * (turbidity + 1) * peak + 0.04 * turbidity
                                         : number("KD_DvEv_typical") * (number("KD_B") * peak + number("KD_E") * std::sin(h));
                return 1000.0 * klx;
            };
            SkyDescription sky = standard_sky(type);
            const double altitude = radians_from_degrees(altitude_deg);
            CHECK_THAT(*formula_zenith_luminance_cd_m2(sky, altitude), WithinRel(zenith(number("KD_Tv_typical")), 1e-12));
            CHECK_THAT(Sky(sky, direction_from_angles(altitude, 1.0)).zenith_luminance().value, WithinRel(zenith(number("KD_Tv_typical")), 1e-9));
            sky.turbidity = 6.0;
            CHECK_THAT(*formula_zenith_luminance_cd_m2(sky, altitude), WithinRel(zenith(6.0), 1e-12));
        }
    }
}

TEST_CASE("a standard sky shows its sun from type 7 to 15, dimmed by the type's turbidity", "[core][sky][sun]") {
    for (int type = 1; type <= 16; ++type) {
        INFO("type " << type);
        const double found = *formula_direct_normal_lx(standard_sky(type), 0.5);
        const bool sunny = type >= 7 && type <= 15;
        CHECK(found == (sunny ? turbid_direct_normal_lx(0.5, kittler_darula(type, "KD_Tv_typical")) : 0.0));
        SkyDescription clear = standard_sky(type);
        clear.turbidity = 3.0;
        CHECK(*formula_direct_normal_lx(clear, 0.5) == (sunny ? turbid_direct_normal_lx(0.5, 3.0) : 0.0));
        const std::string model = R"({"model": "cie_general_)" + std::to_string(type) + "\"}";
        CHECK_THAT(direct_normal_lx(model, "from_sky", degrees_from_radians(0.5)), WithinRel(found, 1e-6));  // std::to_string: six decimals
    }
}

TEST_CASE("the diffuse light of standard skies is about the share of the light above the atmosphere that their type is known for", "[core][sky]") {
    // Dv/Ev of the sunless types, from which their zenith was fitted with the sun at 20 to 70 degrees: measured 3 % at most.
    for (const int type : {1, 2, 3, 4, 5, 6}) {
        for (const double altitude_deg : {20.0, 45.0, 70.0}) {
            INFO("type " << type << ", sun at " << altitude_deg);
            const double altitude = radians_from_degrees(altitude_deg);
            const double diffuse_lx = Sky(standard_sky(type), direction_from_angles(altitude, 0.0)).horizontal_illuminance().value;
            CHECK_THAT(diffuse_lx / (133'800.0 * std::sin(altitude)), WithinRel(kittler_darula(type, "KD_DvEv_typical"), 0.05));
        }
    }
}

TEST_CASE("a sky's own sun stops at its highest altitude, the sun itself goes on", "[core][sky][sun]") {
    const auto scene = [](const std::string& highest, double altitude_deg) {
        return scene_with(R"("sky": {"model": "cie_clear", "horizontal_illuminance_lx": 10000)" + highest + R"(},
            "sun": {"azimuth_deg": 120, "altitude_deg": )" + std::to_string(altitude_deg) + R"(, "direct_normal_illuminance_lx": 1})");
    };
    const auto sky_of = [](const Scene& s) { return Sky(s.sky, direction_from_angles(s.sun->altitude_rad, s.sun->azimuth_rad)); };
    const Scene limited = scene(R"(, "highest_sun_deg": 60)", 80.0);
    CHECK_THAT(limited.sun->altitude_rad, WithinRel(radians_from_degrees(80.0), 1e-12));
    const Sky at_limit = sky_of(scene("", 60.0)), stopped = sky_of(limited), free = sky_of(scene("", 80.0));
    const Sky below = sky_of(scene(R"(, "highest_sun_deg": 60)", 50.0)), below_free = sky_of(scene("", 50.0));
    for (const double azimuth_deg : {0.0, 120.0, 200.0}) {
        const glm::dvec3 d = direction_from_angles(0.9, radians_from_degrees(azimuth_deg));
        CHECK_THAT(stopped.luminance(d).value, WithinRel(at_limit.luminance(d).value, 1e-6));  // fast_acos
        CHECK(std::abs(free.luminance(d).value / at_limit.luminance(d).value - 1.0) > 0.01);
        CHECK(below.luminance(d).value == below_free.luminance(d).value);
    }
    CHECK(scene("", 80.0).sky.highest_sun_rad == 0.5 * pi);
}

TEST_CASE("summer time moves the clock by an hour and not the sun", "[reader][sun]") {
    const auto sun = [](const std::string& clock) {
        return *scene_with(R"("sky": {"model": "uniform", "horizontal_illuminance_lx": 1},
            "site": {"latitude_deg": 47.2, "longitude_deg": -1.6, "time_zone_h": 1}, "sun": {)" + clock + "}").sun;
    };
    const SunDescription summer = sun(R"("date": "2024-07-01", "time": "14:20", "summer_time": true)");
    const SunDescription winter = sun(R"("date": "2024-07-01", "time": "13:20")");
    const SunDescription off = sun(R"("date": "2024-07-01", "time": "13:20", "summer_time": false)");
    // Rounding of the hours.
    CHECK_THAT(summer.altitude_rad, WithinAbs(winter.altitude_rad, 1e-11));
    CHECK_THAT(summer.azimuth_rad, WithinAbs(winter.azimuth_rad, 1e-11));
    CHECK(off.altitude_rad == winter.altitude_rad);
    // Past midnight it is still the day before.
    const SunDescription early = sun(R"("date": "2024-07-01", "time": "00:30", "summer_time": true)");
    const SunDescription late = sun(R"("date": "2024-06-30", "time": "23:30")");
    CHECK_THAT(early.altitude_rad, WithinAbs(late.altitude_rad, 1e-11));
}
