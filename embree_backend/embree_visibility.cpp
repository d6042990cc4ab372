#include "embree_backend/embree_visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <string>

#include "core/errors.h"
#include "core/parallel.h"
#include "core/view.h"
#include "embree_backend/cell_patches.h"
#include "embree_backend/embree_api.h"
#include "embree_backend/hit_counts.h"
#include "embree_backend/hit_lookup.h"
#include "embree_backend/pairwise.h"
#include "embree_backend/sampling.h"

namespace naturel {
namespace {

using embree_api::Packet;
using embree_api::packet_size;
using embree_api::WidePacket;
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

/// Cracks between facets are no wider than rounding, a sixteenth of a lift: a ray that moves aside by this many lifts passes none
/// that is not in line with the way it moves.
constexpr double crack_lifts = 4.0;

/// Rays of one stratification; rows with more are made of several.
constexpr int most_rays_per_table = 1 << 17;

/// Of a row that is asked for so many: whole tables.
int rounded_rays(int rays) {
    if (rays <= most_rays_per_table) return make_tiles(rays).rays();
    return (rays + most_rays_per_table - 1) / most_rays_per_table * most_rays_per_table;
}

/// How many tables of one size there are: enough that few rows share one (and one of its eight positions), few enough that
/// making them is a small part of the work and that they take no more than some 25 MB. A row of several tables takes one
/// after the other.
std::size_t table_count(int rays, std::size_t rows) {
    const std::size_t fitting = (std::size_t{16} << 20) / (12 * static_cast<std::size_t>(rays));
    return std::clamp<std::size_t>(std::min(rows / 64, fitting), rays <= 1024 ? 256 : rays <= 4096 ? 64 : 16, 256);
}

/// Rows from points are few or many; nobody says.
constexpr std::size_t usual_point_rows = 512;

class EmbreeVisibility final : public Visibility {
public:
    EmbreeVisibility(const Building& building, const PatchGrid& grid, const EmbreeOptions& options)
        : grid_(grid),
          cells_(grid, building.faces.size()),
          seed_(options.seed),
          target_error_(options.target_error),
          patch_rays_(rounded_rays(options.rays_per_patch)),
          most_patch_rays_(std::max(options.most_rays_per_patch, patch_rays_)),
          point_rays_(rounded_rays(options.rays_per_point)),
          closed_(std::ranges::none_of(building.faces, &Face::sheet)),
          device_(embree_api::make_device()),
          wide_(embree_api::has_wide_packets(device_.get())) {
        add_tables(patch_tables_, patch_rays_, grid.gather_patch_count);
        if (target_error_ > 0.0)
            for (int rays = patch_rays_; rays < most_patch_rays_ && rays < most_rays_per_table; rays *= 2)
                add_tables(patch_tables_, 2 * rays, grid.gather_patch_count);
        add_tables(point_tables_, point_rays_, usual_point_rows);
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
                    {"pair_tolerance", fmt::format("{}", pair_tolerance_)},
                    {"embree", RTC_VERSION_STRING}};
        std::vector<std::pair<std::string, std::string>> all{{"form_factors", "hemisphere"},
                                                             {"rays_per_patch", std::to_string(patch_rays_)},
                                                             {"rays_per_point", std::to_string(point_rays_)}};
        if (target_error_ > 0.0) {
            all.emplace_back("target_error", fmt::format("{}", target_error_));
            all.emplace_back("most_rays_per_patch", std::to_string(most_patch_rays_));
        }
        all.emplace_back("seed", std::to_string(seed_));
        all.emplace_back("embree", RTC_VERSION_STRING);
        return all;
    }

