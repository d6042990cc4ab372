#include "core/patch_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <unordered_map>

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

int cell_count(double length_m, double spacing_m) {
    return std::max(1, static_cast<int>(std::ceil(length_m / spacing_m - 1e-9)));
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
        nodes_.push_back({face, position_m, position_m});
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

// Pulls nodes that are not surrounded by patches of their face towards those patches.
void inset_outline_nodes(PatchGrid& grid) {
    struct Surroundings {
        double angle = 0.0;
        dvec3 pull{};
        double room_m = std::numeric_limits<double>::max();
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
            const double angle = std::acos(std::clamp(glm::dot(towards(i + 1), towards(i + corners.size() - 1)), -1.0, 1.0));
            const dvec3 to_centroid = patch.centroid_m - here;
            Surroundings& s = around[index(corners[i])];
            s.angle += angle;
            s.pull += angle * glm::normalize(to_centroid);
            s.room_m = std::min(s.room_m, glm::length(to_centroid));
        }
    }
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
        const Surroundings& s = around[n];
        const double length = glm::length(s.pull);
        if (s.angle > 2.0 * pi - 1e-6 || length < 1e-9) continue;
        grid.nodes[n].gather_position_m += std::min(node_inset_m, 0.1 * s.room_m) / length * s.pull;
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
    const std::uint32_t first = first_patch_[c], last = first_patch_[c + 1];
    if (last - first == 1) return make_id<PatchId>(first);
    // Distance inside the outline of a patch (negative outside): the largest wins.
    PatchId best = PatchId::none;
    double deepest = std::numeric_limits<double>::lowest();
    const auto consider = [&](std::uint32_t p) {
        const auto polygon = polygon_of(make_id<PatchId>(p));
        double depth = std::numeric_limits<double>::max();
        for (std::size_t k = 0; k < polygon.size(); ++k) {
            const dvec3& a = polygon[k];
            const dvec3 edge = polygon[(k + 1) % polygon.size()] - a;
            const dvec3 inward = glm::cross(patches[p].normal, edge);
            depth = std::min(depth, glm::dot(inward, point_m - a) / glm::length(inward));
        }
        if (depth > deepest) deepest = depth, best = make_id<PatchId>(p);
    };
    for (std::uint32_t p = first; p < last; ++p) consider(p);
    // An empty cell: its corner was cut off, and the point lies outside by rounding. Look around.
    for (int reach = 1; best == PatchId::none && reach < std::max(g.nu, g.nv); ++reach) {
        for (int row = std::max(0, j - reach); row <= std::min(g.nv - 1, j + reach); ++row) {
            for (int column = std::max(0, i - reach); column <= std::min(g.nu - 1, i + reach); ++column) {
                if (std::max(std::abs(row - j), std::abs(column - i)) != reach) continue;
                const std::uint32_t k = cell(column, row);
                for (std::uint32_t p = first_patch_[k]; p < first_patch_[k + 1]; ++p) consider(p);
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
        const double tangent = std::max(0.0, sine) / (la * lb + cosine);
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

PatchGrid make_patch_grid(const Building& building, const GridOptions& options) {
    PatchGrid grid;
    grid.face_grids_.resize(building.faces.size());
    const auto spacing_of = [&](const Face& face) {
        return face.environment == Environment::outdoor ? options.outdoor_spacing_m : options.spacing_m;
    };

    const auto add_patch = [&](FaceId face, std::vector<dvec3> polygon, const dvec3& normal) {
        Patch patch{.face = face, .normal = normal};
        patch.first_corner = static_cast<std::uint32_t>(grid.corner_positions_m.size());
        patch.corner_count = static_cast<std::uint32_t>(polygon.size());
        patch.centroid_m = polygon_centroid(polygon);
        for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
            patch.area_m2 += 0.5 * glm::length(glm::cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]));
        grid.corner_positions_m.insert(grid.corner_positions_m.end(), polygon.begin(), polygon.end());
        grid.patches.push_back(patch);
    };

    const auto add_face = [&](std::size_t f) {
        const Face& face = building.faces[f];
        const FaceId id = make_id<FaceId>(f);
        PatchGrid::FaceGrid& g = grid.face_grids_[f];
        const FaceFrame& frame = face.frame;
        g.nu = cell_count(glm::length(frame.u_m), spacing_of(face));
        g.nv = cell_count(glm::length(frame.v_m), spacing_of(face));
        g.origin_m = frame.origin_m;
        // Reciprocal basis of (u, v) in the plane, in cells.
        const dvec3 w = glm::cross(frame.u_m, frame.v_m);
        g.du = static_cast<double>(g.nu) * glm::cross(frame.v_m, w) / glm::dot(w, w);
        g.dv = static_cast<double>(g.nv) * glm::cross(w, frame.u_m) / glm::dot(w, w);
        g.first_cell = static_cast<std::uint32_t>(grid.first_patch_.size());

        // The other side of an inner aperture has the same patches, turned round, so that they pair up.
        if (face.other_side && index(*face.other_side) < f) {
            const PatchGrid::FaceGrid& other = grid.face_grids_[index(*face.other_side)];
            const auto cells = static_cast<std::uint32_t>(g.nu) * static_cast<std::uint32_t>(g.nv);
            for (std::uint32_t c = 0; c < cells; ++c) {
                grid.first_patch_.push_back(static_cast<std::uint32_t>(grid.patches.size()));
                for (std::uint32_t p = grid.first_patch_[other.first_cell + c]; p < grid.first_patch_[other.first_cell + c + 1]; ++p) {
                    const auto polygon = grid.polygon_of(make_id<PatchId>(p));
                    add_patch(id, {polygon.rbegin(), polygon.rend()}, face.normal);
                    grid.behind_.resize(grid.patches.size(), PatchId::none);
                    grid.behind_[p] = make_id<PatchId>(grid.patches.size() - 1);
                    grid.behind_.back() = make_id<PatchId>(p);
                }
            }
            grid.first_patch_.push_back(static_cast<std::uint32_t>(grid.patches.size()));
            return;
        }

        const auto lattice = [&](int i, int j) {
            return frame.origin_m + (static_cast<double>(i) / g.nu) * frame.u_m + (static_cast<double>(j) / g.nv) * frame.v_m;
        };
        // Seen from the air, (u, v) may be left-handed; then cells are walked the other way round.
        const bool right_handed = glm::dot(w, face.normal) > 0.0;
        const auto quad = [&](int i0, int j0, int i1, int j1) {
            Ring ring{face.plane.to_plane(lattice(i0, j0)), face.plane.to_plane(lattice(i1, j0)),
                      face.plane.to_plane(lattice(i1, j1)), face.plane.to_plane(lattice(i0, j1))};
            if (!right_handed) std::reverse(ring.begin(), ring.end());
            return ring;
        };
        const double cell_area_m2 = glm::length(w) / g.nu / g.nv;
        for (int j = 0; j < g.nv; ++j) {
            // Cutting by a row first keeps the cost of a cell to what lies in its row.
            const Region row = intersect(face.region, {quad(0, j, g.nu, j + 1)});
            const bool whole_row = std::abs(area_m2(row) - cell_area_m2 * g.nu) < 1e-9 * cell_area_m2 * g.nu;
            for (int i = 0; i < g.nu; ++i) {
                grid.first_patch_.push_back(static_cast<std::uint32_t>(grid.patches.size()));
                if (row.empty()) continue;
                const Ring cell = quad(i, j, i + 1, j + 1);
                const Region left = whole_row ? Region{cell} : intersect(row, {cell});
                const double share = area_m2(left) / cell_area_m2;
                if (share < smallest_share_of_cell) continue;
                const bool whole = share > 1.0 - 1e-9;
                for (const Ring& part : whole ? std::vector<Ring>{cell} : convex_parts(left)) {
                    if (area_m2(part) < smallest_share_of_cell * cell_area_m2) continue;
                    std::vector<dvec3> polygon;
                    for (const PlanePoint& p : part) {
                        const dvec3 corner = face.plane.to_world(p);
                        if (polygon.empty() || !same_node(polygon.back(), corner)) polygon.push_back(corner);
                    }
                    while (polygon.size() > 3 && same_node(polygon.front(), polygon.back())) polygon.pop_back();
                    if (polygon.size() >= 3) add_patch(id, std::move(polygon), face.normal);
                }
            }
        }
        grid.first_patch_.push_back(static_cast<std::uint32_t>(grid.patches.size()));
    };

    const auto add_faces = [&](auto wanted) {
        for (std::size_t f = 0; f < building.faces.size(); ++f)
            if (wanted(building.faces[f])) add_face(f);
        return grid.patches.size();
    };
    grid.indoor_patch_count =
        add_faces([](const Face& f) { return f.environment == Environment::indoor && !f.aperture; });
    grid.gather_patch_count = add_faces([](const Face& f) { return f.aperture.has_value(); });
    add_faces([](const Face& f) { return f.environment == Environment::outdoor; });
    if (!grid.behind_.empty()) grid.behind_.resize(grid.patches.size(), PatchId::none);

    // Nodes: the corners of indoor patches, each once per face.
    std::size_t p = 0;
    while (p < grid.indoor_patch_count) {
        const FaceId face = grid.patches[p].face;
        NodeFinder finder(grid.nodes);
        for (; p < grid.indoor_patch_count && grid.patches[p].face == face; ++p) {
            for (const dvec3& corner : grid.polygon_of(make_id<PatchId>(p)))
                grid.corners.push_back(finder.node_at(face, building.faces[index(face)].plane.to_plane(corner), corner));
        }
    }
    inset_outline_nodes(grid);
    return grid;
}

}  // namespace naturel
