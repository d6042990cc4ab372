#include "core/patch_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <unordered_map>

#include "core/errors.h"
#include "core/parallel.h"
#include "core/spherical_polygon.h"
#include "core/units.h"

namespace naturel {

namespace {

using glm::dvec3;

// What is left of a cell is dropped when it is smaller than this share of the cell: its light could not be told from
// rounding.
constexpr double smallest_share_of_cell = 1e-6;

// Nodes closer than this are one: the cuts of neighbouring cells are rounded to 1 nm one by one.
constexpr double same_node_nm = 100.0;

// How far a node on an outline is pulled into its patches for gathering (see Node).
constexpr double node_inset_m = 1e-3;

bool same_node(const dvec3& a_m, const dvec3& b_m) { return glm::distance(a_m, b_m) * nanometres_per_metre < same_node_nm; }

// Where less than this of the apertures could be seen, differences do not matter: 1/1000 of a hemisphere.
constexpr double dark_sr = 1e-3 * pi;

// More would fill the memory of a large machine, whatever the visibility method.
constexpr double most_cells = 1e7;

double cell_count(double length_m, double spacing_m) { return std::max(1.0, std::ceil(length_m / spacing_m - 1e-9)); }

double spacing_m(const Face& face, const GridOptions& options) {
    return face.environment == Environment::outdoor ? options.outdoor_spacing_m : options.spacing_m;
}

// Cells are laid over the whole frame of a face, however little of it is left: a long thin arm across it counts in full.
void refuse_too_many_cells(const Building& building, const GridOptions& options) {
    double all = 0.0, most = -1.0;
    const Face* worst = nullptr;
    for (const Face& face : building.faces) {
        const double spacing = spacing_m(face, options);
        const double parts =
            face.environment == Environment::indoor && !face.aperture ? std::exp2(2 * options.refine.levels) : 1.0;
        const double cells =
            cell_count(glm::length(face.frame.u_m), spacing) * cell_count(glm::length(face.frame.v_m), spacing) * parts;
        all += cells;
        if (cells > most) most = cells, worst = &face;
    }
    if (all <= most_cells) return;
    const bool outdoors = worst->environment == Environment::outdoor;
    const bool refined = options.refine.levels > 0 && !outdoors && !worst->aperture;
    throw InputError("", fmt::format("the grid would have {:.2g} cells, {:.2g} of them on face \"{}\" (at most {:.2g} in "
                                     "all: make \"{}\" of \"grid\" larger than {} m{})",
                                     all, most, worst->name, most_cells, outdoors ? "outdoor_spacing_m" : "spacing_m",
                                     spacing_m(*worst, options),
                                     refined ? ", or \"levels\" of \"refine\" smaller" : ""));
}

dvec3 polygon_centroid(std::span<const dvec3> polygon) {
    dvec3 moment{};
    double area = 0.0;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
        const double a = glm::length(glm::cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]));
        moment += a * (polygon[0] + polygon[i] + polygon[i + 1]) / 3.0;
        area += a;
    }
    return moment / area;
}

// Finds nodes of one face by position.
class NodeFinder {
public:
    explicit NodeFinder(std::vector<Node>& nodes) : nodes_(nodes) {}

    NodeId node_at(FaceId face, const PlanePoint& point, const dvec3& position_m) {
        const auto column = static_cast<std::int64_t>(std::floor(static_cast<double>(point.X) / same_node_nm));
        const auto row = static_cast<std::int64_t>(std::floor(static_cast<double>(point.Y) / same_node_nm));
        for (std::int64_t i = column - 1; i <= column + 1; ++i) {
            for (std::int64_t j = row - 1; j <= row + 1; ++j) {
                const auto found = bins_.find(key(i, j));
                if (found == bins_.end()) continue;
                if (same_node(nodes_[index(found->second)].position_m, position_m)) return found->second;
            }
        }
        const auto id = make_id<NodeId>(nodes_.size());
        nodes_.push_back({.face = face, .position_m = position_m, .gather_position_m = position_m});
        bins_.emplace(key(column, row), id);
        return id;
    }

private:
    static std::uint64_t key(std::int64_t column, std::int64_t row) {
        return static_cast<std::uint64_t>(column) * 0x9e3779b97f4a7c15u ^ static_cast<std::uint64_t>(row);
    }

