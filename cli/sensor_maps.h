#pragma once
#include <string>
#include <vector>

#include "cli/drawing_parts.h"
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

/// What the map of a set of sensors shows: the rooms at its height, its cells, windows in the walls, and a margin.
/// indoor: in the frame plan_frame() of the grid. set_number: of a set with a grid, into Scene::sensors.
PlaneExtent map_extent(const Result& result, std::size_t set_number, const Region& indoor);

/// A window in a map of sensors, m.
struct MapWindow {
    std::vector<std::vector<glm::dvec3>> cuts{};      ///< two ends each: where the height of the map cuts it
    std::vector<std::vector<glm::dvec3>> outlines{};  ///< seen from above where it is not cut: rings, or the two ends of an upright pane
};

/// The windows that the height of a map cuts, and those less than a storey above or below whose middle the map shows.
std::vector<MapWindow> map_windows(const Building& building, double z_m, const PlaneExtent& extent_m);

}  // namespace naturel
