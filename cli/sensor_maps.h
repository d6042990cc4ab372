#pragma once
#include <string>
#include <vector>

#include "cli/result.h"

namespace naturel {

/// A drawing and the name of its file below the folder of the result.
struct SensorMap {
    std::string file;  ///< "sensors/illuminance/work_plane.svg"
    std::string svg;
};

/// For every grid of sensors a plan in false colour with values and lines of equal value, of the illuminance and, under a sky with
/// light, of the daylight factor (docs/pictures.md, "Maps of sensors"). Sets of single points have none, nor have grids of more than
/// 50 000 points. sets: [Scene::sensors].
std::vector<SensorMap> draw_sensor_maps(const Result& result, const std::vector<SensorSetStatistics>& sets);

/// The rooms that a grid of sensors falls into: connected parts of the air at its height, less its margin.
std::vector<Region> rooms_of(const Region& indoor, const SensorGrid& grid);

}  // namespace naturel