    std::vector<Node>& nodes_;
    std::unordered_map<std::uint64_t, NodeId> bins_;
};

// Pulls nodes that are not surrounded by patches of their face towards those patches: along the bisector of the wedge they fill,
// which the integral of the unit direction over the wedge points along, at an inner corner of 270 degrees, too. Where the wedge is
// a needle, not so far that they leave it.
void inset_outline_nodes(PatchGrid& grid) {
    struct Surroundings {
        double angle = 0.0;
        dvec3 pull{};
        double room_m = std::numeric_limits<double>::max();
        std::vector<PatchId> patches;
    };
    std::vector<Surroundings> around(grid.nodes.size());
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) {
        const Patch& patch = grid.patches[p];
        const auto corners = grid.corners_of(make_id<PatchId>(p));
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const dvec3 here = grid.nodes[index(corners[i])].position_m;
            const auto towards = [&](std::size_t k) {
                return glm::normalize(grid.nodes[index(corners[k % corners.size()])].position_m - here);
            };
            const dvec3 next = towards(i + 1), previous = towards(i + corners.size() - 1);
            const double angle = std::acos(std::clamp(glm::dot(next, previous), -1.0, 1.0));
            const dvec3 middle = next + previous;
            const double length = glm::length(middle);
            const dvec3 bisector = length > 1e-6 ? middle / length : glm::cross(patch.normal, next);
            Surroundings& s = around[index(corners[i])];
            s.patches.push_back(make_id<PatchId>(p));
            s.angle += angle;
            s.pull += 2.0 * std::sin(0.5 * angle) * bisector;
            s.room_m = std::min(s.room_m, glm::length(patch.centroid_m - here));
        }
    }
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
        const Surroundings& s = around[n];
        const double length = glm::length(s.pull);
        if (s.angle > 2.0 * pi - 1e-6 || length < 1e-9) continue;
        const auto inside = [&](const dvec3& place) {
            return std::ranges::any_of(s.patches, [&](PatchId id) {
                const auto polygon = grid.polygon_of(id);
                for (std::size_t k = 0; k < polygon.size(); ++k) {
                    const dvec3 edge = polygon[(k + 1) % polygon.size()] - polygon[k];
                    if (glm::dot(glm::cross(grid.patches[index(id)].normal, edge), place - polygon[k]) < 0.0) return false;
                }
                return true;
            });
        };
        dvec3 inset = std::min(node_inset_m, 0.1 * s.room_m) / length * s.pull;
        for (int halvings = 0; halvings < 10 && !inside(grid.nodes[n].position_m + 2.0 * inset); ++halvings) inset *= 0.5;
        grid.nodes[n].gather_position_m += inset;
    }
}

}  // namespace

std::span<const NodeId> PatchGrid::corners_of(PatchId id) const {
    const Patch& patch = patches[index(id)];
    return {corners.data() + patch.first_corner, patch.corner_count};
}

std::span<const dvec3> PatchGrid::polygon_of(PatchId id) const {
    const Patch& patch = patches[index(id)];
    return {corner_positions_m.data() + patch.first_corner, patch.corner_count};
}

