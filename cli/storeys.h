#pragma once
#include <vector>

#include "core/building.h"

namespace naturel {

/// A floor of a building and what is drawn with it.
struct Storey {
    double floor_m = 0.0;    ///< z of its lowest level
    double ceiling_m = 0.0;  ///< z of the next floor or of the top of all rooms
    double cut_m = 1.0;      ///< z of the section that a plan shows: 1 m over the floor, lower in low rooms
    std::vector<FaceId> levels{};  ///< horizontal indoor faces that look up, from the lowest to the highest
    /// Other indoor faces, but for level ceilings, as an unrolled room shows them: the walls that the section
    /// meets, clockwise seen from above, then the rest.
    std::vector<FaceId> walls{};
    std::vector<ApertureId> apertures{};
};

/// The floors of a building from the lowest up. A level starts a new one where people can stand on it, 1.9 m
/// high and on 2 m2, and when it is 2 m above the last: lower levels are furniture, sills and steps.
std::vector<Storey> find_storeys(const Scene& scene, const Building& building);

/// Where the plane z cuts a convex polygon: the two ends of a line, or nothing.
std::vector<glm::dvec3> cut_at_height(const std::vector<glm::dvec3>& polygon, double z_m);

/// Solid matter just above the horizontal plane z inside a rectangle, seen from above in the frame of
/// indoor_air_at_height().
Region solid_at_height(const Scene& scene, double z_m, const Ring& rectangle);

/// The frame of indoor_air_at_height().
PlaneFrame plan_frame(double z_m);

}  // namespace naturel
