#include "embree_backend/embree_visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <string>

#include "core/errors.h"
#include "core/parallel.h"
#include "core/view.h"
#include "embree_backend/embree_api.h"
#include "embree_backend/pairwise.h"
#include "embree_backend/sampling.h"

namespace naturel {
namespace {

using embree_api::Packet;
using embree_api::packet_size;
using namespace embree_sampling;

/// What a hit asks of a facet. Coordinates are relative to the centre of the building, as in the Embree
/// scenes.
struct TracedFacet {
    glm::dvec3 normal{};
    double plane_m = 0.0;  ///< dot(normal, p) of its points
    FaceId face{};
    bool receives = false;  ///< indoor or aperture: light that comes from the front is its own
    std::uint32_t first_twin = 0, twin_count = 0;
    std::uint32_t first_vertex = 0, vertex_count = 0;
};

/// Points on the shared plane of two facets count as common within this: a thousand times the grid of
/// Clipper, a tenth of anything that is built.
constexpr double same_place_m = 1e-6;

class EmbreeVisibility final : public Visibility {
public:
    EmbreeVisibility(const Building& building, const PatchGrid& grid, const EmbreeOptions& options)
        : grid_(grid),
          seed_(options.seed),
          patch_tiles_(make_tiles(options.rays_per_patch)),
          point_tiles_(make_tiles(options.rays_per_point)),
          device_(embree_api::make_device()) {
        place(building);
        find_twins(building);
        build_scenes(building);
        if (options.form_factors == FormFactorMethod::pairwise) {
            pairwise_ = std::make_unique<PairwiseExchange>(building, grid, PairwiseOptions{options.pair_tolerance});
            pair_tolerance_ = options.pair_tolerance;
        }
    }

    std::string_view name() const noexcept override { return "embree"; }

    std::vector<std::pair<std::string, std::string>> settings() const override {
        if (pairwise_)
            return {{"form_factors", "pairwise"},
                    {"pair_tolerance", fmt::format("{:g}", pair_tolerance_)},
                    {"embree", RTC_VERSION_STRING}};
        return {{"form_factors", "hemisphere"},
                {"rays_per_patch", std::to_string(patch_tiles_.rays())},
                {"rays_per_point", std::to_string(point_tiles_.rays())},
                {"seed", std::to_string(seed_)},
                {"embree", RTC_VERSION_STRING}};
    }

    void form_factor_row(PatchId from, FormFactorRow& row) const override {
        if (pairwise_) return pairwise_->row(from, row);
        const Patch& patch = grid_.patches[index(from)];
        const glm::dvec3 shift = lift_m_ * patch.normal - centre_m_;
        const PolygonSampler sampler(grid_.polygon_of(from), patch.centroid_m, lift_m_, shift);
        const std::uint64_t random = mix(mix(seed_) ^ index(from));
        const auto first_starts = [&](std::uint32_t number, Packet& packet) {
            float u[packet_size], v[packet_size];
            tile_points(number, static_cast<std::uint32_t>(random >> 32), u, v);
            sampler.place(u, v, packet.rays.ray.org_x, packet.rays.ray.org_y, packet.rays.ray.org_z);
        };
        // A crack between facets is missed when the whole ray moves aside: by a hundredth of the way to the
        // centroid.
        const auto second_start = [&](const SecondTry& lost) {
            return lost.start + 0.01 * (patch.centroid_m + shift - lost.start);
        };
        collect(patch.normal, patch_tiles_, static_cast<std::uint32_t>(random), first_starts, second_start,
                row);
    }

    FormFactorRows form_factor_rows(std::size_t count, bool with_errors, Progress& progress) const override {
        if (pairwise_ && count == grid_.gather_patch_count) return pairwise_->rows(with_errors, progress);
        return Visibility::form_factor_rows(count, with_errors, progress);
    }