PatchId PatchGrid::patch_at(FaceId face, const dvec3& point_m) const {
    const FaceGrid& g = face_grids_[index(face)];
    const dvec3 d = point_m - g.origin_m;
    const int i = std::clamp(static_cast<int>(glm::dot(d, g.du)), 0, g.nu - 1);
    const int j = std::clamp(static_cast<int>(glm::dot(d, g.dv)), 0, g.nv - 1);
    const auto cell = [&](int column, int row) {
        return g.first_cell + static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(g.nu) +
               static_cast<std::uint32_t>(column);
    };
    const std::uint32_t c = cell(i, j);
    const std::uint32_t first = first_in_cell_[c], last = first_in_cell_[c + 1];
    if (last - first == 1) return cell_patches_[first];
    // Distance inside the outline of a patch (negative outside): the largest wins.
    PatchId best = PatchId::none;
    double deepest = std::numeric_limits<double>::lowest();
    const auto consider = [&](PatchId id) {
        const auto polygon = polygon_of(id);
        const glm::dvec3& normal = patches[index(id)].normal;
        double depth = std::numeric_limits<double>::max();
        for (std::size_t k = 0; k < polygon.size(); ++k) {
            const dvec3& a = polygon[k];
            const dvec3 edge = polygon[(k + 1) % polygon.size()] - a;
            const dvec3 inward = glm::cross(normal, edge);
            depth = std::min(depth, glm::dot(inward, point_m - a) / glm::length(inward));
        }
        if (depth > deepest) deepest = depth, best = id;
    };
    for (std::uint32_t k = first; k < last; ++k) consider(cell_patches_[k]);
    // An empty cell: its corner was cut off, and the point lies outside by rounding. Look around.
    for (int reach = 1; best == PatchId::none && reach < std::max(g.nu, g.nv); ++reach) {
        for (int row = std::max(0, j - reach); row <= std::min(g.nv - 1, j + reach); ++row) {
            for (int column = std::max(0, i - reach); column <= std::min(g.nu - 1, i + reach); ++column) {
                if (std::max(std::abs(row - j), std::abs(column - i)) != reach) continue;
                const std::uint32_t near = cell(column, row);
                for (std::uint32_t k = first_in_cell_[near]; k < first_in_cell_[near + 1]; ++k) consider(cell_patches_[k]);
            }
        }
    }
    return best;
}

void PatchGrid::interpolation_weights(PatchId id, const dvec3& point_m, std::span<double> weights) const {
    const auto polygon = polygon_of(id);
    const std::size_t n = polygon.size();
    const dvec3& normal = patches[index(id)].normal;
    std::fill(weights.begin(), weights.end(), 0.0);
    // Floater 2003: w_i = (tan(a_{i-1}/2) + tan(a_i/2)) / |v_i - p|, a_i the angle that edge i subtends.
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const dvec3 a = polygon[i] - point_m, b = polygon[(i + 1) % n] - point_m;
        const double la = glm::length(a), lb = glm::length(b), edge = glm::length(b - a);
        if (la < 1e-9 * edge) {
            std::fill(weights.begin(), weights.end(), 0.0);
            weights[i] = 1.0;
            return;
        }
        const double sine = glm::dot(normal, glm::cross(a, b)), cosine = glm::dot(a, b);
        if (cosine < 0.0 && sine <= 1e-9 * la * lb) {
            // On the edge, or outside by rounding: linear along it.
            std::fill(weights.begin(), weights.end(), 0.0);
            weights[i] = lb / (la + lb);
            weights[(i + 1) % n] = la / (la + lb);
            return;
        }
        // Of half the angle; by the form that does not divide by a difference that rounds to 0 close to an edge.
        const double tangent = cosine < 0.0 ? (la * lb - cosine) / sine : std::max(0.0, sine) / (la * lb + cosine);
        weights[i] += tangent / la;
        weights[(i + 1) % n] += tangent / lb;
        sum += tangent / la + tangent / lb;
    }
    if (sum > 0.0) {
        for (double& w : weights) w /= sum;
    } else {
        std::fill(weights.begin(), weights.end(), 1.0 / static_cast<double>(n));
    }
}

namespace {

// A patch in the making, in the plane of its face.
struct Piece {
    Ring outline;
    std::size_t zone = 0;
    std::vector<std::uint32_t> cells{};  // numbers within the face; more than one after slivers were joined
    bool whole = false;                  // a cell that nothing cuts
    double uncut_area_m2 = 0.0;          // of the cell, or of the part of a refined cell, that it is cut from
};

double distance_nm(const PlanePoint& a, const PlanePoint& b) {
    return std::hypot(static_cast<double>(b.X - a.X), static_cast<double>(b.Y - a.Y));
}

// Length over width: the square of the largest distance between corners, over the area.
double aspect(const Ring& ring) {
    double longest = 0.0;
    for (std::size_t i = 0; i < ring.size(); ++i)
        for (std::size_t j = i + 1; j < ring.size(); ++j) longest = std::max(longest, distance_nm(ring[i], ring[j]));
    const double length_m = longest / nanometres_per_metre;
    return length_m * length_m / area_m2(ring);
}

// The union of two pieces if it is one convex polygon, else empty.
Ring convex_union(const Ring& a, const Ring& b) {
    Ring corners = a;
    corners.insert(corners.end(), b.begin(), b.end());
    Ring hull = convex_hull(std::move(corners));
    // Corners may be off by 1 nm: the hull may be larger by that much along its outline.
    double outline_m = 0.0;
    for (std::size_t i = 0; i < hull.size(); ++i)
        outline_m += distance_nm(hull[i], hull[(i + 1) % hull.size()]) / nanometres_per_metre;
    const double excess = area_m2(hull) - area_m2(a) - area_m2(b);
    return std::abs(excess) <= 2e-9 * outline_m ? hull : Ring{};
}

}  // namespace

