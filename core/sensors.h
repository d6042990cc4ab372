#pragma once
#include <string>
#include <vector>

#include "core/building.h"
#include "core/visibility.h"

namespace naturel {

/// A sensor of a set, placed.
struct Sensor {
    std::size_t set = 0;     ///< into Scene::sensors
    std::string id{};          ///< "work plane/12"
    GatherPoint point{};
    Medium medium = Medium::indoor_air;
};

/// Lays out the sensor grids over the indoor air of a building and lists the given points.
/// A point that touches a surface is lifted off it by 10 micrometres.
std::vector<Sensor> place_sensors(const Scene& scene, const Building& building);

}  // namespace naturel
