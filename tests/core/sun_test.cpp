#include "core/sun.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;

namespace {

double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
    return degrees_from_radians(2.0 * std::asin(0.5 * glm::length(a - b)));
}

SunAngles sun_in_degrees(const SunAngles& sun) {
    return {degrees_from_radians(sun.altitude_rad), degrees_from_radians(sun.azimuth_rad)};
}

}  // namespace

TEST_CASE("azimuth turns clockwise from +y and altitude rises from the horizon", "[core][physics][sun]") {
    struct Case {
        double altitude_deg, azimuth_deg;
        glm::dvec3 direction;
    };
    const double h = std::sqrt(0.5);
    const auto expected = GENERATE_COPY(values<Case>({{0, 0, {0, 1, 0}},
                                                      {0, 90, {1, 0, 0}},
                                                      {0, 180, {0, -1, 0}},
                                                      {0, 270, {-1, 0, 0}},
                                                      {90, 123, {0, 0, 1}},
                                                      {45, 90, {h, 0, h}},
                                                      {-45, 180, {0, -h, -h}}}));
    const glm::dvec3 direction = direction_from_angles(radians_from_degrees(expected.altitude_deg),
                                                       radians_from_degrees(expected.azimuth_deg));
    CHECK(glm::length(direction - expected.direction) < 1e-15);  // rounding
}

TEST_CASE("the sun stands where the NREL solar position algorithm puts it", "[core][physics][sun]") {
    const tests::CsvTable table = tests::read_csv("sunpos_vectors.csv");
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const auto number = [&](const char* column) { return table.number(row, column); };
        INFO(table.text(row, "site") << ", line " << row + 2);
        const LocalTime time{.year = static_cast<int>(number("year")),
                             .month = static_cast<int>(number("month")),
                             .day = static_cast<int>(number("day")),
                             .hour = number("local_std_hour"),
                             .time_zone_h = number("tz_h")};
        const SunAngles sun = sun_position(time, radians_from_degrees(number("lat_deg_N")),
                                           radians_from_degrees(number("lon_deg_E")));

        const glm::dvec3 truth = direction_from_angles(radians_from_degrees(number("spa_alt_deg")),
                                                       radians_from_degrees(number("spa_az_deg_NtoE")));
        // 0.0123 degrees is the promise of core/sun.h; the table is rounded to 0.0001.
        CHECK(degrees_between(direction_from_angles(sun.altitude_rad, sun.azimuth_rad), truth) < 0.0124);
        // The same algorithm in another implementation, printed with four decimals.
        CHECK_THAT(sun_in_degrees(sun).altitude_rad, WithinAbs(number("michalsky_alt"), 0.51e-4));
        CHECK_THAT(sun_in_degrees(sun).azimuth_rad, WithinAbs(number("michalsky_az"), 0.51e-4));
    }
}

TEST_CASE("the published example of the NREL algorithm comes out", "[core][physics][sun]") {
    const LocalTime time{.year = 2003, .month = 10, .day = 17, .hour = 12.0 + 30.5 / 60.0, .time_zone_h = -7};
    const SunAngles sun =
        sun_in_degrees(sun_position(time, radians_from_degrees(39.742476), radians_from_degrees(-105.1786)));
    // Michalsky's value, printed with four decimals; SPA itself gives 39.872046 and 194.340241.
    CHECK_THAT(sun.altitude_rad, WithinAbs(39.8728, 0.51e-4));
    CHECK_THAT(sun.azimuth_rad, WithinAbs(194.3370, 0.51e-4));
}

TEST_CASE("the sun does not care which clock names the moment", "[core][physics][sun]") {
    const double latitude = radians_from_degrees(60.0), longitude = radians_from_degrees(25.0);
    const SunAngles utc = sun_position({2024, 3, 1, 0.5, 0.0}, latitude, longitude);
    const SunAngles west = sun_position({2024, 2, 29, 22.5, -2.0}, latitude, longitude);   // the day before
    const SunAngles year = sun_position({2023, 12, 31, 23.0, -1.0}, latitude, longitude);  // the year before
    const SunAngles new_year = sun_position({2024, 1, 1, 1.0, 1.0}, latitude, longitude);
    // Rounding: the angles since 2000 are some 10^4 degrees, kept to 1e-12 degrees.
    CHECK_THAT(west.altitude_rad, WithinAbs(utc.altitude_rad, 1e-11));
    CHECK_THAT(west.azimuth_rad, WithinAbs(utc.azimuth_rad, 1e-11));
    CHECK_THAT(year.altitude_rad, WithinAbs(new_year.altitude_rad, 1e-11));
    CHECK_THAT(year.azimuth_rad, WithinAbs(new_year.azimuth_rad, 1e-11));
}

TEST_CASE("refraction raises the sun as NOAA's table says", "[core][physics][sun]") {
    const tests::CsvTable table = tests::read_csv("sunpos_vectors.csv");
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        INFO("line " << row + 2);
        const double altitude_deg = table.number(row, "noaa_alt");
        const double raised = degrees_from_radians(refracted_altitude(radians_from_degrees(altitude_deg))) - altitude_deg;
        CHECK_THAT(raised, WithinAbs(table.number(row, "refraction_deg_noaa"), 0.6e-4));  // four decimals
    }
}
