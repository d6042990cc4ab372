#include "hemicube_backend/hemicube_visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "core/errors.h"
#include "core/parallel.h"
#include "core/planar_region.h"
#include "core/units.h"
#include "core/view.h"
#include "hemicube_backend/facet_set.h"
#include "hemicube_backend/item_buffer.h"
#include "hemicube_backend/patch_lookup.h"
#include "hemicube_backend/projection_cells.h"
#include "hemicube_backend/round_view.h"

namespace naturel {
namespace {

/// Plane 0 lies before the point (the top of the cube, or the single plane), 1 to 4 around it.
constexpr std::size_t plane_count = 5;

std::string_view surface_name(ProjectionSurface surface) {
    switch (surface) {
        case ProjectionSurface::hemicube:
            return "hemicube";
        case ProjectionSurface::single_plane:
            return "single_plane";
    }
    return "";
}

std::string_view spacing_name(CellSpacing spacing) {
    switch (spacing) {
        case CellSpacing::equal_solid_angle:
            return "equal_solid_angle";
        case CellSpacing::equal_form_factor:
            return "equal_form_factor";
        case CellSpacing::equal_plane_angle:
            return "equal_plane_angle";
        case CellSpacing::uniform:
            return "uniform";
    }
    return "";
}

std::string_view rim_name(RimShare rim) {
    switch (rim) {
        case RimShare::left_out:
            return "left_out";
        case RimShare::renormalised:
            return "renormalised";
        case RimShare::strip:
            return "strip";
    }
    return "";
}

void check(const HemicubeOptions& options) {
    if (options.resolution < 1 || options.resolution > 4096) {
        throw InputError("hemicube resolution",
                         fmt::format("{} cells along a side (it must be from 1 to 4096)", options.resolution));
    }
    if (options.viewpoints < 1 || options.viewpoints > 4096) {
        throw InputError("hemicube viewpoints",
                         fmt::format("{} viewpoints of a patch (it must be from 1 to 4096)", options.viewpoints));
    }
    if (!(options.half_side_over_height > 0) || !std::isfinite(options.half_side_over_height)) {
        throw InputError("hemicube half_side_over_height",
                         fmt::format("{} (it must be a positive number; the article uses 14)",
                                     options.half_side_over_height));
    }
}

/// splitmix64 (Steele, Lea & Flood 2014): a bijection that spreads every input bit over all output bits.
constexpr std::uint64_t hash(std::uint64_t value) {
    value += 0x9e3779b97f4a7c15u;
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

/// A point, and the tangent that the first side of the projection faces.
struct Station {
    glm::dvec3 position_m{}, normal{}, tangent{};
};

/// turn: any 64 bits; its top 53 become an angle of [0, pi/2), after which a square is the same again.
glm::dvec3 turned(const glm::dvec3& tangent, const glm::dvec3& normal, std::uint64_t turn) {
    const double angle_rad = static_cast<double>(turn >> 11) * 0x1p-53 * (pi / 2);
    return std::cos(angle_rad) * tangent + std::sin(angle_rad) * glm::cross(normal, tangent);
}

ProjectionAxes axes_of(const Station& station, std::size_t plane) {
    const glm::dvec3 bitangent = glm::cross(station.normal, station.tangent);
    const glm::dvec3 sides[] = {station.tangent, bitangent, -station.tangent, -bitangent};
    if (plane == 0) return {station.tangent, bitangent, station.normal};
    return {glm::cross(station.normal, sides[plane - 1]), station.normal, sides[plane - 1]};
}

/// `count` points spread over a convex polygon: Hammersley's set, which is stratified where count is a power of 2, moved so that
/// it is centred. One point is the centroid.
std::vector<glm::dvec3> viewpoints_of(const PatchGrid& grid, PatchId patch, int count) {
    const glm::dvec3 centroid_m = grid.patches[index(patch)].centroid_m;
    if (count == 1) return {centroid_m};
    const std::span<const glm::dvec3> corners_m = grid.polygon_of(patch);
    // The fan of triangles around the first corner, and the area up to each.
    std::vector<double> area_before{0.0};
    for (std::size_t k = 1; k + 1 < corners_m.size(); ++k) {
        const glm::dvec3 cross = glm::cross(corners_m[k] - corners_m[0], corners_m[k + 1] - corners_m[0]);
        area_before.push_back(area_before.back() + glm::length(cross));
    }
    std::vector<glm::dvec3> points_m;
    const auto bits = static_cast<unsigned>(std::bit_width(static_cast<unsigned>(count - 1)));
    for (int k = 0; k < count; ++k) {
        const double u = (k + 0.5) / count;
        double v = std::ldexp(0.5, -static_cast<int>(bits));  // the bits of k in reverse, behind the point
        for (unsigned bit = 0; bit < bits; ++bit)
            if ((static_cast<unsigned>(k) >> bit & 1u) != 0) v += std::ldexp(0.5, -static_cast<int>(bit));
        const double area = u * area_before.back();
        std::size_t triangle = 1;
        while (triangle + 1 < area_before.size() && area_before[triangle] < area) ++triangle;
        const double share = (area - area_before[triangle - 1]) / (area_before[triangle] - area_before[triangle - 1]);
        // Across the triangle by angle from its first side, then away from the corner by area.
        const glm::dvec3 opposite_m = glm::mix(corners_m[triangle], corners_m[triangle + 1], share);
        points_m.push_back(glm::mix(corners_m[0], opposite_m, std::sqrt(v)));
    }
    return points_m;
}

class HemicubeVisibility final : public Visibility {
public:
    HemicubeVisibility(const Building& building, const PatchGrid& grid, const HemicubeOptions& options)
        : options_(options), facets_(building), grid_(grid), lookup_(facets_, grid_), scratch_([this] {
              return Scratch(grid_.patches.size());
          }) {
        for (const Face& face : building.faces)
            face_tangents_.push_back(face.frame.u_m);
        if (options.surface == ProjectionSurface::hemicube) {
            front_ = hemicube_top_cells(options.resolution);
            side_ = hemicube_side_cells(options.resolution);
        } else {
            half_side_ = options.half_side_over_height;
            front_ = single_plane_cells(options.resolution, half_side_, options.spacing);
            side_ = rim_cells(options.resolution, half_side_);
            const double s = half_side_ / std::sqrt(1 + half_side_ * half_side_);
            const double beyond_rim = 1 - 4 / pi * s * std::atan(s);
            if (options.rim == RimShare::left_out) truncated_ = beyond_rim;
            if (options.rim == RimShare::renormalised) scale_ = 1 / (1 - beyond_rim);
        }
    }

    std::string_view name() const noexcept override { return surface_name(options_.surface); }

    std::vector<std::pair<std::string, std::string>> settings() const override {
        return {{"surface", std::string(surface_name(options_.surface))},
                {"resolution", fmt::format("{}", options_.resolution)},
                {"half_side_over_height", fmt::format("{}", options_.half_side_over_height)},
                {"spacing", std::string(spacing_name(options_.spacing))},
                {"rim", std::string(rim_name(options_.rim))},
                {"viewpoints", fmt::format("{}", options_.viewpoints)},
                {"random_rotation", options_.random_rotation ? "true" : "false"},
                {"seed", fmt::format("{}", options_.seed)},
                {"widest_cell_deg",
                 fmt::format("{:.4g}", std::max(widest_cell_rad(front_), widest_cell_rad(side_)) * 180 / pi)}};
    }

    void form_factor_row(PatchId from, FormFactorRow& row) const override {
        const Patch& patch = grid_.patches[index(from)];
        const glm::dvec3& along_u = face_tangents_[index(patch.face)];
        const glm::dvec3 tangent = glm::normalize(along_u - glm::dot(along_u, patch.normal) * patch.normal);
        const std::vector<glm::dvec3> points_m = viewpoints_of(grid_, from, options_.viewpoints);
        Scratch& scratch = scratch_.local();
        row.clear();
        for (std::size_t k = 0; k < points_m.size(); ++k) {
            Station station{points_m[k], patch.normal, tangent};
            if (options_.random_rotation) {
                const std::uint64_t turn = hash(hash(options_.seed) ^ index(from));
                station.tangent = turned(tangent, patch.normal, k == 0 ? turn : hash(turn ^ k));
            }
            add_planes(station, scratch);
        }
        finish(row, 1.0 / static_cast<double>(points_m.size()), scratch);
    }

    void gather_row(const GatherPoint& from, FormFactorRow& row) const override {
        row.clear();
        Scratch& scratch = scratch_.local();
        SeenAround& around = scratch.seen;
        // What first_seen() has drawn from here lacks nothing but the apertures.
        const bool drawn = around.is_at(from);
        const Station station = drawn ? around.station : station_of(from);
        for (std::size_t plane = 0; plane < planes(); ++plane) {
            if (drawn && around.drawn[plane]) {
                scratch.buffer = around.planes[plane];
                scratch.buffer.add(facets_, FacetKind::apertures);
            } else {
                scratch.buffer.draw(facets_, projection_of(station, plane), cells_of(plane), FacetKind::all);
            }
            lookup_.add_cells(scratch.buffer, cells_of(plane), scratch.sums, scratch.lookup);
        }
        finish(row, 1.0, scratch);
    }

    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                    std::span<FacetId> seen) const override {
        NATUREL_EXPECT(directions.size() == seen.size());
        SeenAround& around = scratch_.local().seen;
        if (!around.is_at(from)) {
            around.valid = true;
            around.point = from;
            around.station = station_of(from);
            around.drawn.fill(false);
        }
        for (std::size_t k = 0; k < directions.size(); ++k) {
            const std::size_t plane = plane_of(around.station, directions[k]);
            const ProjectionCells& cells = cells_of(plane);
            if (!around.drawn[plane]) {
                around.planes[plane].draw(facets_, projection_of(around.station, plane), cells, FacetKind::opaque);
                around.drawn[plane] = true;
            }
            const ProjectionAxes& axes = around.planes[plane].projection().axes;
            const double depth = glm::dot(directions[k], axes.forward);
            const int row = cells.row_of(glm::dot(directions[k], axes.up) / depth);
            const int column = cells.column_of(row, glm::dot(directions[k], axes.right) / depth);
            seen[k] = around.planes[plane].facet(row, column);
        }
    }

    void view_facets(const Camera& camera, int row_begin, int row_end, std::span<FacetId> seen) const override {
        const auto columns = static_cast<std::size_t>(camera.width);
        NATUREL_EXPECT(seen.size() == static_cast<std::size_t>(row_end - row_begin) * columns);
        if (camera.kind == ViewKind::fisheye || camera.kind == ViewKind::panorama)
            return scratch_.local().round_view.draw(facets_, camera, row_begin, row_end, seen);
        const ProjectionCells cells = picture_cells(camera);
        const Projection projection{camera.eye_m, {camera.right, -camera.up, camera.forward}, camera.kind == ViewKind::parallel,
                                    camera.cut_planes, camera.see_through};
        ItemBuffer& buffer = scratch_.local().buffer;
        buffer.draw(facets_, projection, cells, FacetKind::opaque, row_begin, row_end);
        for (int row = row_begin; row < row_end; ++row) {
            std::transform(buffer.codes(row), buffer.codes(row) + columns,
                           seen.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(row - row_begin) * columns),
                           ItemBuffer::facet_of);
        }
    }

private:
    /// What was drawn for first_seen() at the last point of this thread, in case the next call asks about the
    /// same.
    struct SeenAround {
        bool valid = false;
        GatherPoint point;
        Station station;
        std::array<ItemBuffer, plane_count> planes;
        std::array<bool, plane_count> drawn{};

