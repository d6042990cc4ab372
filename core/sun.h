#pragma once
#include <glm/vec3.hpp>

#include "core/units.h"

namespace naturel {

/// Unit vector from altitude (from the horizon up) and azimuth (from +y clockwise seen from above), both radians.
glm::dvec3 direction_from_angles(double altitude_rad, double azimuth_rad);

struct SunAngles {
    double altitude_rad = 0.0;
    double azimuth_rad = 0.0;  ///< from true north, clockwise
};

/// A moment on the clock of a place. Proleptic Gregorian calendar.
struct LocalTime {
    int year = 2000, month = 1, day = 1;
    double hour = 12.0;         ///< [0, 24)
    double time_zone_h = 0.0;   ///< hours east of Greenwich, summer time included if the clock shows it
};

/// Where the sun stands (Michalsky 1988, Astronomical Almanac), without refraction.
/// Within 0.0123 degrees of NREL's SPA for 1990-2049 (docs/method.md, "Sun").
SunAngles sun_position(const LocalTime& time, double latitude_rad, double longitude_rad);

/// Apparent altitude: what the air's refraction (NOAA's formula, 1010 hPa, 10 degrees Celsius) makes of a geometric one.
double refracted_altitude(double altitude_rad);

}  // namespace naturel
