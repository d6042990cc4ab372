#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "cli/job_records.h"
#include "cli/result.h"

namespace naturel {

/// What is kept of a sensor, in the order of the last axis of sensors_N.npy: lx, and % for the daylight factor.
inline constexpr std::array<std::string_view, 6> sensor_quantities{"total", "sky", "sun", "erc", "irc", "daylight_factor"};

/// The record of a finished job. sensors: keep the light on every sensor, NaN inside a solid.
std::string done_record(const std::string& key, const Result& result, bool sensors);
std::string failed_record(const std::string& key, const std::string& error);

/// The record of the sensors that all jobs of a group have.
std::string sensors_record(const std::string& group_key, const Scene& scene, const std::vector<Sensor>& sensors);

}  // namespace naturel