        bool is_at(const GatherPoint& other) const {
            return valid && point.position_m == other.position_m && point.normal == other.normal;
        }
    };

    struct Scratch {
        explicit Scratch(std::size_t patch_count) : sums(patch_count) {}
        ItemBuffer buffer;
        PatchSums sums;
        PatchLookup::Scratch lookup;
        SeenAround seen;
        RoundView round_view;
    };

    Station station_of(const GatherPoint& point) const {
        Station station{point.position_m, point.normal, make_plane_frame(point.position_m, point.normal).x};
        if (options_.random_rotation) {
            std::uint64_t turn = hash(options_.seed);
            for (const glm::dvec3& vector : {point.position_m, point.normal}) {
                for (int k = 0; k < 3; ++k)
                    turn = hash(turn ^ std::bit_cast<std::uint64_t>(vector[k] + 0.0));  // -0 is 0
            }
            station.tangent = turned(station.tangent, station.normal, turn);
        }
        return station;
    }

    /// The plane of the projection that a direction meets. Directions below the horizon by rounding meet a
    /// side.
    std::size_t plane_of(const Station& station, const glm::dvec3& direction) const {
        const double along_tangent = glm::dot(direction, station.tangent);
        const double along_bitangent = glm::dot(direction, glm::cross(station.normal, station.tangent));
        const double widest = std::max(std::abs(along_tangent), std::abs(along_bitangent));
        if (widest <= half_side_ * glm::dot(direction, station.normal)) return 0;
        if (std::abs(along_tangent) >= std::abs(along_bitangent)) return along_tangent > 0 ? 1 : 3;
        return along_bitangent > 0 ? 2 : 4;
    }