// Builds a grid face by face.
class PatchGridBuilder {
public:
    PatchGridBuilder(const Building& building, const GridOptions& options, const LightZones& zones)
        : building_(building), options_(options), zones_(zones) {}

    PatchGrid run() {
        grid_.face_grids_.resize(building_.faces.size());
        grid_.follows_zones = !zones_.umbra.empty();
        grid_.indoor_patch_count = add_faces([](const Face& f) { return f.environment == Environment::indoor && !f.aperture; });
        grid_.gather_patch_count = add_faces([](const Face& f) { return f.aperture.has_value(); });
        add_faces([](const Face& f) { return f.environment == Environment::outdoor; });
        if (!grid_.behind_.empty()) grid_.behind_.resize(grid_.patches.size(), PatchId::none);
        add_nodes();
        inset_outline_nodes(grid_);
        return std::move(grid_);
    }

private:
    // A part of a face in which light is of one kind.
    struct Zone {
        Region region;
        std::uint32_t sunspot = no_sunspot;
        bool umbra = false;
    };

    template <class Wanted>
    std::size_t add_faces(const Wanted& wanted) {
        for (std::size_t f = 0; f < building_.faces.size(); ++f)
            if (wanted(building_.faces[f])) add_face(f);
        return grid_.patches.size();
    }

    void add_face(std::size_t f) {
        const Face& face = building_.faces[f];
        PatchGrid::FaceGrid& g = lay_out(f);
        g.first_cell = static_cast<std::uint32_t>(grid_.first_in_cell_.size());
        // The other side of an inner aperture has the same patches, turned round, so that they pair up.
        if (face.other_side && index(*face.other_side) < f) {
            add_turned(make_id<FaceId>(f), g, grid_.face_grids_[index(*face.other_side)]);
            return;
        }
        const std::vector<Zone> zones = zones_of(f);
        std::vector<Piece> pieces = cut_cells(face, g, zones);
        join_slivers(g, pieces);
        add_pieces(make_id<FaceId>(f), g, zones, pieces);
    }

    PatchGrid::FaceGrid& lay_out(std::size_t f) {
        const Face& face = building_.faces[f];
        const double spacing = spacing_m(face, options_);
        PatchGrid::FaceGrid& g = grid_.face_grids_[f];
        const FaceFrame& frame = face.frame;
        g.nu = static_cast<int>(cell_count(glm::length(frame.u_m), spacing));
        g.nv = static_cast<int>(cell_count(glm::length(frame.v_m), spacing));
        g.origin_m = frame.origin_m;
        // Reciprocal basis of (u, v) in the plane, in cells.
        const dvec3 w = glm::cross(frame.u_m, frame.v_m);
        g.du = static_cast<double>(g.nu) * glm::cross(frame.v_m, w) / glm::dot(w, w);
        g.dv = static_cast<double>(g.nv) * glm::cross(w, frame.u_m) / glm::dot(w, w);
        return g;
    }

    std::vector<Zone> zones_of(std::size_t f) {
        const Region& whole = building_.faces[f].region;
        std::vector<Zone> zones{{whole}};
        if (f < zones_.sunspots.size()) {
            for (const Sunspot& spot : zones_.sunspots[f]) {
                zones[0].region = subtract(zones[0].region, spot.region);
                zones.push_back({spot.region, static_cast<std::uint32_t>(grid_.sunspot_illuminance_lx.size())});
                grid_.sunspot_illuminance_lx.push_back(spot.illuminance_lx);
            }
        }
        if (f < zones_.umbra.size() && !zones_.umbra[f].empty()) {
            zones[0].region = subtract(zones[0].region, zones_.umbra[f]);
            zones.push_back({zones_.umbra[f], no_sunspot, true});
        }
        return zones;
    }