    void gather_row(const GatherPoint& from, FormFactorRow& row) const override {
        if (pairwise_) return pairwise_->row(from, row);
        const double lift_m = lift_at(from.position_m);
        const glm::vec3 lifted(from.position_m - centre_m_ + lift_m * from.normal);
        std::uint64_t random = mix(seed_);
        for (const double x : {from.position_m.x, from.position_m.y, from.position_m.z, from.normal.x,
                               from.normal.y, from.normal.z})
            random = mix(random ^ std::bit_cast<std::uint64_t>(x));
        const auto first_starts = [&](std::uint32_t, Packet& packet) {
            for (unsigned k = 0; k < packet_size; ++k)
                packet.set_origin(k, lifted);
        };
        // A point in the corner of a room may lie behind the neighbouring wall by a rounding. Rays that leave
        // the wall meet its back at once and start in front of it the second time; rays that go into it start
        // farther back along the surface.
        const auto second_start = [&](const SecondTry& lost) {
            if (lost.distance_m < 4.0 * lift_m) return lost.start + 64.0 * lift_m * lost.direction;
            return lost.start -
                   64.0 * lift_m * (lost.direction - glm::dot(lost.direction, from.normal) * from.normal);
        };
        collect(from.normal, point_tiles_, static_cast<std::uint32_t>(random), first_starts, second_start,
                row);
    }

    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                    std::span<FacetId> seen) const override {
        NATUREL_EXPECT(directions.size() == seen.size());
        const glm::vec3 lifted(from.position_m - centre_m_ + lift_at(from.position_m) * from.normal);
        Packet packet;
        for (std::size_t first = 0; first < directions.size(); first += packet_size) {
            const unsigned count =
                static_cast<unsigned>(std::min<std::size_t>(packet_size, directions.size() - first));
            for (unsigned k = 0; k < packet_size; ++k) {
                packet.set_origin(k, lifted);
                packet.set_direction(k, glm::vec3(directions[first + std::min(k, count - 1)]));
            }
            embree_api::trace(opaque_.get(), packet, count);
            for (unsigned k = 0; k < count; ++k)
                seen[first + k] = seen_by(packet, k);
        }
    }

