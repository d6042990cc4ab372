#include "cli/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <utility>

#include "core/tone_mapping.h"
#include "core/units.h"

namespace naturel {
namespace {

using glm::dvec3;

/// Nearer than this to an edge is on it: a little more than what makes two corners one node (core/patch_grid.cpp).
constexpr double on_edge_m = 2e-7;

SurfaceLight light_of(const Result& result, const PointIlluminance& point, const Band3& luminance_cd_m2) {
    return {.parts = components_of(result.primaries, point.direct, point.indirect_lx),
            .total_lx = point.total_lx(),
            .daylight_factor_percent = daylight_factor_percent(result, point).value_or(0.0),
            .luminance_cd_m2 = luminance_cd_m2};
}

void add(SurfaceLight& sum, double weight, const SurfaceLight& light) {
    for (const auto part : {&Components::sky_lx, &Components::sun_lx, &Components::erc_ground_lx, &Components::erc_buildings_lx,
                            &Components::irc_lx})
        sum.parts.*part += weight * (light.parts.*part);
    sum.total_lx += weight * light.total_lx;
    sum.daylight_factor_percent += weight * light.daylight_factor_percent;
    sum.luminance_cd_m2 += weight * light.luminance_cd_m2;
}

/// Builds a mesh face by face.
class MeshBuilder {
public:
    explicit MeshBuilder(const Result& result) : result_(result), grid_(result.grid) {}

    SurfaceMesh run() {
        for (std::size_t n = 0; n < grid_.nodes.size(); ++n) {
            const Node& node = grid_.nodes[n];
            const PointIlluminance& point = result_.solution.nodes[n];
            const Material& material =
                result_.scene.materials[index(result_.building.faces[index(node.face)].material)];
            mesh_.positions_m.push_back(node.position_m);
            mesh_.light.push_back(light_of(
                result_, point, 1.0 / pi * (material.reflectance * point.total_lx() + material.exitance_lm_m2)));
        }
        for (std::size_t p = 0; p < grid_.patches.size(); ++p)
            mesh_.patch_light.push_back(light_of_patch(p));
        for (std::size_t p = 0, end = 0; p < grid_.patches.size(); p = end) {
            end = p;
            while (end < grid_.patches.size() && grid_.patches[end].face == grid_.patches[p].face) ++end;
            add_face(p, end);
        }
        return std::move(mesh_);
    }

private:
    using Bin = std::pair<std::int64_t, std::int64_t>;  ///< of corners, for the search

    /// A corner of the face at work.
    struct Corner {
        std::uint32_t vertex;
        std::uint32_t zone;  ///< corners of other zones are no corners of a patch
    };

    SurfaceLight light_of_patch(std::size_t p) const {
        const DaylightSolution& solution = result_.solution;
        if (p >= grid_.gather_patch_count)
            return {.luminance_cd_m2 = solution.outdoors.patch_luminance_cd_m2[p].total()};
        return light_of(result_, {solution.patch_components[p], solution.radiosity.indirect_illuminance_lx[p]},
                        1.0 / pi * solution.radiosity.exitance_lm_m2[p].total());
    }

    std::uint32_t zone_of(std::size_t p) const {
        const bool aperture = p >= grid_.indoor_patch_count && p < grid_.gather_patch_count;
        return aperture ? static_cast<std::uint32_t>(p) : grid_.patches[p].sunspot;
    }

    std::uint32_t add_vertex(const dvec3& position_m, const SurfaceLight& light) {
        mesh_.positions_m.push_back(position_m);
        mesh_.light.push_back(light);
        return static_cast<std::uint32_t>(mesh_.positions_m.size() - 1);
    }

    std::uint32_t corner_vertex(std::size_t p, std::size_t corner) {
        const std::size_t c = grid_.patches[p].first_corner + corner;
        if (p < grid_.indoor_patch_count) return static_cast<std::uint32_t>(index(grid_.corners[c]));
        const dvec3& place = grid_.corner_positions_m[c];
        if (p < grid_.gather_patch_count) return add_vertex(place, mesh_.patch_light[p]);
        return add_vertex(place, {.luminance_cd_m2 = result_.solution.outdoors.corner_luminance_cd_m2[c].total()});
    }

