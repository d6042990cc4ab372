#pragma once
#include <string_view>
#include <vector>

#include "core/building.h"
#include "core/scene.h"

namespace naturel {

/// One face of a polyhedron before any cutting.
struct PolyhedronFace {
    FaceFrame frame;
    bool triangle = false;
    glm::dvec3 outward{};                ///< unit normal, out of the polyhedron
    std::vector<glm::dvec3> vertices_m;  ///< counter-clockwise seen from outside
    std::string_view role;
};

/// Faces in the order of their numbers. With O, A, B, C the four vertices:
///   parallelepiped: 1 bottom (OAB), 2 top (opposite), 3 front (OAC), 4 back (opposite), 5 left (OBC), 6 right (opposite);
///   prism (base OAB, extruded along OC): 1 bottom, 2 top, 3 front (OAC), 4 left (OBC), 5 slope (ABC);
///   tetrahedron: 1 bottom (OAB), 2 front (OAC), 3 left (OBC), 4 slope (ABC).
/// The roles name edges, not compass points: with A to the right, B to the back and C up they mean what they say.
std::vector<PolyhedronFace> polyhedron_faces(const Polyhedron& polyhedron);

/// The role names of a kind, in the order of the face numbers.
std::vector<std::string_view> face_roles(PolyhedronKind kind);

double volume_m3(const Polyhedron& polyhedron);

/// Inside or on the surface.
bool contains(const Polyhedron& polyhedron, const glm::dvec3& point_m);

}  // namespace naturel