    void view_facets(const View& view, std::span<FacetId> seen) const override {
        const Camera camera = make_camera(view);
        NATUREL_EXPECT(seen.size() ==
                       static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
        parallel_for(static_cast<std::size_t>(camera.height + 3) / 4, 1, [&](std::size_t tile_row) {
            Packet packet;
            for (int left = 0; left < camera.width; left += 4) {
                // Pixels past the right and lower margins repeat the last column and row.
                const auto column = [&](unsigned k) {
                    return std::min(left + static_cast<int>(k % 4), camera.width - 1);
                };
                const auto row = [&](unsigned k) {
                    return std::min(4 * static_cast<int>(tile_row) + static_cast<int>(k / 4),
                                    camera.height - 1);
                };
                for (unsigned k = 0; k < packet_size; ++k) {
                    const Camera::Ray ray = camera.ray(column(k) + 0.5, row(k) + 0.5);
                    packet.set_origin(k, glm::vec3(ray.origin_m - centre_m_));
                    packet.set_direction(k, glm::vec3(ray.direction));
                }
                embree_api::trace(opaque_.get(), packet);
                for (unsigned k = 0; k < packet_size; ++k)
                    seen[static_cast<std::size_t>(row(k)) * static_cast<std::size_t>(camera.width) +
                         static_cast<std::size_t>(column(k))] = seen_by(packet, k);
            }
        });
    }

private:
    /// A ray that met nothing, a back or the outdoors.
    struct SecondTry {
        glm::dvec3 start, direction;
        double distance_m;  ///< to what it met; infinite for nothing
    };

    /// Hits of one row, per patch. All zero between two rows.
    struct RowScratch {
        std::vector<std::uint32_t> hits;     ///< [gather_patch_count]
        std::vector<std::uint64_t> touched;  ///< one bit per patch: read in order, no sorting
        std::vector<SecondTry> second_tries;
    };

    /// How far an origin is lifted off its surface. Rounding to float moves each vertex and each origin by up to half a
    /// unit in the last place per axis, and the distances that Embree computes by a few more. 16 units keep an origin in
    /// front of its own facet. Measured from the rooms: an outdoor point far away is rounded more coarsely.
    double lift_at(const glm::dvec3& point_m) const {
        const glm::dvec3 d = glm::abs(point_m - centre_m_);
        return std::max(lift_m_, 16.0 * 0x1p-23 * std::max({d.x, d.y, d.z}));
    }

    /// Centres the coordinates on the rooms, where floats shall be finest whatever stands far away outdoors.
    void place(const Building& building) {
        glm::dvec3 low(std::numeric_limits<double>::infinity());
        glm::dvec3 high = -low;
        for (const bool indoor_only : {true, false}) {
            if (low.x <= high.x) break;  // outdoor facets count only where there is no room
            for (const Facet& facet : building.facets) {
                if (indoor_only && facet.environment == Environment::outdoor) continue;
                for (const glm::dvec3& v : facet.vertices_m) {
                    low = glm::min(low, v);
                    high = glm::max(high, v);
                }
            }
        }
        if (building.facets.empty()) low = high = {};
        centre_m_ = 0.5 * (low + high);
        const glm::dvec3 half = 0.5 * (high - low);
        lift_m_ = 16.0 * 0x1p-23 * std::max({half.x, half.y, half.z, 1e-3});

        std::uint32_t first_vertex = 0;
        for (const Facet& facet : building.facets) {
            TracedFacet traced;
            traced.normal = facet.normal;
            traced.plane_m = glm::dot(facet.normal, facet.vertices_m[0] - centre_m_);
            traced.face = facet.face;
            traced.receives = facet.is_aperture || facet.environment == Environment::indoor;
            traced.first_vertex = first_vertex;
            traced.vertex_count = static_cast<std::uint32_t>(facet.vertices_m.size());
            first_vertex += traced.vertex_count;
            for (const glm::dvec3& v : facet.vertices_m)
                vertices_m_.push_back(v - centre_m_);
            facets_.push_back(traced);
        }
    }

    /// Lists for each facet those that lie back to back with it: the two sides of an inner aperture or of a
    /// two-sided polygon. Embree meets either of them; the one that faces the ray is meant.
    void find_twins(const Building& building) {
        std::vector<std::uint32_t> order(facets_.size());
        std::iota(order.begin(), order.end(), 0u);
        const auto distance = [&](std::uint32_t f) { return std::abs(facets_[f].plane_m); };
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return distance(a) < distance(b) || (distance(a) == distance(b) && a < b);
        });
        std::vector<std::vector<std::uint32_t>> twins(facets_.size());
        for (std::size_t i = 0; i < order.size(); ++i)
            for (std::size_t j = i + 1;
                 j < order.size() && distance(order[j]) - distance(order[i]) <= same_place_m; ++j) {
                const TracedFacet& a = facets_[order[i]];
                const TracedFacet& b = facets_[order[j]];
                if (building.facets[order[i]].is_aperture != building.facets[order[j]].is_aperture) continue;
                if (glm::dot(a.normal, b.normal) > -1.0 + 1e-9 ||
                    std::abs(a.plane_m + b.plane_m) > same_place_m)
                    continue;
                if (!boxes_touch(a, b)) continue;
                twins[order[i]].push_back(order[j]);
                twins[order[j]].push_back(order[i]);
            }
        for (std::size_t f = 0; f < facets_.size(); ++f) {
            facets_[f].first_twin = static_cast<std::uint32_t>(twins_.size());
            facets_[f].twin_count = static_cast<std::uint32_t>(twins[f].size());
            twins_.insert(twins_.end(), twins[f].begin(), twins[f].end());
        }
    }

    std::span<const glm::dvec3> polygon(const TracedFacet& facet) const {
        return {vertices_m_.data() + facet.first_vertex, facet.vertex_count};
    }

    bool boxes_touch(const TracedFacet& a, const TracedFacet& b) const {
        const auto box = [&](const TracedFacet& f) {
            std::pair<glm::dvec3, glm::dvec3> corners{polygon(f)[0], polygon(f)[0]};
            for (const glm::dvec3& v : polygon(f))
                corners = {glm::min(corners.first, v), glm::max(corners.second, v)};
            return corners;
        };
        const auto [low_a, high_a] = box(a);
        const auto [low_b, high_b] = box(b);
        for (int axis = 0; axis < 3; ++axis)
            if (low_a[axis] > high_b[axis] + same_place_m || low_b[axis] > high_a[axis] + same_place_m)
                return false;
        return true;
    }

