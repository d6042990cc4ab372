#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/ids.h"
#include "core/planar_region.h"
#include "core/scene.h"

namespace naturel {

/// The parallelogram (or its half, a triangle) that a face was before it was cut; the calculation grid is laid on it.
/// A point of it is origin + s u + t v with s, t in [0, 1] (triangle: s + t <= 1).
struct FaceFrame {
    glm::dvec3 origin_m{};
    glm::dvec3 u_m{1, 0, 0};
    glm::dvec3 v_m{0, 1, 0};
};

/// One side of a face of a polyhedron or polygon, with what is left of it after assembly.
/// An aperture is a face too (material unused): the grid and the radiosity treat its room side as a surface.
struct Face {
    std::string name{};  ///< "room/bottom", a polygon's id, or an aperture's name; unique
    FaceFrame frame{};
    glm::dvec3 normal{};  ///< unit length, towards the air (aperture: towards the indoor air it belongs to)
    Environment environment = Environment::indoor;
    MaterialId material{};
    std::optional<ApertureId> aperture{};
    /// An inner aperture has two faces, one for each room; this is the other one.
    std::optional<FaceId> other_side{};
    PlaneFrame plane{};  ///< plane.normal == normal
    Region region{};     ///< what is left of the face, in `plane`; may be empty
    bool sheet = false;  ///< a side of a polygon of the scene: no solid behind it, but light passes neither way
};

/// A plane convex polygon that separates air from solid (or, for apertures, indoor air from outdoor air).
struct Facet {
    FaceId face{};
    std::vector<glm::dvec3> vertices_m{};  ///< counter-clockwise seen from the air
    glm::dvec3 normal{};                 ///< unit length, towards the air
    double area_m2 = 0.0;
    Environment environment = Environment::indoor;
    bool is_aperture = false;  ///< lets light pass; a surface only where form factors are concerned
};

/// A connected opening between indoor and outdoor air (or between two rooms: inner).
struct Aperture {
    std::string name{};
    GlazingId glazing{};
    bool inner = false;
    FaceId face{};                ///< its room side; of an inner aperture, one of the two
    std::vector<FacetId> facets{};  ///< convex parts of `face`
    glm::dvec3 normal{};          ///< unit length, = normal of `face`, into the room
    glm::dvec3 centroid_m{};
    double area_m2 = 0.0;
};

/// What assemble() makes of a scene: geometry only, no light. Environment and materials refer to the scene.
struct Building {
    std::vector<Face> faces{};
    std::vector<Facet> facets{};  ///< opaque ones first, then the parts of apertures
    std::vector<Aperture> apertures{};
    double ground_z_m = 0.0;
    double indoor_air_volume_m3 = 0.0;  ///< by the divergence theorem over indoor facets and apertures
};

/// Finds the surfaces of a scene (docs/method.md, "Assembly").
/// The polyhedra act in file order and the last one that acts on a point decides; polygons join as they are.
Building assemble(const Scene& scene);

/// What a point is made of. Points on a surface belong to either side.
enum class Medium { solid, indoor_air, outdoor_air };

/// By membership in the list of polyhedra alone, i.e. without the polygons of the scene.
Medium medium_at(const Scene& scene, const glm::dvec3& point_m);

/// The same when only some of the polyhedra can hold the point: their numbers, increasing.
Medium medium_at(const Scene& scene, std::span<const std::uint32_t> polyhedra, const glm::dvec3& point_m);

/// Indoor air cut by the horizontal plane z, seen from above in the frame (origin (0,0,z), x east, y north).
/// Rooms made of polygons count with what lies over their floors (indoor polygons that face up, below z).
Region indoor_air_at_height(const Scene& scene, double z_m);

}  // namespace naturel