    /// Planes that rows of form factors look at. first_seen() looks at all.
    std::size_t planes() const {
        return options_.surface == ProjectionSurface::hemicube || options_.rim == RimShare::strip ? plane_count : 1;
    }
    const ProjectionCells& cells_of(std::size_t plane) const { return plane == 0 ? front_ : side_; }
    static Projection projection_of(const Station& station, std::size_t plane) {
        return {station.position_m, axes_of(station, plane)};
    }

    /// Adds what is seen from a point of a patch to the sums.
    void add_planes(const Station& station, Scratch& scratch) const {
        for (std::size_t plane = 0; plane < planes(); ++plane) {
            scratch.buffer.draw(facets_, projection_of(station, plane), cells_of(plane), FacetKind::all_from_air);
            lookup_.add_cells(scratch.buffer, cells_of(plane), scratch.sums, scratch.lookup);
        }
    }

    void finish(FormFactorRow& row, double share, Scratch& scratch) const {
        scratch.sums.move_to(row, share * scale_);
        row.truncated = truncated_;
    }

    HemicubeOptions options_;
    FacetSet facets_;
    PatchGrid grid_;
    std::vector<glm::dvec3> face_tangents_;  ///< [faces]
    PatchLookup lookup_;
    double half_side_ = 1.0;  ///< of the plane before the point, at distance 1
    double truncated_ = 0.0;  ///< share of each row
    double scale_ = 1.0;      ///< of rows that give back what passes below the rim
    ProjectionCells front_, side_;
    mutable ThreadScratch<Scratch> scratch_;
};

}  // namespace

std::unique_ptr<Visibility> make_hemicube_visibility(const Building& building, const PatchGrid& grid,
                                                     const HemicubeOptions& options) {
    check(options);
    return std::make_unique<HemicubeVisibility>(building, grid, options);
}

}  // namespace naturel
