#include "core/polyhedra.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace naturel {

namespace {

using glm::dvec3;

PolyhedronFace make_face(std::string_view role, bool triangle, const dvec3& origin, const dvec3& u, const dvec3& v,
                         const dvec3& polyhedron_centre) {
    PolyhedronFace face{.frame = {origin, u, v}, .triangle = triangle, .outward = {}, .vertices_m = {}, .role = role};
    if (glm::dot(glm::cross(u, v), origin - polyhedron_centre) < 0.0) std::swap(face.frame.u_m, face.frame.v_m);
    face.outward = glm::normalize(glm::cross(face.frame.u_m, face.frame.v_m));
    face.vertices_m = {origin, origin + face.frame.u_m};
    if (!triangle) face.vertices_m.push_back(origin + face.frame.u_m + face.frame.v_m);
    face.vertices_m.push_back(origin + face.frame.v_m);
    return face;
}

dvec3 edge(const Polyhedron& p, int vertex) { return p.vertices_m[static_cast<std::size_t>(vertex)] - p.vertices_m[0]; }

dvec3 centre(const Polyhedron& p) {
    const dvec3 u = edge(p, 1), v = edge(p, 2), w = edge(p, 3);
    switch (p.kind) {
        case PolyhedronKind::parallelepiped: return p.vertices_m[0] + 0.5 * (u + v + w);
        case PolyhedronKind::prism: return p.vertices_m[0] + (u + v) / 3.0 + 0.5 * w;
        case PolyhedronKind::tetrahedron: break;
    }
    return p.vertices_m[0] + 0.25 * (u + v + w);
}

}  // namespace

std::vector<std::string_view> face_roles(PolyhedronKind kind) {
    switch (kind) {
        case PolyhedronKind::parallelepiped: return {"bottom", "top", "front", "back", "left", "right"};
        case PolyhedronKind::prism: return {"bottom", "top", "front", "left", "slope"};
        case PolyhedronKind::tetrahedron: break;
    }
    return {"bottom", "front", "left", "slope"};
}

std::vector<PolyhedronFace> polyhedron_faces(const Polyhedron& p) {
    const dvec3 o = p.vertices_m[0];
    const dvec3 u = edge(p, 1), v = edge(p, 2), w = edge(p, 3);
    const dvec3 c = centre(p);
    switch (p.kind) {
        case PolyhedronKind::parallelepiped:
            return {make_face("bottom", false, o, u, v, c), make_face("top", false, o + w, u, v, c),
                    make_face("front", false, o, u, w, c),  make_face("back", false, o + v, u, w, c),
                    make_face("left", false, o, v, w, c),   make_face("right", false, o + u, v, w, c)};
        case PolyhedronKind::prism:
            return {make_face("bottom", true, o, u, v, c), make_face("top", true, o + w, u, v, c),
                    make_face("front", false, o, u, w, c), make_face("left", false, o, v, w, c),
                    make_face("slope", false, o + u, v - u, w, c)};
        case PolyhedronKind::tetrahedron: break;
    }
    return {make_face("bottom", true, o, u, v, c), make_face("front", true, o, u, w, c),
            make_face("left", true, o, v, w, c), make_face("slope", true, o + u, v - u, w - u, c)};
}

double volume_m3(const Polyhedron& p) {
    const double box = std::abs(glm::dot(glm::cross(edge(p, 1), edge(p, 2)), edge(p, 3)));
    switch (p.kind) {
        case PolyhedronKind::parallelepiped: return box;
        case PolyhedronKind::prism: return box / 2.0;
        case PolyhedronKind::tetrahedron: break;
    }
    return box / 6.0;
}

bool contains(const Polyhedron& p, const dvec3& point_m) {
    const dvec3 s = glm::inverse(glm::dmat3(edge(p, 1), edge(p, 2), edge(p, 3))) * (point_m - p.vertices_m[0]);
    if (s.x < 0.0 || s.y < 0.0 || s.z < 0.0) return false;
    switch (p.kind) {
        case PolyhedronKind::parallelepiped: return s.x <= 1.0 && s.y <= 1.0 && s.z <= 1.0;
        case PolyhedronKind::prism: return s.x + s.y <= 1.0 && s.z <= 1.0;
        case PolyhedronKind::tetrahedron: break;
    }
    return s.x + s.y + s.z <= 1.0;
}

}  // namespace naturel
