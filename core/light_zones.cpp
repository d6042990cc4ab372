#include "core/light_zones.h"

#include <memory>

#include "core/parallel.h"
#include "core/sun.h"
#include "core/sunspot.h"
#include "core/umbra.h"

namespace naturel {

std::optional<SunBeam> sun_beam(const Scene& scene) {
    if (!scene.sun || scene.sun->altitude_rad <= 0.0 || scene.sun->direct_normal_illuminance_lx <= 0.0)
        return {};
    return SunBeam{direction_from_angles(scene.sun->altitude_rad, scene.sun->azimuth_rad),
                   scene.sun->direct_normal_illuminance_lx, scene.sun->colour.band};
}

LightZones find_light_zones(const Scene& scene, const Building& building, const SunBeam* sun) {
    const UmbraFinder umbra(building, convex_occluders(scene, building));
    std::unique_ptr<const SunspotFinder> sunspots;
    if (sun != nullptr) sunspots = std::make_unique<SunspotFinder>(scene, building, *sun);
    LightZones zones;
    zones.sunspots.resize(building.faces.size());
    zones.umbra.resize(building.faces.size());
    parallel_for(building.faces.size(), 1, [&](std::size_t f) {
        const auto face = make_id<FaceId>(f);
        zones.umbra[f] = umbra.on_face(face);
        if (!sunspots) return;
        zones.sunspots[f] = sunspots->on_face(face);
        // Both are rounded to 1 nm on their own.
        for (const Sunspot& spot : zones.sunspots[f]) zones.umbra[f] = subtract(zones.umbra[f], spot.region);
    });
    return zones;
}

LightZones find_light_zones(const Scene& scene, const Building& building) {
    if (!scene.grid.zones) return {};
    const std::optional<SunBeam> sun = sun_beam(scene);
    return find_light_zones(scene, building, sun ? &*sun : nullptr);
}

}  // namespace naturel
