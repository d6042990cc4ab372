#include "cli/zone_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "cli/json_text.h"
#include "core/sun.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Band3& band) {
    return {band.r, band.g, band.b};
}

/// Without the digits beyond the nanometre that the way from the plane to the world adds.
Json json_of(const glm::dvec3& point_m) {
    const auto rounded = [](double m) {
        return std::round(m * nanometres_per_metre) / nanometres_per_metre + 0.0;
    };
    return {rounded(point_m.x), rounded(point_m.y), rounded(point_m.z)};
}

Json json_of(const PlaneFrame& plane, const Ring& ring) {
    Json points = Json::array();
    for (const PlanePoint& point : ring)
        points.push_back(json_of(plane.to_world(point)));
    return points;
}

Json polygons_json(const PlaneFrame& plane, const Region& region) {
    Json polygons = Json::array();
    for (const Region& part : connected_parts(region)) {
        Json holes = Json::array();
        for (std::size_t k = 1; k < part.size(); ++k)
            holes.push_back(json_of(plane, part[k]));
        polygons.push_back({{"outer", json_of(plane, part.front())}, {"holes", holes}});
    }
    return polygons;
}

double luminous_flux_lm(const ZoneReport& report, const Sunspot& spot) {
    return area_m2(spot.region) * report.primaries.luminous(spot.illuminance_lx);
}

double azimuth_deg(const Scene& scene) {
    return std::fmod(degrees_from_radians(scene.sun->azimuth_rad + scene.north_rad) + 720.0, 360.0);
}

/// What would fall on the outside of an aperture from the sun if nothing stood before it, lm.
double unobstructed_sun_lm(const ZoneReport& report, const Aperture& aperture) {
    if (!report.sun || aperture.inner) return 0.0;
    const double cosine = std::max(0.0, -glm::dot(aperture.normal, report.sun->direction));
    return report.sun->direct_normal_illuminance_lx * cosine * aperture.area_m2;
}

Json apertures_json(const ZoneReport& report) {
    const Building& building = report.building;
    std::vector<double> sun_lm(building.apertures.size());
    for (const std::vector<Sunspot>& spots : report.zones.sunspots)
        for (const Sunspot& spot : spots)
            sun_lm[index(spot.aperture)] += luminous_flux_lm(report, spot);
    Json list = Json::array();
    for (std::size_t a = 0; a < building.apertures.size(); ++a) {
        const Aperture& aperture = building.apertures[a];
        list.push_back({{"name", aperture.name},
                        {"inner", aperture.inner},
                        {"area_m2", aperture.area_m2},
                        {"unobstructed_sun_flux_lm", unobstructed_sun_lm(report, aperture)},
                        {"sun_flux_on_indoor_surfaces_lm", sun_lm[a]}});
    }
    return list;
}

Json face_json(const ZoneReport& report, FaceId id) {
    const Face& face = report.building.faces[index(id)];
    const ZoneSizes sizes = zone_sizes(report, id);
    Json spots = Json::array();
    for (const Sunspot& spot : report.zones.sunspots[index(id)])
        spots.push_back({{"aperture", report.building.apertures[index(spot.aperture)].name},
                         {"illuminance_lx", report.primaries.luminous(spot.illuminance_lx)},
                         {"illuminance_rgb_lx", json_of(spot.illuminance_lx)},
                         {"transmittance", report.primaries.luminous(spot.transmittance)},
                         {"transmittance_rgb", json_of(spot.transmittance)},
                         {"area_m2", area_m2(spot.region)},
                         {"polygons", polygons_json(face.plane, spot.region)}});
    return {{"name", face.name},
            {"environment", face.environment == Environment::indoor ? "indoor" : "outdoor"},
            {"normal", json_of(face.normal)},
            {"area_m2", sizes.area_m2},
            {"sunspot_area_m2", sizes.sunspot_m2},
            {"umbra_area_m2", sizes.umbra_m2},
            {"sunspots", spots},
            {"umbra", polygons_json(face.plane, report.zones.umbra[index(id)])}};
}

/// "31400", or "2100 to 31400" where spots differ in the digits shown; empty without spots.
std::string illuminance_words(const ZoneReport& report, FaceId face) {
    std::vector<double> lx;
    for (const Sunspot& spot : report.zones.sunspots[index(face)])
        lx.push_back(report.primaries.luminous(spot.illuminance_lx));
    if (lx.empty()) return "";
    const auto [least, most] = std::ranges::minmax(lx);
    const std::string low = fmt::format("{:.0f}", least), high = fmt::format("{:.0f}", most);
    return low == high ? low : low + " to " + high;
}

}  // namespace

std::string sun_words(const ZoneReport& report) {
    if (report.sun)
        return fmt::format("sun at altitude {:.1f} deg, azimuth {:.1f} deg, {:.0f} lx direct normal",
                           degrees_from_radians(report.scene.sun->altitude_rad), azimuth_deg(report.scene),
                           report.sun->direct_normal_illuminance_lx);
    if (!report.scene.sun) return "no sun in the scene";
    return report.scene.sun->altitude_rad > 0.0 ? "a sun without direct_normal_illuminance_lx"
                                                : "the sun is below the horizon";
}

