#include "cli/view_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {
namespace {

/// Nearer than any eye comes to a wall, farther than rounding.
constexpr double on_surface_m = 1e-3;

bool lies_on(const Facet& facet, const glm::dvec3& point_m) {
    if (std::abs(glm::dot(facet.normal, point_m - facet.vertices_m.front())) > on_surface_m) return false;
    for (std::size_t k = 0; k < facet.vertices_m.size(); ++k) {
        const glm::dvec3 begin_m = facet.vertices_m[k], along = glm::normalize(facet.vertices_m[(k + 1) % facet.vertices_m.size()] - begin_m);
        if (glm::dot(glm::cross(facet.normal, along), point_m - begin_m) < -on_surface_m) return false;
    }
    return true;
}

}  // namespace

std::vector<std::string> view_notes(const Scene& scene, const Building& building) {
    std::vector<std::string> notes;
    for (const View& view : scene.views) {
        const auto note = [&](std::string_view what) {
            notes.push_back(fmt::format("view \"{}\" {} (at {:.3f}, {:.3f}, {:.3f})", view.id, what, view.from_m.x, view.from_m.y, view.from_m.z));
        };
        const bool has_eye = view.kind != ViewKind::parallel;
        if (has_eye && std::ranges::any_of(building.facets, [&](const Facet& facet) { return !facet.is_aperture && lies_on(facet, view.from_m); }))
            note("looks from a surface");
        else if (view.cut_planes.empty() && medium_at(scene, view.from_m) == Medium::solid)
            note("looks from inside a solid");
    }
    return notes;
}

}  // namespace naturel
