#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <utility>
#include <vector>

#include "core/building.h"
#include "core/light_by_source.h"

namespace naturel {

/// Places on the ground in and around a site, on the crossings of lines that run along x and y. The lines run through all
/// corners of the outdoor facets, so that upright walls along the axes stand on them, are no further apart than the spacing
/// there, and ever further outside, up to ten times the height of the buildings. Values between them are interpolated.
struct GroundLattice {
    struct Node {
        glm::dvec3 position_m{};  ///< 1 mm off walls and off the ground
        bool open = false;        ///< in the open air; else under a building
    };
    std::vector<double> x_m, y_m;  ///< lines, increasing; empty: no buildings
    std::vector<Node> nodes;       ///< [y][x]

    /// Weights of the four nodes around a place; false outside the lattice.
    struct Place {
        std::size_t first_node = 0;  ///< of the lower x and y
        double along_x = 0.0, along_y = 0.0;
    };
    bool find(double x, double y, Place& place) const;
    std::array<std::pair<std::size_t, double>, 4> weights(const Place& place) const;  ///< node and weight

    /// values: [nodes]
    LightBySource interpolate(const Place& place, const std::vector<LightBySource>& values) const;

    /// Gives nodes under buildings the mean of their neighbours, from the walls inwards.
    void fill_closed(std::vector<LightBySource>& values) const;
};

GroundLattice make_ground_lattice(const Scene& scene, const Building& building, double spacing_m);

}  // namespace naturel