ZoneSizes zone_sizes(const ZoneReport& report, FaceId face) {
    ZoneSizes sizes{.area_m2 = area_m2(report.building.faces[index(face)].region),
                    .umbra_m2 = area_m2(report.zones.umbra[index(face)])};
    for (const Sunspot& spot : report.zones.sunspots[index(face)]) {
        sizes.sunspot_m2 += area_m2(spot.region);
        sizes.sun_lm += luminous_flux_lm(report, spot);
    }
    return sizes;
}

ZoneSizes indoor_zone_sizes(const ZoneReport& report) {
    ZoneSizes sum;
    for (std::size_t f = 0; f < report.building.faces.size(); ++f) {
        const Face& face = report.building.faces[f];
        if (face.environment == Environment::outdoor || face.aperture) continue;
        const ZoneSizes sizes = zone_sizes(report, make_id<FaceId>(f));
        sum.area_m2 += sizes.area_m2;
        sum.sunspot_m2 += sizes.sunspot_m2;
        sum.umbra_m2 += sizes.umbra_m2;
        sum.sun_lm += sizes.sun_lm;
    }
    return sum;
}

std::string zones_json(const ZoneReport& report) {
    Json faces = Json::array();
    for (std::size_t f = 0; f < report.building.faces.size(); ++f)
        if (!report.building.faces[f].aperture) faces.push_back(face_json(report, make_id<FaceId>(f)));
    Json sun;
    if (report.sun)
        sun = {{"altitude_deg", degrees_from_radians(report.scene.sun->altitude_rad)},
               {"azimuth_deg", azimuth_deg(report.scene)},
               {"direct_normal_illuminance_lx", report.sun->direct_normal_illuminance_lx}};
    double unobstructed_lm = 0.0, exterior_m2 = 0.0;
    for (const Aperture& aperture : report.building.apertures) {
        unobstructed_lm += unobstructed_sun_lm(report, aperture);
        if (!aperture.inner) exterior_m2 += aperture.area_m2;
    }
    const ZoneSizes totals = indoor_zone_sizes(report);
    return json_text({{"naturel", NATUREL_VERSION},
                      {"scene",
                       {{"name", report.scene.name},
                        {"file", report.scene_file.filename().string()},
                        {"sha256", report.scene.source_sha256}}},
                      {"sun", sun},
                      {"totals",
                       {{"indoor_area_m2", totals.area_m2},
                        {"sunspot_area_m2", totals.sunspot_m2},
                        {"umbra_area_m2", totals.umbra_m2},
                        {"exterior_aperture_area_m2", exterior_m2},
                        {"unobstructed_sun_flux_at_apertures_lm", unobstructed_lm},
                        {"sun_flux_on_indoor_surfaces_lm", totals.sun_lm}}},
                      {"apertures", apertures_json(report)},
                      {"faces", faces}});
}

std::string zones_table(const ZoneReport& report) {
    struct Row {
        std::string face, area, sunspot, illuminance, umbra;
    };
    const auto metres = [](double m2) { return m2 > 0.0 ? fmt::format("{:.3f}", m2) : std::string("-"); };
    std::vector<Row> rows{{"face", "area m2", "sunspot m2", "lx", "umbra m2"}};
    for (std::size_t f = 0; f < report.building.faces.size(); ++f) {
        const auto id = make_id<FaceId>(f);
        const ZoneSizes sizes = zone_sizes(report, id);
        if (sizes.sunspot_m2 == 0.0 && sizes.umbra_m2 == 0.0) continue;
        const std::string lx = illuminance_words(report, id);
        rows.push_back({report.building.faces[f].name, metres(sizes.area_m2), metres(sizes.sunspot_m2),
                        lx.empty() ? "-" : lx, metres(sizes.umbra_m2)});
    }
    const ZoneSizes totals = indoor_zone_sizes(report);
    rows.push_back(
        {"all indoor faces", metres(totals.area_m2), metres(totals.sunspot_m2), "", metres(totals.umbra_m2)});

    std::size_t name_width = 0, lx_width = 0;
    for (const Row& row : rows) {
        name_width = std::max(name_width, row.face.size());
        lx_width = std::max(lx_width, row.illuminance.size());
    }
    std::string text = fmt::format("{}: {}\n", report.scene.name, sun_words(report));
    for (const Row& row : rows)
        text += fmt::format("  {:<{}}  {:>10}  {:>10}  {:>{}}  {:>10}\n", row.face, name_width, row.area,
                            row.sunspot, row.illuminance, lx_width, row.umbra);
    double unobstructed_lm = 0.0;
    for (const Aperture& aperture : report.building.apertures)
        unobstructed_lm += unobstructed_sun_lm(report, aperture);
    if (report.sun)
        text += fmt::format(
            "  sun: {:.1f} lm on indoor surfaces; {:.1f} lm would fall on the apertures with nothing before "
            "them\n",
            totals.sun_lm, unobstructed_lm);
    return text;
}

}  // namespace naturel