    static std::uint32_t cell_number(const PatchGrid::FaceGrid& g, int i, int j) {
        return static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(g.nu) + static_cast<std::uint32_t>(i);
    }

    // A rectangle of a face's grid, in cells: [s0, s1] x [t0, t1].
    struct Quad {
        double s0, t0, s1, t1;
    };

    std::vector<Piece> cut_cells(const Face& face, const PatchGrid::FaceGrid& g, const std::vector<Zone>& zones) const {
        std::vector<std::vector<Piece>> rows(static_cast<std::size_t>(g.nv));
        parallel_for(rows.size(), 1, [&](std::size_t j) {
            // Cutting by a row first keeps the cost of a cell to what lies in its row.
            const Ring row = outline_of(face, g, {0.0, double(j), double(g.nu), double(j + 1)});
            std::vector<Region> in_row;
            for (const Zone& zone : zones) in_row.push_back(intersect(zone.region, {row}));
            for (int i = 0; i < g.nu; ++i) {
                const Quad cell{double(i), double(j), double(i + 1), double(j + 1)};
                cut_quad(face, g, cell, in_row, cell_number(g, i, static_cast<int>(j)), 0, rows[j]);
            }
        });
        std::vector<Piece> pieces;
        for (std::vector<Piece>& row : rows) std::move(row.begin(), row.end(), std::back_inserter(pieces));
        return pieces;
    }

    Ring outline_of(const Face& face, const PatchGrid::FaceGrid& g, const Quad& q) const {
        const auto corner = [&](double s, double t) { return face.plane.to_plane(place(face, g, s, t)); };
        Ring ring{corner(q.s0, q.t0), corner(q.s1, q.t0), corner(q.s1, q.t1), corner(q.s0, q.t1)};
        // Seen from the air, (u, v) may be left-handed; then cells are walked the other way round.
        if (glm::dot(glm::cross(face.frame.u_m, face.frame.v_m), face.normal) < 0.0) std::reverse(ring.begin(), ring.end());
        return ring;
    }

    static dvec3 place(const Face& face, const PatchGrid::FaceGrid& g, double s, double t) {
        return face.frame.origin_m + s / g.nu * face.frame.u_m + t / g.nv * face.frame.v_m;
    }

    // around: what each zone has in the surroundings of the quad.
    void cut_quad(const Face& face, const PatchGrid::FaceGrid& g, const Quad& q, const std::vector<Region>& around,
                  std::uint32_t cell, int level, std::vector<Piece>& pieces) const {
        const Ring outline = outline_of(face, g, q);
        const double area = area_m2(outline);
        std::vector<Region> inside;
        std::size_t zones_present = 0;
        for (const Region& zone : around) {
            inside.push_back(zone.empty() ? Region{} : intersect(zone, {outline}));
            if (area_m2(inside.back()) > smallest_share_of_cell * area) ++zones_present;
        }
        if (zones_present == 0) return;
        if (level < options_.refine.levels && face.environment == Environment::indoor && !face.aperture &&
            (zones_present > 1 || differs(face, g, q))) {
            const double s = 0.5 * (q.s0 + q.s1), t = 0.5 * (q.t0 + q.t1);
            for (const Quad& quarter : {Quad{q.s0, q.t0, s, t}, {s, q.t0, q.s1, t}, {q.s0, t, s, q.t1}, {s, t, q.s1, q.t1}})
                cut_quad(face, g, quarter, inside, cell, level + 1, pieces);
            return;
        }
        for (std::size_t z = 0; z < inside.size(); ++z) {
            const double share = area_m2(inside[z]) / area;
            if (share < smallest_share_of_cell) continue;
            if (share > 1.0 - 1e-9) {
                pieces.push_back({.outline = outline, .zone = z, .cells = {cell}, .whole = level == 0, .uncut_area_m2 = area});
                continue;
            }
            for (const Ring& part : convex_parts(inside[z]))
                if (area_m2(part) >= smallest_share_of_cell * area)
                    pieces.push_back({.outline = part, .zone = z, .cells = {cell}, .uncut_area_m2 = area});
        }
    }

