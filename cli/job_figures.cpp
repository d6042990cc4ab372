#include "cli/job_figures.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "cli/csv_writer.h"
#include "cli/json_text.h"
#include "cli/json_writer.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

std::vector<double> light_on_all(const Result& result) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> light;
    light.reserve(result.solution.sensors.size() * sensor_quantities.size());
    for (std::size_t k = 0; k < result.solution.sensors.size(); ++k) {
        if (result.solution.sensors[k].medium == Medium::solid) {
            light.insert(light.end(), sensor_quantities.size(), none);
            continue;
        }
        const PointIlluminance& point = result.solution.sensor_values[k];
        const Components parts = components_of(result.primaries, point.direct, point.indirect_lx);
        light.insert(light.end(), {result.primaries.luminous(point.total_lx()), parts.sky_lx, parts.sun_lx, parts.erc_ground_lx + parts.erc_buildings_lx, parts.irc_lx,
                                   daylight_factor_percent(result, point).value_or(none)});
    }
    return light;
}

}  // namespace

std::string done_record(const std::string& key, const Result& result, bool sensors) {
    const std::vector<SensorSetStatistics> sets = sensor_set_statistics(result);
    // JSON knows no NaN; the library would write null and nobody would notice. A mean shows that of any sensor.
    for (const SensorSetStatistics& set : sets)
        if (set.illuminance_lx && !std::isfinite(set.illuminance_lx->mean)) throw std::logic_error("a result is not a finite number");
    const Json figures = figures_json(result, sets);
    return record_bytes(json_line({{"key", key}, {"status", "done"}, {"figures", figures}}),
                        sensors ? light_on_all(result) : std::vector<double>());
}

std::string failed_record(const std::string& key, const std::string& error) {
    return record_bytes(json_line({{"key", key}, {"status", "failed"}, {"error", error}}), {});
}

std::string sensors_record(const std::string& group_key, const Scene& scene, const std::vector<Sensor>& sensors) {
    Json list = Json::array();
    for (const Sensor& sensor : sensors) {
        const auto& [p, n] = sensor.point;
        list.push_back({{"id", sensor.id},
                        {"set", scene.sensors[sensor.set].id},
                        {"point", {p.x, p.y, p.z, n.x, n.y, n.z}},
                        {"medium", medium_word(sensor.medium)}});
    }
    return record_bytes(json_line({{"key", group_key}, {"status", "sensors"}, {"sensors", list}}), {});
}

}  // namespace naturel
