#include "core/sun_on_patches.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "core/sunspot.h"

namespace naturel {
namespace {

using glm::dvec2;

double cross(const dvec2& a, const dvec2& b) { return a.x * b.y - a.y * b.x; }

dvec2 in_metres(const PlanePoint& point) {
    return {static_cast<double>(point.X) / nanometres_per_metre, static_cast<double>(point.Y) / nanometres_per_metre};
}

/// Signed area of the part of a ring inside a convex polygon, by cutting it along one edge after the other (Sutherland & Hodgman
/// 1974). What that rule leaves along the edges of a ring that is not convex has no area.
double area_inside(const Ring& ring, std::span<const dvec2> convex) {
    std::vector<dvec2> kept, next;
    for (const PlanePoint& point : ring) kept.push_back(in_metres(point));
    for (std::size_t k = 0; k < convex.size() && !kept.empty(); ++k) {
        const dvec2 &from = convex[k], edge = convex[(k + 1) % convex.size()] - from;
        next.clear();
        for (std::size_t i = 0; i < kept.size(); ++i) {
            const dvec2 &a = kept[i], &b = kept[(i + 1) % kept.size()];
            const double height_a = cross(edge, a - from), height_b = cross(edge, b - from);
            if (height_a >= 0.0) next.push_back(a);
            if ((height_a >= 0.0) != (height_b >= 0.0)) next.push_back(a + height_a / (height_a - height_b) * (b - a));
        }
        std::swap(kept, next);
    }
    double twice = 0.0;
    for (std::size_t i = 1; i + 1 < kept.size(); ++i) twice += cross(kept[i] - kept[0], kept[i + 1] - kept[0]);
    return 0.5 * twice;
}

}  // namespace

SunOnPatches::SunOnPatches(const Building& building, const PatchGrid& grid) : building_(building), grid_(grid) {
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) {
        const PlaneFrame& plane = building.faces[index(grid.patches[p].face)].plane;
        corners_m_.resize(grid.patches[p].first_corner);
        for (const glm::dvec3& corner : grid.polygon_of(make_id<PatchId>(p)))
            corners_m_.emplace_back(glm::dot(corner - plane.origin_m, plane.x), glm::dot(corner - plane.origin_m, plane.y));
    }
}

std::vector<SunOnPatches::LitPatch> SunOnPatches::lit_by(const Scene& scene, const SunBeam& sun) const {
    const SunspotFinder finder(scene, building_, sun);
    std::vector<LitPatch> lit;
    for (std::size_t f = 0; f < building_.faces.size(); ++f) {
        for (const Sunspot& spot : finder.on_face(make_id<FaceId>(f))) {
            for (const PatchId patch : patches_near(spot)) {
                const double share = lit_area_m2(spot, patch) / grid_.patches[index(patch)].area_m2;
                if (share > 0.0) lit.push_back({patch, share * spot.illuminance_lx});
            }
        }
    }
    // Two spots may share a patch.
    std::ranges::stable_sort(lit, {}, &LitPatch::patch);
    std::vector<LitPatch> merged;
    for (const LitPatch& one : lit) {
        if (!merged.empty() && merged.back().patch == one.patch) merged.back().mean_lx += one.mean_lx;
        else merged.push_back(one);
    }
    return merged;
}

double SunOnPatches::lit_area_m2(const Sunspot& spot, PatchId patch) const {
    const Patch& whole = grid_.patches[index(patch)];
    double sum = 0.0;
    for (const Ring& ring : spot.region) sum += area_inside(ring, {corners_m_.data() + whole.first_corner, whole.corner_count});
    return std::clamp(sum, 0.0, whole.area_m2);
}

/// Each once.
std::vector<PatchId> SunOnPatches::patches_near(const Sunspot& spot) const {
    const PatchGrid::FaceGrid& cells = grid_.face_grid(spot.face);
    const PlaneFrame& plane = building_.faces[index(spot.face)].plane;
    int low_i = cells.nu - 1, high_i = 0, low_j = cells.nv - 1, high_j = 0;
    for (const Ring& ring : spot.region) {
        for (const PlanePoint& point : ring) {
            const glm::dvec3 from_origin = plane.to_world(point) - cells.origin_m;
            const int i = std::clamp(static_cast<int>(std::floor(glm::dot(from_origin, cells.du))), 0, cells.nu - 1);
            const int j = std::clamp(static_cast<int>(std::floor(glm::dot(from_origin, cells.dv))), 0, cells.nv - 1);
            low_i = std::min(low_i, i), high_i = std::max(high_i, i);
            low_j = std::min(low_j, j), high_j = std::max(high_j, j);
        }
    }
    std::vector<PatchId> patches;
    for (int j = low_j; j <= high_j; ++j) {
        for (int i = low_i; i <= high_i; ++i) {
            const auto in_cell = grid_.patches_in_cell(cells.first_cell + static_cast<std::size_t>(j * cells.nu + i));
            patches.insert(patches.end(), in_cell.begin(), in_cell.end());
        }
    }
    std::ranges::sort(patches);
    patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
    return patches;
}

}  // namespace naturel