    // True when the corners of a quad get very different shares of the light from the apertures.
    bool differs(const Face& face, const PatchGrid::FaceGrid& g, const Quad& q) const {
        double least = std::numeric_limits<double>::max(), most = 0.0;
        for (const auto& [s, t] : {std::pair{q.s0, q.t0}, {q.s1, q.t0}, {q.s1, q.t1}, {q.s0, q.t1}}) {
            const double sr = apertures_sr(place(face, g, s, t), face.normal);
            least = std::min(least, sr), most = std::max(most, sr);
        }
        return most > dark_sr && most - least > options_.refine.contrast * most;
    }

    // Projected solid angle of the exterior apertures as a point of a face would see them with nothing in the way, sr.
    double apertures_sr(const dvec3& point_m, const dvec3& normal) const {
        double sum = 0.0;
        std::vector<dvec3> polygon, visible;
        for (const Aperture& aperture : building_.apertures) {
            if (aperture.inner || glm::dot(point_m - aperture.centroid_m, aperture.normal) <= 0.0) continue;
            for (const FacetId part : aperture.facets) {
                polygon.clear();
                for (const dvec3& v : building_.facets[index(part)].vertices_m) polygon.push_back(v - point_m);
                keep_half_space(polygon, normal, visible);
                if (!visible.empty()) sum += std::abs(glm::dot(normal, vector_solid_angle(visible)));
            }
        }
        return sum;
    }

    // For each cell of a face, the pieces in it.
    static std::vector<std::vector<std::size_t>> pieces_by_cell(const PatchGrid::FaceGrid& g, const std::vector<Piece>& pieces) {
        std::vector<std::vector<std::size_t>> by_cell(static_cast<std::size_t>(g.nu) * static_cast<std::size_t>(g.nv));
        for (std::size_t p = 0; p < pieces.size(); ++p)
            for (const std::uint32_t cell : pieces[p].cells) by_cell[cell].push_back(p);
        return by_cell;
    }

    // Calls visit(piece) for the pieces in the cells of a piece and in those around them; some may come twice.
    template <class Visit>
    static void for_each_around(const PatchGrid::FaceGrid& g, const std::vector<std::vector<std::size_t>>& by_cell,
                                const Piece& piece, const Visit& visit) {
        for (const std::uint32_t cell : piece.cells) {
            const int i = static_cast<int>(cell % static_cast<std::uint32_t>(g.nu));
            const int j = static_cast<int>(cell / static_cast<std::uint32_t>(g.nu));
            for (int row = std::max(0, j - 1); row <= std::min(g.nv - 1, j + 1); ++row)
                for (int column = std::max(0, i - 1); column <= std::min(g.nu - 1, i + 1); ++column)
                    for (const std::size_t other : by_cell[cell_number(g, column, row)]) visit(other);
        }
    }

    void join_slivers(const PatchGrid::FaceGrid& g, std::vector<Piece>& pieces) const {
        std::vector<std::size_t> slivers;
        const auto is_sliver = [&](const Piece& piece) {
            const double area = area_m2(piece.outline);
            return area < options_.sliver_area * piece.uncut_area_m2 ||
                   (area < (1.0 - 1e-9) * piece.uncut_area_m2 && aspect(piece.outline) > options_.sliver_aspect);
        };
        for (std::size_t p = 0; p < pieces.size(); ++p)
            if (is_sliver(pieces[p])) slivers.push_back(p);
        if (slivers.empty()) return;
        std::sort(slivers.begin(), slivers.end(), [&](std::size_t a, std::size_t b) {
            const double area_a = area_m2(pieces[a].outline), area_b = area_m2(pieces[b].outline);
            return area_a != area_b ? area_a < area_b : a < b;
        });
        auto by_cell = pieces_by_cell(g, pieces);
        for (const std::size_t p : slivers) {
            if (pieces[p].outline.empty() || !is_sliver(pieces[p])) continue;
            std::size_t best = p;
            Ring joined;
            double best_aspect = std::numeric_limits<double>::max();
            for_each_around(g, by_cell, pieces[p], [&](std::size_t q) {
                if (q == p || q == best || pieces[q].outline.empty() || pieces[q].zone != pieces[p].zone) return;
                Ring both = convex_union(pieces[p].outline, pieces[q].outline);
                if (both.empty() || aspect(both) >= best_aspect) return;
                best = q;
                best_aspect = aspect(both);
                joined = std::move(both);
            });
            if (best == p) continue;
            Piece& grown = pieces[best];
            grown.outline = std::move(joined);
            grown.whole = false;
            grown.uncut_area_m2 = std::max(grown.uncut_area_m2, pieces[p].uncut_area_m2);
            for (const std::uint32_t cell : pieces[p].cells) {
                if (std::find(grown.cells.begin(), grown.cells.end(), cell) != grown.cells.end()) continue;
                grown.cells.push_back(cell);
                by_cell[cell].push_back(best);
            }
            pieces[p].outline.clear();
        }
        std::erase_if(pieces, [](const Piece& piece) { return piece.outline.empty(); });
    }

