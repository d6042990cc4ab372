#include "core/sun.h"

#include <algorithm>
#include <cmath>

namespace naturel {
namespace {

/// Julian date of 0 h UT in the proleptic Gregorian calendar (Meeus, Astronomical Algorithms, eq. 7.1).
double julian_date(int year, int month, int day) {
    const int y = month <= 2 ? year - 1 : year;
    const int m = month <= 2 ? month + 12 : month;
    const double century = std::floor(y / 100.0);
    return std::floor(365.25 * (y + 4716)) + std::floor(30.6001 * (m + 1)) + day + 2.0 - century +
           std::floor(century / 4.0) - 1524.5;
}

}  // namespace

glm::dvec3 direction_from_angles(double altitude_rad, double azimuth_rad) {
    const double horizontal = std::cos(altitude_rad);
    return {horizontal * std::sin(azimuth_rad), horizontal * std::cos(azimuth_rad), std::sin(altitude_rad)};
}

SunAngles sun_position(const LocalTime& time, double latitude_rad, double longitude_rad) {
    // Symbols and constants of Michalsky, Solar Energy 40 (1988) 227; docs/method.md eqs. (Sun 2) to (Sun 6).
    const double ut_h = time.hour - time.time_zone_h;  // may leave [0, 24): the date below then carries it
    const double n = julian_date(time.year, time.month, time.day) + ut_h / 24.0 - 2451545.0;
    const double L = radians_from_degrees(280.460 + 0.9856474 * n);  // mean longitude
    const double g = radians_from_degrees(357.528 + 0.9856003 * n);  // mean anomaly
    const double ecliptic_longitude =
        L + radians_from_degrees(1.915 * std::sin(g) + 0.020 * std::sin(2.0 * g));
    const double obliquity = radians_from_degrees(23.439 - 0.0000004 * n);

    const double right_ascension =
        std::atan2(std::cos(obliquity) * std::sin(ecliptic_longitude), std::cos(ecliptic_longitude));
    const double declination = std::asin(std::sin(obliquity) * std::sin(ecliptic_longitude));
    const double gmst_h = 6.697375 + 0.0657098242 * n + ut_h;
    const double H = radians_from_degrees(15.0 * gmst_h) + longitude_rad - right_ascension;  // hour angle

    const double east = -std::cos(declination) * std::sin(H);
    const double north = std::sin(declination) * std::cos(latitude_rad) -
                         std::cos(declination) * std::cos(H) * std::sin(latitude_rad);
    const double up = std::sin(declination) * std::sin(latitude_rad) +
                      std::cos(declination) * std::cos(H) * std::cos(latitude_rad);
    const double azimuth = std::atan2(east, north);
    return {std::asin(std::clamp(up, -1.0, 1.0)), azimuth < 0.0 ? azimuth + 2.0 * pi : azimuth};
}

double refracted_altitude(double altitude_rad) {
    // docs/method.md eq. (Sun 7); seconds of arc, h in degrees.
    const double h = degrees_from_radians(altitude_rad), t = std::tan(altitude_rad);
    double seconds = 0.0;
    if (h > 85.0) {
        seconds = 0.0;
    } else if (h > 5.0) {
        seconds = 58.1 / t - 0.07 / (t * t * t) + 0.000086 / (t * t * t * t * t);
    } else if (h > -0.575) {
        seconds = 1735.0 + h * (-518.2 + h * (103.4 + h * (-12.79 + h * 0.711)));
    } else {
        seconds = -20.774 / t;
    }
    return altitude_rad + radians_from_degrees(seconds / 3600.0);
}

}  // namespace naturel