    void add_face(std::size_t first_patch, std::size_t end_patch) {
        const PatchGrid::FaceGrid& frame = grid_.face_grid(grid_.patches[first_patch].face);
        const auto bin_of = [&](const dvec3& place, double shift) {
            const dvec3 d = place - frame.origin_m;
            return Bin(static_cast<std::int64_t>(std::floor(glm::dot(d, frame.du) + shift)),
                       static_cast<std::int64_t>(std::floor(glm::dot(d, frame.dv) + shift)));
        };
        std::vector<std::vector<std::uint32_t>> polygons;
        std::map<Bin, std::vector<Corner>> bins;
        for (std::size_t p = first_patch; p < end_patch; ++p) {
            std::vector<std::uint32_t>& polygon = polygons.emplace_back();
            for (std::size_t k = 0; k < grid_.patches[p].corner_count; ++k) {
                polygon.push_back(corner_vertex(p, k));
                std::vector<Corner>& bin = bins[bin_of(mesh_.positions_m[polygon.back()], 0.0)];
                const auto same = [&](const Corner& corner) { return corner.vertex == polygon.back(); };
                if (std::ranges::none_of(bin, same)) bin.push_back({polygon.back(), zone_of(p)});
            }
        }
        std::vector<double> weights;
        for (std::size_t p = first_patch; p < end_patch; ++p) {
            const std::vector<std::uint32_t>& polygon = polygons[p - first_patch];
            weights.resize(polygon.size());
            grid_.interpolation_weights(make_id<PatchId>(p), grid_.patches[p].centroid_m, weights);
            SurfaceLight& centre = mesh_.centre_light.emplace_back();
            for (std::size_t k = 0; k < polygon.size(); ++k) add(centre, weights[k], mesh_.light[polygon[k]]);
            for (std::size_t k = 0; k < polygon.size(); ++k) {
                const std::uint32_t from = polygon[k], to = polygon[(k + 1) % polygon.size()];
                mesh_.outlines.push_back(from);
                const dvec3 a = mesh_.positions_m[from], b = mesh_.positions_m[to];
                // By rounding a corner may lie in the bin beside that of an edge between two.
                constexpr double margin = 1e-3;
                const Bin a_low = bin_of(a, -margin), a_high = bin_of(a, margin);
                const Bin b_low = bin_of(b, -margin), b_high = bin_of(b, margin);
                add_corners_on_edge(from, to, zone_of(p), bins,
                                    {std::min(a_low.first, b_low.first), std::min(a_low.second, b_low.second)},
                                    {std::max(a_high.first, b_high.first), std::max(a_high.second, b_high.second)});
            }
            mesh_.first.push_back(static_cast<std::uint32_t>(mesh_.outlines.size()));
        }
    }

    void add_corners_on_edge(std::uint32_t from, std::uint32_t to, std::uint32_t zone,
                             const std::map<Bin, std::vector<Corner>>& bins, Bin low, Bin high) {
        const dvec3 a = mesh_.positions_m[from], edge = mesh_.positions_m[to] - a;
        const double length = glm::length(edge);
        struct Found {
            double along_m;
            bool foreign;
            std::uint32_t vertex;
            auto operator<=>(const Found&) const = default;
        };
        std::vector<Found> found;
        for (std::int64_t i = low.first; i <= high.first; ++i)
            for (auto bin = bins.lower_bound({i, low.second}); bin != bins.end() && bin->first <= Bin{i, high.second}; ++bin)
                for (const Corner& corner : bin->second) {
                    const dvec3 d = mesh_.positions_m[corner.vertex] - a;
                    const double along = glm::dot(d, edge) / length;
                    if (along <= on_edge_m || along >= length - on_edge_m) continue;
                    if (glm::length(d - along / length * edge) < on_edge_m)
                        found.push_back({along, corner.zone != zone, corner.vertex});
                }
        std::ranges::sort(found);
        for (std::size_t k = 0; k < found.size();) {
            // Of the corners in one place the patch's own counts.
            std::size_t end = k + 1;
            const Found* best = &found[k];
            for (; end < found.size() && found[end].along_m - found[k].along_m < on_edge_m; ++end)
                if (best->foreign && !found[end].foreign) best = &found[end];
            std::uint32_t vertex = best->vertex;
            if (best->foreign) {
                SurfaceLight light;
                add(light, 1.0 - best->along_m / length, mesh_.light[from]);
                add(light, best->along_m / length, mesh_.light[to]);
                vertex = add_vertex(mesh_.positions_m[best->vertex], light);
            }
            mesh_.outlines.push_back(vertex);
            k = end;
        }
    }

    const Result& result_;
    const PatchGrid& grid_;
    SurfaceMesh mesh_;
};

}  // namespace

double SurfaceLight::illuminance_lx() const {
    return parts.sky_lx + parts.sun_lx + parts.erc_ground_lx + parts.erc_buildings_lx + parts.irc_lx;
}

SurfaceMesh make_surface_mesh(const Result& result) {
    return MeshBuilder(result).run();
}

double white_of_patches_cd_m2(const Result& result, const SurfaceMesh& mesh, std::size_t first, std::size_t last) {
    constexpr double pixels = 1e5;
    double area_m2 = 0.0;
    for (std::size_t p = first; p < last; ++p) area_m2 += result.grid.patches[p].area_m2;
    std::vector<double> luminance;
    for (std::size_t p = first; p < last; ++p)
        luminance.insert(luminance.end(),
                         static_cast<std::size_t>(std::ceil(pixels * result.grid.patches[p].area_m2 / area_m2)),
                         result.primaries.luminous(mesh.patch_light[p].luminance_cd_m2));
    return white_luminance_cd_m2(std::move(luminance), {});
}

}  // namespace naturel