    void build_scenes(const Building& building) {
        std::vector<glm::vec3> vertices;
        for (const glm::dvec3& v : vertices_m_)
            vertices.emplace_back(v);
        std::vector<embree_api::Triangle> triangles;
        std::size_t opaque_triangles = 0;
        for (std::uint32_t f = 0; f < facets_.size(); ++f) {
            const std::span<const glm::dvec3> v = polygon(facets_[f]);
            for (std::uint32_t k = 1; k + 1 < v.size(); ++k) {
                const double doubled_area = glm::length(glm::cross(v[k] - v[0], v[k + 1] - v[0]));
                const double longest = std::max(
                    {glm::length(v[k] - v[0]), glm::length(v[k + 1] - v[0]), glm::length(v[k + 1] - v[k])});
                if (doubled_area <= longest / nanometres_per_metre)
                    continue;  // thinner than the grid of the geometry
                const std::uint32_t first = facets_[f].first_vertex;
                triangles.push_back({first, first + k, first + k + 1});
                facet_of_triangle_.push_back(f);
            }
            NATUREL_EXPECT(building.facets[f].is_aperture || f == 0 || !building.facets[f - 1].is_aperture);
            if (!building.facets[f].is_aperture) opaque_triangles = triangles.size();
        }
        surfaces_ = embree_api::make_scene(device_.get(), vertices, triangles);
        opaque_ =
            embree_api::make_scene(device_.get(), vertices, std::span(triangles).first(opaque_triangles));
    }

    /// Where a ray meets the plane of a facet. In double from the plane, which Embree's float distance is too
    /// coarse for.
    static glm::dvec3 meeting_point(const TracedFacet& facet, const glm::dvec3& start,
                                    const glm::dvec3& direction) {
        return start + ((facet.plane_m - glm::dot(facet.normal, start)) / glm::dot(facet.normal, direction)) *
                           direction;
    }

    /// The facet that ray k met: of two that lie back to back, the one that faces it.
    std::uint32_t facing(const Packet& packet, unsigned k, std::uint32_t facet) const {
        const TracedFacet& met = facets_[facet];
        if (met.twin_count == 0) return facet;
        const glm::dvec3 direction = packet.direction(k);
        if (glm::dot(met.normal, direction) < 0.0) return facet;
        const glm::dvec3 point = meeting_point(met, packet.origin(k), direction);
        for (const std::uint32_t twin : std::span(twins_).subspan(met.first_twin, met.twin_count))
            if (inside(facets_[twin], point)) return twin;
        return facet;
    }

    bool inside(const TracedFacet& facet, const glm::dvec3& point) const {
        const std::span<const glm::dvec3> v = polygon(facet);
        for (std::size_t k = 0; k < v.size(); ++k) {
            const glm::dvec3 edge = v[(k + 1) % v.size()] - v[k];
            if (glm::dot(glm::cross(facet.normal, edge), point - v[k]) < -same_place_m * glm::length(edge))
                return false;
        }
        return true;
    }

    FacetId seen_by(const Packet& packet, unsigned k) const {
        const std::uint32_t triangle = packet.triangle(k);
        return triangle == embree_api::no_hit
                   ? FacetId::none
                   : make_id<FacetId>(facing(packet, k, facet_of_triangle_[triangle]));
    }

    /// The patch whose front ray k of a traced packet met; none when it met nothing, a back or the outdoors.
    PatchId patch_met(const Packet& packet, unsigned k) const {
        const std::uint32_t triangle = packet.triangle(k);
        if (triangle == embree_api::no_hit) return PatchId::none;
        const TracedFacet& facet = facets_[facing(packet, k, facet_of_triangle_[triangle])];
        const glm::dvec3 direction = packet.direction(k);
        if (!facet.receives || glm::dot(facet.normal, direction) >= 0.0) return PatchId::none;
        return grid_.patch_at(facet.face, meeting_point(facet, packet.origin(k), direction) + centre_m_);
    }