    void form_factor_row(PatchId from, FormFactorRow& row) const override {
        if (pairwise_) return pairwise_->row(from, row);
        const Patch& patch = grid_.patches[index(from)];
        const glm::dvec3 shift = lift_m_ * patch.normal - centre_m_;
        const PolygonSampler sampler(grid_.polygon_of(from), patch.centroid_m, lift_m_, shift);
        // A crack between facets is missed when the whole ray moves aside, towards the centroid or across. By little: a ray
        // that passes the edge of a facet has really gone.
        const auto moved_start = [&](const LostRay& lost, int attempt) {
            const glm::dvec3 inwards = patch.centroid_m + shift - lost.start;
            const double way_m = glm::length(inwards), step_m = std::min(crack_lifts * lift_m_, 0.5 * way_m);
            if (way_m == 0.0) return lost.start;
            const glm::dvec3 aside = attempt == 0 ? inwards : inwards + glm::cross(patch.normal, inwards);
            return lost.start + (step_m / glm::length(aside)) * aside;
        };
        RowScratch& scratch = begin_row();
        const std::uint64_t random = mix(mix(seed_) ^ index(from));
        std::int64_t rays = 0;
        std::uint64_t draws = 0;
        const auto shoot_more = [&](std::int64_t more) {
            while (more > 0) {
                const RayTables& tables = largest_within(patch_tables_, more);
                const std::uint64_t bits = mix(random + static_cast<std::uint64_t>(rays));
                const std::uint64_t starts = mix(bits);
                const DigitalShift digits{static_cast<std::uint32_t>(starts), static_cast<std::uint32_t>(starts >> 32)};
                const RayTable& table = tables.table((random >> 3) + draws++);
                shoot(patch.normal, table, static_cast<std::uint32_t>(bits & 7u),
                      [&](const HemisphereFrame& frame, std::size_t first, const RayLanes& lanes) {
                          if (sampler.parallelogram_m()) {
                              place_rays(frame, table, sampler.parallelogram_m(), tables.starts(), digits, first, lanes);
                          } else {
                              sampler.place(tables.starts(), first, digits, lanes.start_x, lanes.start_y, lanes.start_z);
                              place_directions(frame, table, first, lanes.x, lanes.y, lanes.z);
                          }
                      },
                      moved_start, scratch);
                more -= table.rays();
                rays += table.rays();
            }
        };
        shoot_more(patch_rays_);
        if (target_error_ > 0.0)
            while (rays < most_patch_rays_ && scratch.hits.estimate_error(rays) > target_error_) shoot_more(rays);
        finish_row(scratch, rays, row);
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
        // A point in the corner of a room may lie behind the neighbouring wall by a rounding. Rays that leave
        // the wall meet its back at once and start in front of it the second time; rays that go into it start
        // farther back along the surface.
        const auto moved_start = [&](const LostRay& lost, int attempt) {
            if (lost.distance_m < 4.0 * lift_m) return lost.start + (attempt + 1) * 64.0 * lift_m * lost.direction;
            const glm::dvec3 ahead = lost.direction - glm::dot(lost.direction, from.normal) * from.normal;
            return lost.start - 64.0 * lift_m * ahead + attempt * crack_lifts * lift_m * glm::cross(from.normal, ahead);
        };
        RowScratch& scratch = begin_row();
        std::int64_t rays = 0;
        std::uint64_t draws = 0;
        while (rays < point_rays_) {
            const std::uint64_t bits = mix(random + static_cast<std::uint64_t>(rays));
            const RayTable& table = largest_within(point_tables_, point_rays_ - rays).table((random >> 3) + draws++);
            shoot(from.normal, table, static_cast<std::uint32_t>(bits & 7u),
                  [&](const HemisphereFrame& frame, std::size_t first, const RayLanes& lanes) {
                      std::fill_n(lanes.start_x, rays_per_packet, lifted.x);
                      std::fill_n(lanes.start_y, rays_per_packet, lifted.y);
                      std::fill_n(lanes.start_z, rays_per_packet, lifted.z);
                      place_directions(frame, table, first, lanes.x, lanes.y, lanes.z);
                  },
                  moved_start, scratch);
            rays += table.rays();
        }
        finish_row(scratch, rays, row);
    }

    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                    std::span<FacetId> seen) const override {
        NATUREL_EXPECT(directions.size() == seen.size());
        for_each_packet(from, directions, [&](auto& packet, std::size_t first, unsigned count) {
            embree_api::trace(opaque_.get(), packet, count);
            for (unsigned k = 0; k < count; ++k)
                seen[first + k] = seen_by(packet, k);
        });
    }

    void occluded(const GatherPoint& from, std::span<const glm::dvec3> directions,
                  std::span<std::uint8_t> blocked) const override {
        NATUREL_EXPECT(directions.size() == blocked.size());
        for_each_packet(from, directions, [&](auto& packet, std::size_t first, unsigned count) {
            embree_api::trace_occlusion(opaque_.get(), packet, count);
            for (unsigned k = 0; k < count; ++k)
                blocked[first + k] = packet.blocked(k);
        });
    }