    // Where a corner of a neighbour lies on an edge, the edge gets that corner too: neighbours then have the same values
    // along all of what they share, and no gap opens between them.
    static std::vector<Ring> with_corners_of_neighbours(const PatchGrid::FaceGrid& g, const std::vector<Piece>& pieces) {
        const auto by_cell = pieces_by_cell(g, pieces);
        std::vector<Ring> outlines;
        std::vector<std::pair<double, PlanePoint>> on_edge;
        for (const Piece& piece : pieces) {
            bool all_whole = piece.whole;
            if (all_whole) for_each_around(g, by_cell, piece, [&](std::size_t q) { all_whole = all_whole && pieces[q].whole; });
            if (all_whole) {
                outlines.push_back(piece.outline);
                continue;
            }
            Ring outline;
            const std::size_t n = piece.outline.size();
            for (std::size_t k = 0; k < n; ++k) {
                const PlanePoint &a = piece.outline[k], &b = piece.outline[(k + 1) % n];
                const double length = distance_nm(a, b);
                if (length < same_node_nm) continue;
                const double ux = static_cast<double>(b.X - a.X) / length, uy = static_cast<double>(b.Y - a.Y) / length;
                on_edge.clear();
                for_each_around(g, by_cell, piece, [&](std::size_t q) {
                    for (const PlanePoint& p : pieces[q].outline) {
                        const auto px = static_cast<double>(p.X - a.X), py = static_cast<double>(p.Y - a.Y);
                        const double along = px * ux + py * uy;
                        if (std::abs(px * uy - py * ux) < 0.1 * same_node_nm && along > same_node_nm && along < length - same_node_nm)
                            on_edge.emplace_back(along, p);
                    }
                });
                std::sort(on_edge.begin(), on_edge.end(), [](const auto& p, const auto& q) {
                    return p.first != q.first ? p.first < q.first : p.second.X < q.second.X;
                });
                outline.push_back(a);
                for (const auto& [along, p] : on_edge)
                    if (distance_nm(outline.back(), p) > same_node_nm) outline.push_back(p);
            }
            outlines.push_back(std::move(outline));
        }
        return outlines;
    }

