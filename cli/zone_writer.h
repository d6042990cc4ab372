#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "core/colour.h"
#include "core/light_zones.h"

namespace naturel {

/// The light zones of a building, and everything they came from: what the writers see. Refers to its parts.
struct ZoneReport {
    const std::filesystem::path& scene_file;
    const Scene& scene;
    const Building& building;
    const std::optional<SunBeam>& sun;
    const LightZones& zones;
    const Primaries& primaries;
};

/// Sizes of the zones of one face, or of all indoor faces together.
struct ZoneSizes {
    double area_m2 = 0.0;
    double sunspot_m2 = 0.0;
    double umbra_m2 = 0.0;
    double sun_lm = 0.0;  ///< luminous flux of the sun that arrives straight from an aperture
};
ZoneSizes zone_sizes(const ZoneReport& report, FaceId face);
ZoneSizes indoor_zone_sizes(const ZoneReport& report);

/// "sun at altitude 37.6 deg, azimuth 214.4 deg, 75000 lx direct normal", or why there is none.
std::string sun_words(const ZoneReport& report);

/// Text of zones.json. Coordinates are metres, rounded to the nanometres in which zones are computed.
std::string zones_json(const ZoneReport& report);

/// The same in short, for people: a line per face that has a zone.
std::string zones_table(const ZoneReport& report);

}  // namespace naturel