    void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const override {
        NATUREL_EXPECT(seen.size() == static_cast<std::size_t>(row_end - row_begin) * static_cast<std::size_t>(camera.width));
        if (wide_)
            view_facets_by<WidePacket>(camera, row_begin, row_end, seen);
        else
            view_facets_by<Packet>(camera, row_begin, row_end, seen);
    }

private:
    /// A packet is four pixels wide.
    template <class AnyPacket>
    void view_facets_by(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const {
        const auto width = static_cast<std::size_t>(camera.width);
        AnyPacket packet;
        for (int top = row_begin; top < row_end; top += static_cast<int>(AnyPacket::size / 4)) {
            for (int left = 0; left < camera.width; left += 4) {
                // Pixels past the right and lower margins repeat the last column and row.
                const auto column = [&](unsigned k) { return std::min(left + static_cast<int>(k % 4), camera.width - 1); };
                const auto row = [&](unsigned k) { return std::min(top + static_cast<int>(k / 4), row_end - 1); };
                start_view_packet(camera, row, column, packet);
                trace_view_packet(camera.see_through, packet);
                for (unsigned k = 0; k < AnyPacket::size; ++k)
                    seen[static_cast<std::size_t>(row(k) - row_begin) * width + static_cast<std::size_t>(column(k))] =
                        seen_in_view(camera.see_through, packet, k);
            }
        }
    }

    /// A ray that met nothing, a back or the outdoors.
    struct LostRay {
        glm::dvec3 start, direction;
        double distance_m;         ///< to what it met; infinite for nothing
        std::uint32_t sub_sample;
    };

    struct RowScratch {
        HitCounts hits;
        std::vector<LostRay> lost_rays, still_lost;
        std::int64_t lost = 0;
        std::array<Packet, 2> packets;
        std::array<WidePacket, 2> wide_packets;
    };

    using TablesBySize = std::vector<std::unique_ptr<RayTables>>;  ///< each of twice the rays of the one before

    void add_tables(TablesBySize& tables, int rays, std::size_t rows) const {
        const Tiles tiles = make_tiles(std::min(rays, most_rays_per_table));
        tables.push_back(std::make_unique<RayTables>(tiles, table_count(tiles.rays(), rows), seed_ + static_cast<std::uint64_t>(rays)));
    }

    static const RayTables& largest_within(const TablesBySize& tables, std::int64_t rays) {
        std::size_t k = 0;
        while (k + 1 < tables.size() && tables[k + 1]->rays() <= rays) ++k;
        return *tables[k];
    }

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

    /// Corners of a triangle of the facet.
    HitMap hit_map(std::uint32_t f, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) const {
        const TracedFacet& facet = facets_[f];
        const PatchGrid::FaceGrid& grid = grid_.face_grid(facet.face);
        HitMap map;
        if (!facet.receives || grid.nu == 0 || grid.nv == 0) return map;  // without a normal: never clear
        const CellPatches::FaceCells& cells = cells_.of_face(facet.face);
        const auto column = [&](const glm::dvec3& p) { return cells.division * glm::dot(p + centre_m_ - grid.origin_m, grid.du); };
        const auto row = [&](const glm::dvec3& p) { return cells.division * glm::dot(p + centre_m_ - grid.origin_m, grid.dv); };
        map.column = static_cast<float>(column(a));
        map.column_u = static_cast<float>(column(b) - column(a));
        map.column_v = static_cast<float>(column(c) - column(a));
        map.row = static_cast<float>(row(a));
        map.row_u = static_cast<float>(row(b) - row(a));
        map.row_v = static_cast<float>(row(c) - row(a));
        map.normal_x = static_cast<float>(facet.normal.x);
        map.normal_y = static_cast<float>(facet.normal.y);
        map.normal_z = static_cast<float>(facet.normal.z);
        map.edge = edge_share(a, b, c);
        map.first_cell = cells.first;
        map.columns = cells.columns;
        return map;
    }

    /// The largest of u, v and 1 - u - v that a hit within tie_m() of an edge of a triangle may have.
    float edge_share(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) const {
        const double longest = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
        const double smallest_height = glm::length(glm::cross(b - a, c - a)) / longest;
        return static_cast<float>(tie_m() / smallest_height);
    }

    /// A ray at a point of an edge passes it within this: starts are lifted, which moves the ray aside by as much, and rounded.
    double tie_m() const { return 2.0 * lift_m_; }

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
                edges_.push_back(edge_share(v[0], v[k], v[k + 1]));
                hit_maps_.push_back(hit_map(f, v[0], v[k], v[k + 1]));
            }
            NATUREL_EXPECT(building.facets[f].is_aperture || f == 0 || !building.facets[f - 1].is_aperture);
            if (!building.facets[f].is_aperture) opaque_triangles = triangles.size();
        }
        hit_maps_.emplace_back();  // for rays that meet nothing where there is nothing
        surfaces_ = embree_api::make_scene(device_.get(), vertices, triangles);
        opaque_ =
            embree_api::make_scene(device_.get(), vertices, std::span(triangles).first(opaque_triangles));
        choosy_ = embree_api::make_scene(device_.get(), vertices, std::span(triangles).first(opaque_triangles), true);
    }

    /// Where a ray meets the plane of a facet. In double from the plane, which Embree's float distance is too
    /// coarse for.
    static glm::dvec3 meeting_point(const TracedFacet& facet, const glm::dvec3& start,
                                    const glm::dvec3& direction) {
        return start + ((facet.plane_m - glm::dot(facet.normal, start)) / glm::dot(facet.normal, direction)) *
                           direction;
    }

    /// The facet that ray k met. Of two that lie back to back, the one that faces it; of several that meet within rounding,
    /// the first of those that face it.
    template <class AnyPacket>
    std::uint32_t facet_met(RTCScene scene, const AnyPacket& packet, unsigned k) const {
        const std::uint32_t triangle = packet.triangle(k);
        const std::uint32_t facet = facet_of_triangle_[triangle];
        const float u = packet.rays.hit.u[k], v = packet.rays.hit.v[k];
        if (std::min({u, v, 1.0f - u - v}) < edges_[triangle]) return first_of_tie(scene, packet, k, facet);
        return facing(packet, k, facet);
    }

    template <class AnyPacket>
    std::uint32_t facing(const AnyPacket& packet, unsigned k, std::uint32_t facet) const {
        const TracedFacet& met = facets_[facet];
        if (met.twin_count == 0) return facet;
        const glm::dvec3 direction = packet.direction(k);
        if (glm::dot(met.normal, direction) < 0.0) return facet;
        const glm::dvec3 point = meeting_point(met, packet.origin(k), direction);
        for (const std::uint32_t twin : std::span(twins_).subspan(met.first_twin, met.twin_count))
            if (inside(facets_[twin], point)) return twin;
        return facet;
    }

    /// Which of the facets at an edge or a corner Embree reports follows from the order of its tree and the rounding of
    /// the processor. All that come within rounding of the hit are asked for; the smallest number among those that the ray
    /// meets from the front wins, or among all where there is none.
    template <class AnyPacket>
    std::uint32_t first_of_tie(RTCScene scene, const AnyPacket& packet, unsigned k, std::uint32_t met) const {
        const glm::dvec3 start = packet.origin(k), direction = packet.direction(k);
        const glm::dvec3 point = start + static_cast<double>(packet.rays.ray.tfar[k]) * direction;
        std::uint32_t best = met;
        bool best_faces = glm::dot(facets_[met].normal, direction) < 0.0;
        const double reach_m = 2.0 * tie_m();
        embree_api::near_triangles(scene, glm::vec3(point), static_cast<float>(2.0 * reach_m), [&](std::uint32_t triangle) {
            const std::uint32_t f = facet_of_triangle_[triangle];
            const TracedFacet& facet = facets_[f];
            if (std::abs(glm::dot(facet.normal, point) - facet.plane_m) > reach_m || !inside(facet, point, reach_m)) return;
            const bool faces = glm::dot(facet.normal, direction) < 0.0;
            if (faces != best_faces ? faces : f < best) best = f, best_faces = faces;
        });
        return best;
    }

    bool inside(const TracedFacet& facet, const glm::dvec3& point, double margin_m = same_place_m) const {
        const std::span<const glm::dvec3> v = polygon(facet);
        for (std::size_t k = 0; k < v.size(); ++k) {
            const glm::dvec3 edge = v[(k + 1) % v.size()] - v[k];
            if (glm::dot(glm::cross(facet.normal, edge), point - v[k]) < -margin_m * glm::length(edge))
                return false;
        }
        return true;
    }

    template <class AnyPacket>
    FacetId seen_by(const AnyPacket& packet, unsigned k) const {
        return packet.triangle(k) == embree_api::no_hit ? FacetId::none
                                                         : make_id<FacetId>(facet_met(opaque_.get(), packet, k));
    }

    /// The patch whose front ray k of a traced packet met; none when it met nothing, a back or the outdoors.
    template <class AnyPacket>
    PatchId patch_met(const AnyPacket& packet, unsigned k) const {
        if (packet.triangle(k) == embree_api::no_hit) return PatchId::none;
        const TracedFacet& facet = facets_[facet_met(surfaces_.get(), packet, k)];
        const glm::dvec3 direction = packet.direction(k);
        if (!facet.receives || glm::dot(facet.normal, direction) >= 0.0) return PatchId::none;
        return grid_.patch_at(facet.face, meeting_point(facet, packet.origin(k), direction) + centre_m_);
    }

    /// Calls trace_them(packet, first, count) for the directions, a packet at a time.
    template <class TraceThem>
    void for_each_packet(const GatherPoint& from, std::span<const glm::dvec3> directions, const TraceThem& trace_them) const {
        if (wide_)
            for_each_packet_of<WidePacket>(from, directions, trace_them);
        else
            for_each_packet_of<Packet>(from, directions, trace_them);
    }

    template <class AnyPacket, class TraceThem>
    void for_each_packet_of(const GatherPoint& from, std::span<const glm::dvec3> directions, const TraceThem& trace_them) const {
        const glm::vec3 lifted(from.position_m - centre_m_ + lift_at(from.position_m) * from.normal);
        AnyPacket packet;
        for (std::size_t first = 0; first < directions.size(); first += AnyPacket::size) {
            const unsigned count =
                static_cast<unsigned>(std::min<std::size_t>(AnyPacket::size, directions.size() - first));
            for (unsigned k = 0; k < AnyPacket::size; ++k) {
                packet.set_origin(k, lifted);
                packet.set_direction(k, glm::vec3(directions[first + std::min(k, count - 1)]));
            }
            trace_them(packet, first, count);
        }
    }

    /// Sets the rays through the pixels of a packet, as far as the cuts leave them.
    template <class Row, class Column, class AnyPacket>
    void start_view_packet(const Camera& camera, const Row& row, const Column& column, AnyPacket& packet) const {
        packet.start(AnyPacket::size);
        if (camera.kind == ViewKind::perspective && camera.cut_planes.empty()) {
            // The same directions, but for their length, which rays need not have.
            const glm::dvec3 to_right = 2 * camera.half_width / camera.width * camera.right;
            const glm::dvec3 down = -2 * camera.half_height / camera.height * camera.up;
            const glm::dvec3 corner = camera.forward - 0.5 * camera.width * to_right - 0.5 * camera.height * down;
            const glm::vec3 eye(camera.eye_m - centre_m_);
            for (unsigned k = 0; k < AnyPacket::size; ++k) {
                packet.set_origin(k, eye);
                packet.set_direction(k, glm::vec3(corner + (column(k) + 0.5) * to_right + (row(k) + 0.5) * down));
            }
            return;
        }
        for (unsigned k = 0; k < AnyPacket::size; ++k) {
            const double x = column(k) + 0.5, y = row(k) + 0.5;
            const Camera::Ray ray = camera.ray(x, y);
            const Camera::Reach reach = camera.reach(ray);
            if (reach.empty() || !camera.shows(x, y)) packet.valid[k] = 0;
            const double begin_m = packet.valid[k] == 0 ? 0.0 : reach.begin_m;
            packet.set_origin(k, glm::vec3(ray.origin_m - centre_m_ + begin_m * ray.direction));
            packet.set_direction(k, glm::vec3(ray.direction));
            packet.rays.ray.tfar[k] = static_cast<float>(reach.end_m - begin_m);
        }
    }

    template <class AnyPacket>
    void trace_view_packet(SeeThrough see_through, AnyPacket& packet) const {
        if (see_through == SeeThrough::nothing) return embree_api::trace_started(opaque_.get(), packet);
        embree_api::trace_accepted(choosy_.get(), packet, [&](std::uint32_t triangle, const glm::dvec3& direction) {
            const TracedFacet& facet = facets_[facet_of_triangle_[triangle]];
            return glm::dot(facet.normal, direction) < 0.0 && (see_through == SeeThrough::backs || facet.receives);
        });
    }

    /// What a ray passes through does not count at edges either: what it has met is the answer there.
    template <class AnyPacket>
    FacetId seen_in_view(SeeThrough see_through, const AnyPacket& packet, unsigned k) const {
        if (see_through == SeeThrough::nothing) return seen_by(packet, k);
        const std::uint32_t triangle = packet.triangle(k);
        return triangle == embree_api::no_hit ? FacetId::none : make_id<FacetId>(facet_of_triangle_[triangle]);
    }

    RowScratch& begin_row() const {
        RowScratch& scratch = scratch_.local();
        scratch.hits.reserve(grid_.gather_patch_count);
        scratch.lost = 0;
        return scratch;
    }

    /// Shoots the rays of a table.
    /// place_eight(frame, first, rays): sets directions and origins, lifted, of the eight rays from `first` on.
    /// moved_start(lost, attempt): lifted origin of another try, 0 or 1, of a ray that would be lost.
    template <class PlaceEight, class MovedStart>
    void shoot(const glm::dvec3& normal, const RayTable& table, std::uint32_t symmetry, const PlaceEight& place_eight,
               const MovedStart& moved_start, RowScratch& scratch) const {
        if (wide_)
            shoot_packets(scratch.wide_packets, normal, table, symmetry, place_eight, scratch);
        else
            shoot_packets(scratch.packets, normal, table, symmetry, place_eight, scratch);
        try_again(moved_start, scratch);
    }

    template <class AnyPacket, class PlaceEight>
    void shoot_packets(std::array<AnyPacket, 2>& packets, const glm::dvec3& normal, const RayTable& table, std::uint32_t symmetry,
                       const PlaceEight& place_eight, RowScratch& scratch) const {
        const HemisphereFrame frame(normal, symmetry);
        scratch.lost_rays.clear();
        scratch.hits.expect(table.rays());
        const std::uint32_t* const counters = cells_.counters();
        const std::uint32_t unclear = cells_.unclear_cell();
        const auto end = static_cast<std::size_t>(table.rays());
        // Tables and counters know packets of eight, one of each sub-sample.
        constexpr unsigned size = AnyPacket::size, eight = rays_per_packet;
        alignas(64) std::uint32_t met[2][size];
        for (AnyPacket& packet : packets) packet.start(size);
        const auto count_hits = [&](std::size_t which) {
            for (unsigned begin = 0; begin < size; begin += eight) {
                std::uint32_t* const own = met[which] + begin;
                std::uint32_t all = 0;
#pragma GCC unroll 8
                for (unsigned k = 0; k < eight; ++k) all |= own[k] = counters[own[k]];
                if (all < CellPatches::cut)
                    scratch.hits.add_packet(own);
                else
                    add_one_by_one(packets[which], begin, own, scratch);
            }
        };
        // The hits of a packet are counted when the next one is traced: nothing waits for its cells.
        std::size_t which = 0;
        for (std::size_t first = 0; first < end; first += size, which ^= 1) {
            if (first >= 2 * size) count_hits(which);
            AnyPacket& packet = packets[which];
            auto& ray = packet.rays.ray;
            for (unsigned k = 0; k < size; k += eight)
                place_eight(frame, first + k, {ray.org_x + k, ray.org_y + k, ray.org_z + k, ray.dir_x + k, ray.dir_y + k, ray.dir_z + k});
            packet.start_again();
            embree_api::trace_started(surfaces_.get(), packet);
            for (unsigned k = 0; k < size; k += eight) find_cells(hit_maps_.data(), {packet, k}, unclear, met[which] + k);
        }
        // A table has at least two packets.
        count_hits(which);
        count_hits(which ^ 1);
    }

    template <class MovedStart>
    void try_again(const MovedStart& moved_start, RowScratch& scratch) const {
        Packet& packet = scratch.packets[0];
        for (const int attempt : {0, 1}) {
            scratch.still_lost.clear();
            for (std::size_t first = 0; first < scratch.lost_rays.size(); first += packet_size) {
                const unsigned count = static_cast<unsigned>(std::min<std::size_t>(packet_size, scratch.lost_rays.size() - first));
                for (unsigned k = 0; k < packet_size; ++k) {
                    const LostRay& again = scratch.lost_rays[first + std::min(k, count - 1)];
                    packet.set_origin(k, glm::vec3(moved_start(again, attempt)));
                    packet.set_direction(k, glm::vec3(again.direction));
                }
                embree_api::trace(surfaces_.get(), packet, count);
                for (unsigned k = 0; k < count; ++k) {
                    const LostRay& again = scratch.lost_rays[first + k];
                    if (const PatchId patch = patch_met(packet, k); patch != PatchId::none)
                        scratch.hits.add(HitCounts::counter_of(patch), again.sub_sample);
                    else
                        scratch.still_lost.push_back(again);
                }
            }
            scratch.lost_rays.swap(scratch.still_lost);
        }
        scratch.lost += static_cast<std::int64_t>(scratch.lost_rays.size());
    }

    /// Of the eight rays from `first` on.
    template <class AnyPacket>
    void add_one_by_one(const AnyPacket& packet, unsigned first, const std::uint32_t* entries, RowScratch& scratch) const {
        for (unsigned sub_sample = 0; sub_sample < rays_per_packet; ++sub_sample) {
            const unsigned k = first + sub_sample;
            if (entries[sub_sample] < CellPatches::cut)
                scratch.hits.add(entries[sub_sample], sub_sample);
            else if (const PatchId beside = patch_beside(packet, k, entries[sub_sample]); beside != PatchId::none)
                scratch.hits.add(HitCounts::counter_of(beside), sub_sample);
            else if (const PatchId patch = patch_met(packet, k); patch != PatchId::none)
                scratch.hits.add(HitCounts::counter_of(patch), sub_sample);
            else
                scratch.lost_rays.push_back({packet.origin(k), packet.direction(k), packet.rays.ray.tfar[k], sub_sample});
        }
    }

    template <class AnyPacket>
    PatchId patch_beside(const AnyPacket& packet, unsigned k, std::uint32_t entry) const {
        if (packet.triangle(k) == embree_api::no_hit) return PatchId::none;
        const HitMap& map = hit_maps_[packet.triangle(k)];
        const float u = packet.rays.hit.u[k], v = packet.rays.hit.v[k];
        return cells_.patch_beside(entry, map.column + u * map.column_u + v * map.column_v, map.row + u * map.row_u + v * map.row_v);
    }

    /// Solids leave no way out of a room: the few rays that are lost there slipped through by rounding, and what the others
    /// met stands for them. More than one in a hundred is no rounding (a point inside a solid), and sheets may have gaps
    /// and backs: there what is lost is lost.
    void finish_row(RowScratch& scratch, std::int64_t rays, FormFactorRow& row) const {
        row.clear();
        const double share = static_cast<double>(scratch.lost) / static_cast<double>(rays);
        const bool escaped = closed_ && 100 * scratch.lost <= rays;
        (escaped ? row.escaped : row.lost) = share;
        scratch.hits.move_to(row, escaped ? rays - scratch.lost : rays);
    }

    PatchGrid grid_;
    CellPatches cells_;
    std::uint64_t seed_;
    double target_error_;
    int patch_rays_, most_patch_rays_, point_rays_;
    TablesBySize patch_tables_, point_tables_;
    bool closed_;  ///< made of solids alone
    glm::dvec3 centre_m_{};
    double lift_m_ = 0.0;  ///< of origins on the surfaces of the rooms, see lift_at()
    std::vector<TracedFacet> facets_;
    std::vector<glm::dvec3> vertices_m_;  ///< of all facets, one after the other
    std::vector<std::uint32_t> twins_;    ///< see TracedFacet::first_twin
    std::vector<std::uint32_t> facet_of_triangle_;
    std::vector<float> edges_;  ///< of triangles, see edge_share()
    std::vector<HitMap> hit_maps_;
    embree_api::Device device_;
    bool wide_;  ///< packets
    embree_api::Scene surfaces_;  ///< with the apertures, which are surfaces to form factors
    embree_api::Scene opaque_;    ///< without: its triangles are the first of `surfaces_`
    embree_api::Scene choosy_;    ///< the same for views that see through something
    std::unique_ptr<const PairwiseExchange> pairwise_;  ///< null: hemispheres of rays
    double pair_tolerance_ = 0.0;
    mutable ThreadScratch<RowScratch> scratch_;
};

}  // namespace

double estimated_error(const FormFactorRow& row) {
    double sum = 0.0;
    for (const float error : row.errors) sum += static_cast<double>(error) * static_cast<double>(error);
    return std::sqrt(sum);
}

std::unique_ptr<Visibility> make_embree_visibility(const Building& building, const PatchGrid& grid,
                                                   const EmbreeOptions& options) {
    return std::make_unique<EmbreeVisibility>(building, grid, options);
}

}  // namespace naturel