    void add_pieces(FaceId id, const PatchGrid::FaceGrid& g, const std::vector<Zone>& zones, std::vector<Piece>& pieces) {
        // Patches in the order of their cells, so that neighbours are near each other in memory.
        std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.cells[0] < b.cells[0]; });
        const Face& face = building_.faces[index(id)];
        const std::vector<Ring> outlines = with_corners_of_neighbours(g, pieces);
        std::vector<std::vector<PatchId>> by_cell(static_cast<std::size_t>(g.nu) * static_cast<std::size_t>(g.nv));
        for (std::size_t p = 0; p < pieces.size(); ++p) {
            if (outlines[p].size() < 3) continue;
            std::vector<dvec3> polygon;
            for (const PlanePoint& corner : outlines[p]) polygon.push_back(face.plane.to_world(corner));
            for (const std::uint32_t cell : pieces[p].cells) by_cell[cell].push_back(make_id<PatchId>(grid_.patches.size()));
            add_patch(id, polygon, face.normal);
            grid_.patches.back().sunspot = zones[pieces[p].zone].sunspot;
            grid_.patches.back().umbra = zones[pieces[p].zone].umbra;
        }
        for (const auto& cell : by_cell) {
            grid_.first_in_cell_.push_back(static_cast<std::uint32_t>(grid_.cell_patches_.size()));
            grid_.cell_patches_.insert(grid_.cell_patches_.end(), cell.begin(), cell.end());
        }
        grid_.first_in_cell_.push_back(static_cast<std::uint32_t>(grid_.cell_patches_.size()));
    }

    void add_turned(FaceId id, const PatchGrid::FaceGrid& g, const PatchGrid::FaceGrid& other) {
        grid_.behind_.resize(grid_.patches.size(), PatchId::none);
        const auto cells = static_cast<std::uint32_t>(g.nu) * static_cast<std::uint32_t>(g.nv);
        for (std::uint32_t c = 0; c < cells; ++c) {
            grid_.first_in_cell_.push_back(static_cast<std::uint32_t>(grid_.cell_patches_.size()));
            for (std::uint32_t k = grid_.first_in_cell_[other.first_cell + c]; k < grid_.first_in_cell_[other.first_cell + c + 1]; ++k) {
                const PatchId front = grid_.cell_patches_[k];
                if (grid_.behind_[index(front)] == PatchId::none) {
                    const auto polygon = grid_.polygon_of(front);
                    grid_.behind_[index(front)] = make_id<PatchId>(grid_.patches.size());
                    grid_.behind_.push_back(front);
                    add_patch(id, {polygon.rbegin(), polygon.rend()}, building_.faces[index(id)].normal);
                }
                grid_.cell_patches_.push_back(grid_.behind_[index(front)]);
            }
        }
        grid_.first_in_cell_.push_back(static_cast<std::uint32_t>(grid_.cell_patches_.size()));
    }

    void add_patch(FaceId face, const std::vector<dvec3>& polygon, const dvec3& normal) {
        Patch patch{.face = face, .normal = normal};
        patch.first_corner = static_cast<std::uint32_t>(grid_.corner_positions_m.size());
        patch.corner_count = static_cast<std::uint32_t>(polygon.size());
        patch.centroid_m = polygon_centroid(polygon);
        for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
            patch.area_m2 += 0.5 * glm::length(glm::cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]));
        grid_.corner_positions_m.insert(grid_.corner_positions_m.end(), polygon.begin(), polygon.end());
        grid_.patches.push_back(patch);
    }

    // The corners of indoor patches, each once per face and sunspot.
    void add_nodes() {
        std::size_t p = 0;
        while (p < grid_.indoor_patch_count) {
            const FaceId face = grid_.patches[p].face;
            std::map<std::uint32_t, NodeFinder> finders;
            const std::size_t first_node = grid_.nodes.size();
            std::vector<bool> lit;
            for (; p < grid_.indoor_patch_count && grid_.patches[p].face == face; ++p) {
                const Patch& patch = grid_.patches[p];
                NodeFinder& finder = finders.try_emplace(patch.sunspot, grid_.nodes).first->second;
                for (const dvec3& corner : grid_.polygon_of(make_id<PatchId>(p))) {
                    const NodeId node = finder.node_at(face, building_.faces[index(face)].plane.to_plane(corner), corner);
                    grid_.corners.push_back(node);
                    lit.resize(grid_.nodes.size() - first_node, false);
                    grid_.nodes[index(node)].sunspot = patch.sunspot;
                    if (!patch.umbra) lit[index(node) - first_node] = true;
                }
            }
            for (std::size_t n = first_node; n < grid_.nodes.size(); ++n) grid_.nodes[n].umbra = !lit[n - first_node];
        }
    }

    const Building& building_;
    const GridOptions& options_;
    const LightZones& zones_;
    PatchGrid grid_;
};

PatchGrid make_patch_grid(const Building& building, const GridOptions& options, const LightZones& zones) {
    refuse_too_many_cells(building, options);
    return PatchGridBuilder(building, options, zones).run();
}

}  // namespace naturel
