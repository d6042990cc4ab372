#include "hemicube_backend/hemicube_visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/errors.h"
#include "core/parallel.h"
#include "core/planar_region.h"
#include "core/units.h"
#include "core/view.h"
#include "hemicube_backend/facet_set.h"
#include "hemicube_backend/item_buffer.h"
#include "hemicube_backend/projection_cells.h"

namespace naturel {
namespace {

/// Plane 0 lies before the point (the top of the cube, or the single plane), 1 to 4 around it.
constexpr std::size_t plane_count = 5;

/// Rows of a picture that one task draws.
constexpr std::size_t picture_band_rows = 32;

/// No building is larger; keeps points under cells finite, m.
constexpr double farthest_m = 1e6;

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
        case CellSpacing::uniform:
            return "uniform";
    }
    return "";
}

void check(const HemicubeOptions& options) {
    if (options.resolution < 2 || options.resolution > 4096 || options.resolution % 2 != 0) {
        throw InputError(
            "hemicube resolution",
            fmt::format("{} cells along a side (it must be even, from 2 to 4096)", options.resolution));
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

/// The patches' outlines, where rows of cells leave them.
struct PatchEdges {
    struct Edge {
        glm::dvec3 inward{};  ///< dot(inward, p) >= offset_m on the side of the patch
        double offset_m = 0.0;
    };
    std::vector<Edge> edges;
    std::vector<std::uint32_t> first;  ///< edges of patch i: [first[i], first[i + 1])

    explicit PatchEdges(const PatchGrid& grid) {
        for (std::size_t i = 0; i < grid.patches.size(); ++i) {
            const std::span<const glm::dvec3> corners_m = grid.polygon_of(make_id<PatchId>(i));
            first.push_back(static_cast<std::uint32_t>(edges.size()));
            for (std::size_t k = 0; k < corners_m.size(); ++k) {
                const glm::dvec3 along = corners_m[(k + 1) % corners_m.size()] - corners_m[k];
                const glm::dvec3 inward = glm::cross(grid.patches[i].normal, along);
                edges.push_back({inward, glm::dot(inward, corners_m[k])});
            }
        }
        first.push_back(static_cast<std::uint32_t>(edges.size()));
    }
};

/// The edges by which rows of one plane of a projection leave each patch, worked out when first asked for.
class PatchExits {
public:
    explicit PatchExits(const PatchEdges& edges)
        : edges_(edges), lines_(edges.edges.size()), known_(edges.first.size() - 1) {}

    void begin(const glm::dvec3& viewpoint_m, const ProjectionAxes& axes) {
        viewpoint_m_ = viewpoint_m;
        axes_ = axes;
        ++plane_;
    }

    /// x at which the row at y leaves a patch to the right. inverse_depth: of the patch's plane
    /// (FacetsAround::Entry). docs/hemicube.md, eq. 8.
    double at(PatchId patch, const glm::dvec3& inverse_depth, double y) {
        Known& known = known_[index(patch)];
        if (known.plane != plane_) find_lines(patch, inverse_depth, known);
        const Line* const lines = lines_.data() + edges_.first[index(patch)];
        double x = std::numeric_limits<double>::infinity();
        for (std::uint32_t k = 0; k < known.line_count; ++k)
            x = std::min(x, lines[k].at_zero + lines[k].slope * y);
        return x;
    }

private:
    struct Line {
        double at_zero = 0.0, slope = 0.0;  ///< x = at_zero + slope y
    };
    struct Known {
        std::uint64_t plane = 0;
        std::uint32_t line_count = 0;
    };

    /// The point viewpoint + d / w of direction d = x right + y up + forward, w = dot(inverse_depth, d), lies
    /// inside an edge if dot(inward, d) + w (dot(inward, viewpoint) - offset) >= 0: linear in x and y.
    void find_lines(PatchId patch, const glm::dvec3& inverse_depth, Known& known) {
        const std::uint32_t first = edges_.first[index(patch)], last = edges_.first[index(patch) + 1];
        known = {plane_, 0};
        for (std::uint32_t k = first; k < last; ++k) {
            const PatchEdges::Edge& edge = edges_.edges[k];
            const glm::dvec3 g =
                edge.inward + (glm::dot(edge.inward, viewpoint_m_) - edge.offset_m) * inverse_depth;
            const double g_x = glm::dot(g, axes_.right), g_y = glm::dot(g, axes_.up);
            // An edge along the rows is not left to the right.
            if (g_x >= -1e-14 * std::abs(g_y)) continue;
            lines_[first + known.line_count++] = {-glm::dot(g, axes_.forward) / g_x, -g_y / g_x};
        }
    }

    const PatchEdges& edges_;
    std::vector<Line> lines_;   ///< as edges_.edges
    std::vector<Known> known_;  ///< [patches]
    std::uint64_t plane_ = 0;
    glm::dvec3 viewpoint_m_{};
    ProjectionAxes axes_;
};

/// Form factors summed per patch. Sparse: clearing costs what was touched.
class PatchSums {
public:
    explicit PatchSums(std::size_t patch_count) : sums_(patch_count, 0.0) {}

    void add(PatchId patch, double weight) {
        double& sum = sums_[index(patch)];
        if (sum == 0.0) touched_.push_back(patch);
        sum += weight;
    }

    /// Writes the sums in patch order and clears them.
    void move_to(FormFactorRow& row) {
        std::sort(touched_.begin(), touched_.end());
        for (const PatchId patch : touched_) {
            row.patches.push_back(patch);
            row.values.push_back(std::exchange(sums_[index(patch)], 0.0));
        }
        touched_.clear();
    }

private:
    std::vector<double> sums_;
    std::vector<PatchId> touched_;
};

class HemicubeVisibility final : public Visibility {
public:
    HemicubeVisibility(const Building& building, const PatchGrid& grid, const HemicubeOptions& options)
        : options_(options), facets_(building), grid_(grid), edges_(grid), scratch_([this] {
              return Scratch(grid_.patches.size(), edges_);
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
            truncated_ = 1 - 4 / pi * s * std::atan(s);
        }
    }

    std::string_view name() const noexcept override { return surface_name(options_.surface); }

    std::vector<std::pair<std::string, std::string>> settings() const override {
        return {{"surface", std::string(surface_name(options_.surface))},
                {"resolution", fmt::format("{}", options_.resolution)},
                {"half_side_over_height", fmt::format("{}", options_.half_side_over_height)},
                {"spacing", std::string(spacing_name(options_.spacing))},
                {"random_rotation", options_.random_rotation ? "true" : "false"},
                {"seed", fmt::format("{}", options_.seed)}};
    }

    void form_factor_row(PatchId from, FormFactorRow& row) const override {
        const Patch& patch = grid_.patches[index(from)];
        const glm::dvec3& along_u = face_tangents_[index(patch.face)];
        Station station{patch.centroid_m, patch.normal, {}};
        station.tangent = glm::normalize(along_u - glm::dot(along_u, patch.normal) * patch.normal);
        if (options_.random_rotation) {
            station.tangent =
                turned(station.tangent, station.normal, hash(hash(options_.seed) ^ index(from)));
        }
        compute_row(station, row);
    }

    void gather_row(const GatherPoint& from, FormFactorRow& row) const override {
        compute_row(station_of(from), row);
    }

    void first_seen(const GatherPoint& from, std::span<const glm::dvec3> directions,
                    std::span<FacetId> seen) const override {
        NATUREL_EXPECT(directions.size() == seen.size());
        SeenAround& around = scratch_.local().seen;
        if (!around.valid || around.point.position_m != from.position_m ||
            around.point.normal != from.normal) {
            around.valid = true;
            around.point = from;
            around.station = station_of(from);
            around.facets.collect(facets_, from.position_m, from.normal, ApertureDrawing::transparent);
            around.drawn.fill(false);
        }
        for (std::size_t k = 0; k < directions.size(); ++k) {
            const std::size_t plane = plane_of(around.station, directions[k]);
            const ProjectionCells& cells = plane == 0 ? front_ : side_;
            const ProjectionAxes axes = axes_of(around.station, plane);
            if (!around.drawn[plane]) {
                around.planes[plane].draw(facets_, around.facets, axes, cells);
                around.drawn[plane] = true;
            }
            const double depth = glm::dot(directions[k], axes.forward);
            const int row = cells.row_of(glm::dot(directions[k], axes.up) / depth);
            const int column = cells.column_of(row, glm::dot(directions[k], axes.right) / depth);
            seen[k] = around.planes[plane].row(row)[static_cast<std::size_t>(column)];
        }
    }

    void view_facets(const View& view, std::span<FacetId> seen) const override {
        const Camera camera = make_camera(view);
        NATUREL_EXPECT(seen.size() ==
                       static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
        const ProjectionCells cells = picture_cells(camera);
        const ProjectionAxes axes{camera.right, -camera.up, camera.forward};
        FacetsAround around;
        around.collect(facets_, camera.eye_m, glm::dvec3(0), ApertureDrawing::transparent);
        const auto rows = static_cast<std::size_t>(camera.height),
                   columns = static_cast<std::size_t>(camera.width);
        parallel_for((rows + picture_band_rows - 1) / picture_band_rows, 1, [&](std::size_t band) {
            ItemBuffer& buffer = scratch_.local().buffer;
            const int begin = static_cast<int>(band * picture_band_rows);
            const int end = static_cast<int>(std::min((band + 1) * picture_band_rows, rows));
            buffer.draw(facets_, around, axes, cells, begin, end);
            for (int row = begin; row < end; ++row) {
                const std::span<const FacetId> items = buffer.row(row);
                std::copy(
                    items.begin(), items.end(),
                    seen.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(row) * columns));
            }
        });
    }

private:
    /// What was drawn for first_seen() at the last point of this thread, in case the next call asks about the
    /// same.
    struct SeenAround {
        bool valid = false;
        GatherPoint point;
        Station station;
        FacetsAround facets;
        std::array<ItemBuffer, plane_count> planes;
        std::array<bool, plane_count> drawn{};
    };

    struct Scratch {
        Scratch(std::size_t patch_count, const PatchEdges& edges) : sums(patch_count), exits(edges) {}
        FacetsAround facets;
        ItemBuffer buffer;
        PatchSums sums;
        PatchExits exits;
        SeenAround seen;
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

    void compute_row(const Station& station, FormFactorRow& row) const {
        row.clear();
        Scratch& scratch = scratch_.local();
        scratch.facets.collect(facets_, station.position_m, station.normal, ApertureDrawing::surfaces);
        const std::size_t planes = options_.surface == ProjectionSurface::hemicube ? plane_count : 1;
        for (std::size_t plane = 0; plane < planes; ++plane) {
            const ProjectionCells& cells = plane == 0 ? front_ : side_;
            const ProjectionAxes axes = axes_of(station, plane);
            scratch.buffer.draw(facets_, scratch.facets, axes, cells);
            scratch.exits.begin(station.position_m, axes);
            for (int r = 0; r < cells.rows; ++r)
                row.lost += add_cells(r, axes, cells, scratch);
        }
        scratch.sums.move_to(row);
        row.truncated = truncated_;
    }

    /// Adds the weight of a row's cells to the patches they show; returns what is left.
    double add_cells(int row, const ProjectionAxes& axes, const ProjectionCells& cells,
                     Scratch& scratch) const {
        const std::span<const FacetId> items = scratch.buffer.row(row);
        double lost = 0.0;
        for (int begin = 0, end = 0; begin < cells.columns; begin = end) {
            const FacetId facet = items[static_cast<std::size_t>(begin)];
            for (end = begin + 1; end < cells.columns && items[static_cast<std::size_t>(end)] == facet;)
                ++end;
            if (facet == FacetId::none || scratch.facets[facet].from_behind ||
                !facets_[facet].exchanges_light) {
                lost += cells.weight(row, begin, end);
            } else {
                lost += add_run(facet, row, begin, end, axes, cells, scratch);
            }
        }
        return lost;
    }

    /// The same for cells [begin, end), which show one facet. A patch is convex, so that the cells of a row
    /// that show it are neighbours: one look at the grid per patch and row is enough, and where the row
    /// leaves the patch follows from its edges (docs/hemicube.md, eq. 8).
    double add_run(FacetId facet, int row, int begin, int end, const ProjectionAxes& axes,
                   const ProjectionCells& cells, Scratch& scratch) const {
        const glm::dvec3& eye_m = scratch.facets.viewpoint_m;
        const glm::dvec3& inverse_depth = scratch.facets[facet].inverse_depth;
        const double y = cells.row_centres[static_cast<std::size_t>(row)];
        const glm::dvec3 row_direction = axes.forward + y * axes.up;
        const double w_0 = glm::dot(inverse_depth, row_direction), w_x = glm::dot(inverse_depth, axes.right);
        const float* const centres = cells.centres_of(row).data();
        const FaceId face = facets_[facet].face;
        double lost = 0.0;
        for (int next = begin; begin < end; begin = next) {
            const double x = centres[begin];
            // Farther than farthest_m only by rounding, where a facet is seen almost edge-on.
            const double depth_m = 1 / std::max(w_0 + w_x * x, 1 / farthest_m);
            const PatchId patch = grid_.patch_at(face, eye_m + depth_m * (row_direction + x * axes.right));
            if (patch == PatchId::none) {
                next = begin + 1;
                lost += cells.weight(row, begin, next);
                continue;
            }
            const double leaves_at = scratch.exits.at(patch, inverse_depth, y);
            next = std::clamp(cells.columns_before(row, leaves_at, begin + 1), begin + 1, end);
            scratch.sums.add(patch, cells.weight(row, begin, next));
        }
        return lost;
    }

    HemicubeOptions options_;
    FacetSet facets_;
    PatchGrid grid_;
    std::vector<glm::dvec3> face_tangents_;  ///< [faces]
    PatchEdges edges_;
    double half_side_ = 1.0;  ///< of the plane before the point, at distance 1
    double truncated_ = 0.0;
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