    /// Shoots the rays of all tiles; each weighs 1 / rays.
    /// first_starts(n, packet): sets the origins of packet n, lifted; neighbouring tiles have neighbouring
    /// numbers. second_start(start, direction): lifted origin of the second try of a ray that would be lost.
    template <class FirstStarts, class SecondStart>
    void collect(const glm::dvec3& normal, const Tiles& tiles, std::uint32_t key,
                 const FirstStarts& first_starts, const SecondStart& second_start, FormFactorRow& row) const {
        RowScratch& scratch = scratch_.local();
        scratch.hits.resize(grid_.gather_patch_count);
        scratch.touched.resize((grid_.gather_patch_count + 63) / 64);
        scratch.second_tries.clear();
        const auto count_hit = [&](PatchId patch) {
            ++scratch.hits[index(patch)];
            scratch.touched[index(patch) / 64] |= std::uint64_t{1} << (index(patch) % 64);
        };

        const HemisphereFrame frame(normal);
        Packet packet;
        for (int tile_row = 0; tile_row < tiles.rows; ++tile_row)
            for (int tile_column = 0; tile_column < tiles.columns; ++tile_column) {
                first_starts(
                    morton(static_cast<std::uint32_t>(tile_row), static_cast<std::uint32_t>(tile_column)),
                    packet);
                tile_directions(frame, tiles, tile_row, tile_column, key, packet.rays.ray.dir_x,
                                packet.rays.ray.dir_y, packet.rays.ray.dir_z);
                embree_api::trace(surfaces_.get(), packet);
                for (unsigned k = 0; k < packet_size; ++k) {
                    if (const PatchId patch = patch_met(packet, k); patch != PatchId::none)
                        count_hit(patch);
                    else
                        scratch.second_tries.push_back(
                            {packet.origin(k), packet.direction(k), packet.rays.ray.tfar[k]});
                }
            }

        int lost = 0;
        for (std::size_t first = 0; first < scratch.second_tries.size(); first += packet_size) {
            const unsigned count = static_cast<unsigned>(
                std::min<std::size_t>(packet_size, scratch.second_tries.size() - first));
            for (unsigned k = 0; k < packet_size; ++k) {
                const SecondTry& ray = scratch.second_tries[first + std::min(k, count - 1)];
                packet.set_origin(k, glm::vec3(second_start(ray)));
                packet.set_direction(k, glm::vec3(ray.direction + 1e-4 * normal));
            }
            embree_api::trace(surfaces_.get(), packet, count);
            for (unsigned k = 0; k < count; ++k) {
                if (const PatchId patch = patch_met(packet, k); patch != PatchId::none)
                    count_hit(patch);
                else
                    ++lost;
            }
        }

        row.clear();
        const double weight = 1.0 / tiles.rays();
        for (std::size_t word = 0; word < scratch.touched.size(); ++word) {
            for (std::uint64_t bits = scratch.touched[word]; bits != 0; bits &= bits - 1) {
                const std::size_t patch = 64 * word + static_cast<std::size_t>(std::countr_zero(bits));
                row.patches.push_back(make_id<PatchId>(patch));
                row.values.push_back(weight * scratch.hits[patch]);
                scratch.hits[patch] = 0;
            }
            scratch.touched[word] = 0;
        }
        row.lost = weight * lost;
    }

    PatchGrid grid_;
    std::uint64_t seed_;
    Tiles patch_tiles_, point_tiles_;
    glm::dvec3 centre_m_{};
    double lift_m_ = 0.0;  ///< of origins on the surfaces of the rooms, see lift_at()
    std::vector<TracedFacet> facets_;
    std::vector<glm::dvec3> vertices_m_;  ///< of all facets, one after the other
    std::vector<std::uint32_t> twins_;    ///< see TracedFacet::first_twin
    std::vector<std::uint32_t> facet_of_triangle_;
    embree_api::Device device_;
    embree_api::Scene surfaces_;  ///< with the apertures, which are surfaces to form factors
    embree_api::Scene opaque_;    ///< without: its triangles are the first of `surfaces_`
    std::unique_ptr<const PairwiseExchange> pairwise_;  ///< null: hemispheres of rays
    double pair_tolerance_ = 0.0;
    mutable ThreadScratch<RowScratch> scratch_;
};

}  // namespace

std::unique_ptr<Visibility> make_embree_visibility(const Building& building, const PatchGrid& grid,
                                                   const EmbreeOptions& options) {
    return std::make_unique<EmbreeVisibility>(building, grid, options);
}

}  // namespace naturel
