#include "embree_backend/pairwise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "core/errors.h"
#include "core/gauss_legendre.h"
#include "core/parallel.h"
#include "core/polygon_form_factor.h"
#include "core/units.h"
#include "embree_backend/pair_geometry.h"
#include "embree_backend/sampling.h"
#include "embree_backend/shadows.h"

namespace naturel {
namespace {

using namespace pairwise;
using glm::dvec3;

constexpr std::size_t patches_per_block = 64;
constexpr double on_plane_m = 1e-9;  // geometry is rounded to 1 nm: a corner in a plane is not cut off

/// Orders of the product rule, from cheap to dear. On a parallelogram it is exact for polynomials of one more degree than on another
/// quadrilateral or a triangle, where its nodes are spread by a bilinear map: those take the next order. For patches that are no larger than `eta` times their
/// distance (both radii over the distance of the centres) the rule errs by less than `error` eta^(2 order) of
/// A A' / (pi r^2), which is chosen on the safe side of the next term of the rule.
struct Rule {
    int order;
    double error;
};
constexpr std::array<Rule, 3> rules{{{2, 0.5}, {3, 0.4}, {4, 0.4}}};
constexpr double rule_error = 1e-5;  // of A A' / (pi r^2), which no form factor exceeds by much
constexpr std::uint8_t by_contour = 255, nothing = 0;

/// Nodes of one rule for all patches: node k of patch b at [k x patches + b]. Weights include the area.
struct Nodes {
    std::size_t count = 0;
    std::vector<double> x, y, z, weight;
};

enum Shape : std::uint8_t { parallelogram = 0, quadrilateral = 1, other = 2 };  ///< a triangle has two corners of a quadrilateral in one

struct Block {
    std::size_t first = 0, last = 0;
    std::uint32_t face = 0;
    std::vector<dvec3> corners_m{};  ///< of a rectangle in the plane of the face around all its patches
    std::vector<VertexQuad> corner_quads{};
    dvec3 low_m{}, high_m{};
};

struct Entry {
    std::uint32_t to;
    float error;
    double value_m2;
};

struct Scratch {
    Shadows shadows;
    std::vector<std::uint32_t> in_block_pair, in_row, chosen;
    std::vector<Obstacle> obstacles;
    std::vector<EdgeForm> forms;
    std::vector<dvec3> clipped_a, clipped_b;
};

/// A A' integral of the kernel cos cos' / (pi r^2) between one patch and `count` others by a product rule. No branches:
/// the compiler makes it as wide as the machine is, and each lane has the same bits in all widths.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
__attribute__((target_clones("avx2", "default")))
#endif
void far_exchanges(const Nodes& nodes, std::size_t patches, std::size_t from, const dvec3& normal, double plane_m,
                   std::size_t first, std::size_t count, const dvec3& to_normal, double to_plane_m, double* exchange_m2) {
    double sum[patches_per_block], above[16][patches_per_block];
    for (std::size_t j = 0; j < count; ++j) sum[j] = 0.0;
    for (std::size_t k = 0; k < nodes.count; ++k) {
        const double* x = nodes.x.data() + k * patches + first;
        const double* y = nodes.y.data() + k * patches + first;
        const double* z = nodes.z.data() + k * patches + first;
        const double* w = nodes.weight.data() + k * patches + first;
        for (std::size_t j = 0; j < count; ++j)
            above[k][j] = w[j] * (normal.x * x[j] + normal.y * y[j] + normal.z * z[j] - plane_m);
    }
    for (std::size_t p = 0; p < nodes.count; ++p) {
        const double px = nodes.x[p * patches + from], py = nodes.y[p * patches + from], pz = nodes.z[p * patches + from];
        const double over = nodes.weight[p * patches + from] *
                            (to_normal.x * px + to_normal.y * py + to_normal.z * pz - to_plane_m) * (1.0 / pi);
        for (std::size_t k = 0; k < nodes.count; ++k) {
            const double* x = nodes.x.data() + k * patches + first;
            const double* y = nodes.y.data() + k * patches + first;
            const double* z = nodes.z.data() + k * patches + first;
            for (std::size_t j = 0; j < count; ++j) {
                const double dx = x[j] - px, dy = y[j] - py, dz = z[j] - pz;
                const double square = dx * dx + dy * dy + dz * dz;
                sum[j] += over * above[k][j] / (square * square);
            }
        }
    }
    for (std::size_t j = 0; j < count; ++j) exchange_m2[j] = sum[j];
}

/// How the lines from P, whose forms are given, to the points of a polygon pass an occluder.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
__attribute__((target_clones("avx2", "default")))
#endif
Passage passage(const Obstacle& o, const EdgeForm* forms, std::size_t vertices, const VertexQuad* quads,
                std::size_t quad_count) {
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    for (std::size_t q = 0; q < quad_count; ++q) {
        const Four h = quads[q].x * o.nx + quads[q].y * o.ny + quads[q].z * o.nz - o.plane_m;
        for (int k = 0; k < 4; ++k) lowest = std::min(lowest, h[k]), highest = std::max(highest, h[k]);
    }
    if (lowest >= -in_plane_m) return Passage::clear;
    bool all_inside = o.all_in_front && highest <= in_plane_m;
    const EdgeForm* f = forms + o.first_form;
    for (std::uint32_t e = 0; e < o.edges; ++e, f += vertices) {
        Four low{}, high{};
        bool first = true;
        for (std::size_t p = 0; p < vertices; ++p)
            for (std::size_t q = 0; q < quad_count; ++q) {
                const Four s = quads[q].x * f[p].gx + quads[q].y * f[p].gy + quads[q].z * f[p].gz + f[p].g0;
                if (first) {
                    low = high = s, first = false;
                } else {
                    low = s < low ? s : low;
                    high = s > high ? s : high;
                }
            }
        const double most = std::max(std::max(high[0], high[1]), std::max(high[2], high[3]));
        if (most <= 1e-9) return Passage::clear;
        const double least = std::min(std::min(low[0], low[1]), std::min(low[2], low[3]));
        all_inside = all_inside && least >= -1e-9;
    }
    return all_inside ? Passage::blocked : Passage::partial;
}

/// Calls visit(part) for parts of at most `most_vertices` corners that a convex polygon is made of; most are one.
template <class Visit>
void for_each_part(std::span<const dvec3> v, const Visit& visit) {
    if (v.size() <= most_vertices) return visit(v);
    std::array<dvec3, most_vertices> part;
    part[0] = v[0];
    for (std::size_t start = 1; start + 1 < v.size(); start += most_vertices - 2) {
        const std::size_t corners = std::min(v.size() - start, most_vertices - 1);
        std::copy_n(v.begin() + static_cast<std::ptrdiff_t>(start), corners, part.begin() + 1);
        visit(std::span<const dvec3>(part.data(), corners + 1));
    }
}

std::vector<VertexQuad> in_quads(std::span<const dvec3> v) {
    std::vector<VertexQuad> quads((v.size() + 3) / 4);
    for (std::size_t k = 0; k < 4 * quads.size(); ++k) {
        const dvec3& p = v[std::min(k, v.size() - 1)];
        quads[k / 4].x[k % 4] = p.x, quads[k / 4].y[k % 4] = p.y, quads[k / 4].z[k % 4] = p.z;
    }
    return quads;
}

}  // namespace

struct PairwiseExchange::Data {
    double tolerance = 0.0;
    dvec3 centre_m{};
    // Patches in the order of blocks: those of a face together, near ones near each other.
    std::size_t count = 0;
    std::vector<std::uint32_t> patch;  ///< PatchId at a place of that order
    std::vector<std::uint32_t> place;  ///< and back
    std::vector<dvec3> middle_m, vertices_m;
    std::vector<double> radius_m, area_m2;
    std::vector<std::uint32_t> first_vertex;  ///< [count + 1]
    std::vector<VertexQuad> quads;
    std::vector<std::uint32_t> first_quad;  ///< [count + 1]
    std::vector<std::uint8_t> shape;        ///< see Shape
    std::vector<std::uint32_t> block_of;
    std::array<Nodes, rules.size()> nodes;
    std::vector<dvec3> face_normal;
    std::vector<double> face_plane_m;
    std::vector<Block> blocks;
    std::vector<Occluder> occluders;
    std::vector<dvec3> occluder_vertices_m;
    mutable ThreadScratch<Scratch> scratch;

    Polygon polygon(std::size_t a) const {
        const std::uint32_t face = blocks[block_of[a]].face;
        return {std::span(vertices_m).subspan(first_vertex[a], first_vertex[a + 1] - first_vertex[a]), face_normal[face],
                face_plane_m[face]};
    }
    std::span<const VertexQuad> quads_of(std::size_t a) const {
        return std::span(quads).subspan(first_quad[a], first_quad[a + 1] - first_quad[a]);
    }

    void take_patches(const Building& building, const PatchGrid& grid);
    void take_occluders(const Building& building);
    template <class Emit>
    void exchange_with_block(std::size_t a, const Block& to, std::size_t first, std::size_t last, std::span<const std::uint32_t> candidates,
                             Scratch& s, PairwiseCount& counted, const Emit& emit) const;
    void find_candidates(const Block& from, const Block& to, std::vector<std::uint32_t>& found) const;
    bool collect_obstacles(std::span<const dvec3> from, std::span<const VertexQuad> to,
                           std::span<const std::uint32_t> candidates, Scratch& s) const;
    ExchangeEstimate past_occluders(std::size_t a, std::size_t b, bool cut_a, bool cut_b, double unoccluded_m2, Scratch& s) const;
};

void PairwiseExchange::Data::take_patches(const Building& building, const PatchGrid& grid) {
    count = grid.gather_patch_count;
    dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (std::size_t k = 0; k < count; ++k)
        for (const dvec3& v : grid.polygon_of(make_id<PatchId>(k))) low = glm::min(low, v), high = glm::max(high, v);
    centre_m = count > 0 ? 0.5 * (low + high) : dvec3{};

    face_normal.resize(building.faces.size());
    face_plane_m.resize(building.faces.size());
    std::vector<std::uint64_t> key(count);
    for (std::size_t k = 0; k < count; ++k) {
        const Patch& p = grid.patches[k];
        const Face& face = building.faces[index(p.face)];
        face_normal[index(p.face)] = p.normal;
        face_plane_m[index(p.face)] = glm::dot(p.normal, face.plane.origin_m - centre_m);
        // Cells of the frame in Morton's order, so that a block is about as long as wide.
        const dvec3 d = p.centroid_m - face.frame.origin_m;
        const double length_u = glm::length(face.frame.u_m), length_v = glm::length(face.frame.v_m);
        const double unit = std::max(length_u, length_v) / 65535.0;
        const auto along = [&](const dvec3& axis, double length) {
            return static_cast<std::uint32_t>(std::clamp(glm::dot(d, axis) / length / unit, 0.0, 65535.0));
        };
        key[k] = static_cast<std::uint64_t>(index(p.face)) << 32 |
                 embree_sampling::morton(along(face.frame.u_m, length_u), along(face.frame.v_m, length_v));
    }
    patch.resize(count);
    std::iota(patch.begin(), patch.end(), 0u);
    std::sort(patch.begin(), patch.end(),
              [&](std::uint32_t a, std::uint32_t b) { return key[a] < key[b] || (key[a] == key[b] && a < b); });
    place.resize(count);

    for (std::size_t r = 0; r < rules.size(); ++r) {
        nodes[r].count = static_cast<std::size_t>(rules[r].order * rules[r].order);
        for (auto* list : {&nodes[r].x, &nodes[r].y, &nodes[r].z, &nodes[r].weight}) list->resize(nodes[r].count * count);
    }
    first_vertex.push_back(0);
    first_quad.push_back(0);
    for (std::size_t a = 0; a < count; ++a) {
        const Patch& p = grid.patches[patch[a]];
        place[patch[a]] = static_cast<std::uint32_t>(a);
        const auto corners = grid.polygon_of(make_id<PatchId>(patch[a]));
        for (const dvec3& v : corners) vertices_m.push_back(v - centre_m);
        const auto v = std::span(vertices_m).subspan(first_vertex.back());
        first_vertex.push_back(static_cast<std::uint32_t>(vertices_m.size()));
        const auto four = in_quads(v);
        quads.insert(quads.end(), four.begin(), four.end());
        first_quad.push_back(static_cast<std::uint32_t>(quads.size()));
        middle_m.push_back(p.centroid_m - centre_m);
        area_m2.push_back(p.area_m2);
        double radius = 0.0;
        for (const dvec3& c : v) radius = std::max(radius, glm::distance(c, middle_m.back()));
        radius_m.push_back(radius);
        // Corners are rounded to 1 nm.
        const bool straight = v.size() == 4 && glm::length(v[0] + v[2] - v[1] - v[3]) < 1e-8;
        shape.push_back(straight ? parallelogram : v.size() <= 4 ? quadrilateral : other);
        if (shape.back() == other) continue;
        const dvec3 &c0 = v[0], &c1 = v[1], &c2 = v[2], &c3 = v.back();
        for (std::size_t r = 0; r < rules.size(); ++r) {
            const QuadratureRule rule = gauss_legendre(rules[r].order);
            std::size_t k = 0;
            for (std::size_t i = 0; i < rule.nodes.size(); ++i)
                for (std::size_t j = 0; j < rule.nodes.size(); ++j, ++k) {
                    const double s = rule.nodes[i], t = rule.nodes[j];
                    const dvec3 bend = straight ? dvec3{} : c0 - c1 + c2 - c3;
                    const dvec3 at = c0 + s * (c1 - c0) + t * (c3 - c0) + s * t * bend;
                    const double area =
                        straight ? p.area_m2 : glm::dot(p.normal, glm::cross(c1 - c0 + t * bend, c3 - c0 + s * bend));
                    nodes[r].x[k * count + a] = at.x;
                    nodes[r].y[k * count + a] = at.y;
                    nodes[r].z[k * count + a] = at.z;
                    nodes[r].weight[k * count + a] = rule.weights[i] * rule.weights[j] * area;
                }
        }
    }

    block_of.resize(count);
    for (std::size_t a = 0; a < count;) {
        const std::size_t face = index(grid.patches[patch[a]].face);
        Block block{.first = a, .face = static_cast<std::uint32_t>(face)};
        const dvec3 u = glm::normalize(building.faces[face].frame.u_m), w = glm::cross(face_normal[face], u);
        double u0 = std::numeric_limits<double>::infinity(), u1 = -u0, w0 = u0, w1 = -u0;
        for (; a < count && a - block.first < patches_per_block && index(grid.patches[patch[a]].face) == face; ++a) {
            block_of[a] = static_cast<std::uint32_t>(blocks.size());
            for (std::uint32_t k = first_vertex[a]; k < first_vertex[a + 1]; ++k) {
                u0 = std::min(u0, glm::dot(vertices_m[k], u)), u1 = std::max(u1, glm::dot(vertices_m[k], u));
                w0 = std::min(w0, glm::dot(vertices_m[k], w)), w1 = std::max(w1, glm::dot(vertices_m[k], w));
            }
        }
        block.last = a;
        const dvec3 base = face_plane_m[face] * face_normal[face];
        for (const auto& [x, y] : {std::pair{u0, w0}, {u1, w0}, {u1, w1}, {u0, w1}}) block.corners_m.push_back(base + x * u + y * w);
        block.corner_quads = in_quads(block.corners_m);
        block.low_m = block.high_m = block.corners_m[0];
        for (const dvec3& c : block.corners_m) block.low_m = glm::min(block.low_m, c), block.high_m = glm::max(block.high_m, c);
        blocks.push_back(std::move(block));
    }
}

/// Every facet, apertures too: they are surfaces to form factors. A line that enters a solid meets a facet from its front, so
/// fronts are enough; sheets have no solid behind them and block from both sides.
void PairwiseExchange::Data::take_occluders(const Building& building) {
    const auto add = [&](std::span<const dvec3> v, const dvec3& normal, bool turned) {
        for (std::size_t start = 1; start + 1 < v.size(); start += most_vertices - 2) {
            Occluder o{.normal = turned ? -normal : normal, .first_vertex = static_cast<std::uint32_t>(occluder_vertices_m.size())};
            std::vector<dvec3> part{v[0]};
            for (std::size_t k = start; k < std::min(v.size(), start + most_vertices - 1); ++k)
                if (glm::distance(v[k], part.back()) > 1e-9) part.push_back(v[k]);
            if (part.size() > 3 && glm::distance(part.front(), part.back()) <= 1e-9) part.pop_back();
            if (part.size() < 3) continue;
            if (turned) std::reverse(part.begin(), part.end());
            o.low_m = o.high_m = part[0] - centre_m;
            for (const dvec3& p : part) {
                occluder_vertices_m.push_back(p - centre_m);
                o.low_m = glm::min(o.low_m, p - centre_m), o.high_m = glm::max(o.high_m, p - centre_m);
            }
            o.vertex_count = static_cast<std::uint32_t>(part.size());
            o.plane_m = glm::dot(o.normal, part[0] - centre_m);
            occluders.push_back(o);
        }
    };
    for (const Facet& facet : building.facets) {
        add(facet.vertices_m, facet.normal, false);
        if (building.faces[index(facet.face)].sheet) add(facet.vertices_m, facet.normal, true);
    }
}

/// Occluders that may stand between two blocks.
void PairwiseExchange::Data::find_candidates(const Block& from, const Block& to, std::vector<std::uint32_t>& found) const {
    found.clear();
    const dvec3 low = glm::min(from.low_m, to.low_m), high = glm::max(from.high_m, to.high_m);
    for (std::uint32_t k = 0; k < occluders.size(); ++k) {
        const Occluder& o = occluders[k];
        if (glm::any(glm::lessThan(o.high_m, low - in_plane_m)) || glm::any(glm::greaterThan(o.low_m, high + in_plane_m))) continue;
        const auto beyond = [&](const Block& block, double sign) {
            return std::ranges::all_of(block.corners_m, [&](const dvec3& c) {
                return sign * (glm::dot(o.normal, c) - o.plane_m) <= 0.5 * in_plane_m;
            });
        };
        if (beyond(from, 1.0) || beyond(to, -1.0)) continue;
        found.push_back(k);
    }
}

/// Fills s.obstacles and s.forms with what may stand between a polygon and another; true when one of them hides all.
bool PairwiseExchange::Data::collect_obstacles(std::span<const dvec3> from, std::span<const VertexQuad> to,
                                               std::span<const std::uint32_t> candidates, Scratch& s) const {
    s.obstacles.clear();
    s.forms.clear();
    for (const std::uint32_t k : candidates) {
        const Occluder& o = occluders[k];
        double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
        for (const dvec3& p : from) {
            const double h = glm::dot(o.normal, p) - o.plane_m;
            lowest = std::min(lowest, h), highest = std::max(highest, h);
        }
        if (highest <= in_plane_m) continue;
        Obstacle obstacle{.occluder = k,
                          .first_form = static_cast<std::uint32_t>(s.forms.size()),
                          .edges = o.vertex_count,
                          .all_in_front = lowest >= -in_plane_m,
                          .nx = o.normal.x,
                          .ny = o.normal.y,
                          .nz = o.normal.z,
                          .plane_m = o.plane_m};
        const dvec3* v = occluder_vertices_m.data() + o.first_vertex;
        for (std::uint32_t e = 0; e < o.vertex_count; ++e) {
            const dvec3 &a = v[e], &b = v[e + 1 < o.vertex_count ? e + 1 : 0];
            const double inverse = 1.0 / glm::distance(a, b);
            const dvec3 u = inverse * (b - a), m = inverse * glm::cross(a, b);
            for (const dvec3& p : from) {
                const dvec3 g = glm::cross(p, u) - m;
                s.forms.push_back({g.x, g.y, g.z, glm::dot(m, p)});
            }
        }
        const Passage way = passage(obstacle, s.forms.data(), from.size(), to.data(), to.size());
        if (way == Passage::blocked) return true;
        if (way == Passage::clear)
            s.forms.resize(obstacle.first_form);
        else
            s.obstacles.push_back(obstacle);
    }
    return false;
}

ExchangeEstimate PairwiseExchange::Data::past_occluders(std::size_t a, std::size_t b, bool cut_a, bool cut_b,
                                                        double unoccluded_m2, Scratch& s) const {
    Polygon pa = polygon(a), pb = polygon(b);
    if (cut_a) {
        keep_front(pa.vertices_m, pb.normal, pb.plane_m, on_plane_m, s.clipped_a);
        pa.vertices_m = s.clipped_a;
    }
    if (cut_b) {
        keep_front(pb.vertices_m, polygon(a).normal, polygon(a).plane_m, on_plane_m, s.clipped_b);
        pb.vertices_m = s.clipped_b;
    }
    if (pa.vertices_m.empty() || pb.vertices_m.empty()) return {};
    // Shadows are cut exactly, points are only sampled: so the shadows fall on the patch that the occluders are nearer to.
    const auto nearest = [&](std::size_t to) {
        double square = std::numeric_limits<double>::infinity();
        for (const std::uint32_t k : s.chosen) {
            const dvec3 aside = middle_m[to] - glm::clamp(middle_m[to], occluders[k].low_m, occluders[k].high_m);
            square = std::min(square, glm::dot(aside, aside));
        }
        return square / (radius_m[to] * radius_m[to]);
    };
    const double tolerance_m2 = tolerance * std::min(area_m2[a], area_m2[b]);
    const bool shadow_on_b = nearest(a) >= nearest(b);
    const Side side = shadow_on_b ? Side::front : Side::back;  // obstacles were chosen for lines that leave a
    const Polygon &from = shadow_on_b ? pa : pb, &to = shadow_on_b ? pb : pa;
    ExchangeEstimate sum;
    for_each_part(to.vertices_m, [&](std::span<const dvec3> part) {
        const bool whole = part.size() == to.vertices_m.size();
        const double all_m2 = whole ? unoccluded_m2 : unoccluded_exchange_m2(from.vertices_m, from.normal, part, to.normal);
        if (all_m2 <= 0.0) return;
        // The errors of the parts add to no more than what is allowed.
        const double allowed_m2 = whole ? tolerance_m2 : tolerance_m2 * std::min(1.0, all_m2 / unoccluded_m2);
        const ExchangeEstimate e =
            s.shadows.exchange(from, {part, to.normal, to.plane_m}, all_m2, allowed_m2, occluders, occluder_vertices_m, s.chosen, side);
        sum.value_m2 += e.value_m2;
        sum.error_m2 += e.error_m2;
    });
    return sum;
}

/// Exchanges of patch a with the patches [first, last) of a block: emit(b, estimate). What it finds for a pair depends on the
/// pair alone.
template <class Emit>
void PairwiseExchange::Data::exchange_with_block(std::size_t a, const Block& to, std::size_t first, std::size_t last,
                                                 std::span<const std::uint32_t> candidates, Scratch& s,
                                                 PairwiseCount& counted, const Emit& emit) const {
    const Polygon pa = polygon(a);
    const dvec3& to_normal = face_normal[to.face];
    const double to_plane = face_plane_m[to.face];
    double lowest_a = std::numeric_limits<double>::infinity(), highest_a = -lowest_a;
    for (const dvec3& v : pa.vertices_m) {
        const double h = glm::dot(to_normal, v) - to_plane;
        lowest_a = std::min(lowest_a, h), highest_a = std::max(highest_a, h);
    }
    if (highest_a <= in_plane_m) return;
    const bool cut_a = lowest_a < -in_plane_m;

    // Which are above the horizon, and by which rule.
    const std::size_t count_b = last - first;
    std::uint8_t way[patches_per_block];
    bool cut_b[patches_per_block], any = false, used[rules.size()] = {};
    double bound_m2[patches_per_block];  // error of the rule
    for (std::size_t j = 0; j < count_b; ++j) {
        const std::size_t b = first + j;
        double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
        for (const VertexQuad& q : quads_of(b)) {
            const Four h = q.x * pa.normal.x + q.y * pa.normal.y + q.z * pa.normal.z - pa.plane_m;
            for (int k = 0; k < 4; ++k) lowest = std::min(lowest, h[k]), highest = std::max(highest, h[k]);
        }
        way[j] = nothing;
        if (highest <= in_plane_m) continue;
        any = true;
        cut_b[j] = lowest < -in_plane_m;
        way[j] = by_contour;
        bound_m2[j] = 0.0;
        const std::size_t finer = std::max(shape[a], shape[b]);
        if (cut_a || cut_b[j] || finer == other) continue;
        const dvec3 d = middle_m[b] - middle_m[a];
        const double square = glm::dot(d, d), sum = radius_m[a] + radius_m[b], eta_2 = sum * sum / square;
        double power = eta_2;
        for (std::size_t r = 0; r + finer < rules.size(); ++r) {
            power *= eta_2;
            if (rules[r].error * power > rule_error) continue;
            way[j] = static_cast<std::uint8_t>(1 + r + finer);
            used[r + finer] = true;
            bound_m2[j] = rules[r].error * power * area_m2[a] * area_m2[b] / (pi * square);
            break;
        }
    }
    if (!any) return;
    if (collect_obstacles(pa.vertices_m, to.corner_quads, candidates, s)) {
        for (std::size_t j = 0; j < count_b; ++j)
            if (way[j] != nothing) ++counted.facing, ++counted.blocked;
        return;
    }
    double exchange_m2[patches_per_block], by_rule[patches_per_block];
    for (std::size_t r = 0; r < rules.size(); ++r) {
        if (!used[r]) continue;
        far_exchanges(nodes[r], count, a, pa.normal, pa.plane_m, first, count_b, to_normal, to_plane, by_rule);
        for (std::size_t j = 0; j < count_b; ++j)
            if (way[j] == 1 + r) exchange_m2[j] = by_rule[j];
    }
    for (std::size_t j = 0; j < count_b; ++j) {
        if (way[j] == nothing) continue;
        ++counted.facing;
        const std::size_t b = first + j;
        s.chosen.clear();
        bool blocked = false;
        for (const Obstacle& o : s.obstacles) {
            const Passage p = passage(o, s.forms.data(), pa.vertices_m.size(), quads.data() + first_quad[b],
                                      first_quad[b + 1] - first_quad[b]);
            if (p == Passage::partial) s.chosen.push_back(o.occluder);
            if (p == Passage::blocked) {
                blocked = true;
                break;
            }
        }
        if (blocked) {
            ++counted.blocked;
            continue;
        }
        if (way[j] == by_contour) {
            exchange_m2[j] = unoccluded_exchange_m2(pa.vertices_m, pa.normal, polygon(b).vertices_m, to_normal);
            bound_m2[j] = 1e-9 * std::min(area_m2[a], area_m2[b]);
        }
        ExchangeEstimate e{exchange_m2[j], bound_m2[j]};
        if (!s.chosen.empty()) {
            ++counted.partial;
            e = past_occluders(a, b, cut_a, cut_b[j], exchange_m2[j], s);
            e.error_m2 += bound_m2[j];
        }
        // What seems hidden has an error as well.
        if (e.value_m2 > 0.0 || e.error_m2 > 0.0) emit(b, e);
    }
}

PairwiseExchange::PairwiseExchange(const Building& building, const PatchGrid& grid, const PairwiseOptions& options) {
    auto data = std::make_unique<Data>();
    data->tolerance = options.tolerance;
    data->take_patches(building, grid);
    data->take_occluders(building);
    data_ = std::move(data);
}

PairwiseExchange::~PairwiseExchange() = default;

namespace {

/// One value of a row on its way into order.
struct Value {
    std::uint32_t patch;
    float error;
    double value;
};

/// What the values of a row leave of 1, where that is more than they may be wrong by: twice the root of the sum of the squares of
/// their errors. Less than that is the error of the method, and no leak.
class Balance {
public:
    void add(const Value& v) {
        sum_ += v.value;
        square_ += static_cast<double>(v.error) * static_cast<double>(v.error);
    }
    double lost() const {
        const double missing = 1.0 - sum_;
        return missing > 2.0 * std::sqrt(square_) ? missing : 0.0;
    }

private:
    double sum_ = 0.0, square_ = 0.0;
};

/// Into the order of patches.
void finish(std::vector<Value>& values, FormFactorRow& row) {
    std::ranges::sort(values, {}, &Value::patch);
    row.clear();
    Balance balance;
    for (const Value& v : values) {
        row.patches.push_back(make_id<PatchId>(v.patch));
        row.values.push_back(v.value);
        row.errors.push_back(v.error);
        balance.add(v);
    }
    row.lost = balance.lost();
}

}  // namespace

void PairwiseExchange::row(PatchId from, FormFactorRow& row) const {
    const Data& d = *data_;
    Scratch& s = d.scratch.local();
    PairwiseCount counted;
    const std::size_t a = d.place[index(from)];
    const Block& own = d.blocks[d.block_of[a]];
    std::vector<Value> values;
    const auto take = [&](std::size_t b, const ExchangeEstimate& e) {
        values.push_back({d.patch[b], static_cast<float>(static_cast<float>(e.error_m2) / d.area_m2[a]), e.value_m2 / d.area_m2[a]});
    };
    // A pair is computed from the patch that comes first, always.
    for (const Block& block : d.blocks) {
        if (block.face == own.face) continue;
        if (block.first > a) {
            d.find_candidates(own, block, s.in_block_pair);
            d.exchange_with_block(a, block, block.first, block.last, s.in_block_pair, s, counted, take);
        } else {
            d.find_candidates(block, own, s.in_block_pair);
            for (std::size_t b = block.first; b < block.last; ++b)
                d.exchange_with_block(b, own, a, a + 1, s.in_block_pair, s, counted,
                                      [&](std::size_t, const ExchangeEstimate& e) { take(b, e); });
        }
    }
    finish(values, row);
}

void PairwiseExchange::row(const GatherPoint& from, FormFactorRow& row) const {
    const Data& d = *data_;
    Scratch& s = d.scratch.local();
    const dvec3 point = from.position_m - d.centre_m;
    const double plane_m = glm::dot(from.normal, point);
    const std::array<dvec3, 1> eye{point};
    const Block here{.corners_m = {point}, .low_m = point, .high_m = point};
    std::vector<Value> values;
    for (const Block& block : d.blocks) {
        const dvec3& normal = d.face_normal[block.face];
        const auto below = [&](const dvec3& v) { return glm::dot(from.normal, v) - plane_m <= in_plane_m; };
        if (glm::dot(normal, point) - d.face_plane_m[block.face] <= 1e-9) continue;
        if (std::ranges::all_of(block.corners_m, below)) continue;
        d.find_candidates(here, block, s.in_block_pair);
        if (d.collect_obstacles(eye, block.corner_quads, s.in_block_pair, s)) continue;
        for (std::size_t b = block.first; b < block.last; ++b) {
            const Polygon to = d.polygon(b);
            if (std::ranges::all_of(to.vertices_m, below)) continue;
            s.chosen.clear();
            bool blocked = false;
            for (const Obstacle& o : s.obstacles) {
                const Passage p = passage(o, s.forms.data(), 1, d.quads.data() + d.first_quad[b],
                                          d.first_quad[b + 1] - d.first_quad[b]);
                if (p == Passage::partial) s.chosen.push_back(o.occluder);
                blocked = blocked || p == Passage::blocked;
            }
            if (blocked) continue;
            double value = 0.0;
            for_each_part(to.vertices_m, [&](std::span<const dvec3> part) {
                value += s.shadows.from_point(point, from.normal, {part, to.normal, to.plane_m}, d.occluders, d.occluder_vertices_m, s.chosen);
            });
            if (value > 0.0) values.push_back({d.patch[b], static_cast<float>(1e-9), value});
        }
    }
    finish(values, row);
}

FormFactorRows PairwiseExchange::rows(bool with_errors, Progress& progress, PairwiseCount* count) const {
    const Data& d = *data_;
    struct Half {  ///< exchanges of the patches of a block with those after them
        std::vector<Entry> entries;
        std::array<std::uint64_t, patches_per_block + 1> begin{};
        PairwiseCount counted;
    };
    std::vector<Half> halves(d.blocks.size());
    progress.begin("form factors", d.count);
    parallel_for(d.blocks.size(), 1, [&](std::size_t i) {
        const Block& from = d.blocks[i];
        Scratch& s = d.scratch.local();
        // Block by block, so that candidates are found once for 64 x 64 pairs; each patch keeps its own list meanwhile.
        std::array<std::vector<Entry>, patches_per_block> lists;
        for (std::size_t j = i + 1; j < d.blocks.size() && !progress.interrupted(); ++j) {
            if (d.blocks[j].face == from.face) continue;
            d.find_candidates(from, d.blocks[j], s.in_block_pair);
            for (std::size_t a = from.first; a < from.last; ++a)
                d.exchange_with_block(a, d.blocks[j], d.blocks[j].first, d.blocks[j].last, s.in_block_pair, s, halves[i].counted,
                                      [&](std::size_t b, const ExchangeEstimate& e) {
                                          lists[a - from.first].push_back(
                                              {static_cast<std::uint32_t>(b), static_cast<float>(e.error_m2), e.value_m2});
                                      });
        }
        for (std::size_t k = 0; k < from.last - from.first; ++k) halves[i].begin[k + 1] = halves[i].begin[k] + lists[k].size();
        halves[i].entries.reserve(halves[i].begin[from.last - from.first]);
        for (auto& list : lists) {
            halves[i].entries.insert(halves[i].entries.end(), list.begin(), list.end());
            std::vector<Entry>().swap(list);
        }
        progress.advance(from.last - from.first);
    });
    progress.end();
    if (progress.interrupted()) throw Interrupted();

    FormFactorRows rows;
    rows.row_begin.assign(d.count + 1, 0);
    const auto each = [&](const auto& visit) {
        for (std::size_t i = 0; i < halves.size(); ++i)
            for (std::size_t k = 0; k < d.blocks[i].last - d.blocks[i].first; ++k)
                for (std::uint64_t e = halves[i].begin[k]; e < halves[i].begin[k + 1]; ++e)
                    visit(d.blocks[i].first + k, halves[i].entries[e]);
    };
    each([&](std::size_t a, const Entry& e) {
        ++rows.row_begin[d.patch[a] + 1];
        ++rows.row_begin[d.patch[e.to] + 1];
    });
    for (std::size_t i = 0; i < d.count; ++i) rows.row_begin[i + 1] += rows.row_begin[i];
    std::vector<std::uint64_t> next(rows.row_begin.begin(), rows.row_begin.end() - 1);
    std::vector<Value> values(rows.row_begin.back());
    each([&](std::size_t a, const Entry& e) {
        const auto error = [&](std::size_t of) { return static_cast<float>(e.error / d.area_m2[of]); };
        values[next[d.patch[a]]++] = {d.patch[e.to], error(a), e.value_m2 / d.area_m2[a]};
        values[next[d.patch[e.to]]++] = {d.patch[a], error(e.to), e.value_m2 / d.area_m2[e.to]};
    });
    if (count != nullptr)
        for (const Half& half : halves) {
            count->facing += half.counted.facing;
            count->blocked += half.counted.blocked;
            count->partial += half.counted.partial;
        }
    std::vector<Half>().swap(halves);
    rows.column.resize(values.size());
    rows.value.resize(values.size());
    if (with_errors) rows.error.resize(values.size());
    rows.lost.resize(d.count);
    rows.truncated.resize(d.count);
    rows.escaped.resize(d.count);
    parallel_for(d.count, 16, [&](std::size_t i) {
        const auto own = std::span(values).subspan(rows.row_begin[i], rows.row_begin[i + 1] - rows.row_begin[i]);
        std::ranges::sort(own, {}, &Value::patch);
        Balance balance;
        for (std::size_t k = 0; k < own.size(); ++k) {
            rows.column[rows.row_begin[i] + k] = own[k].patch;
            rows.value[rows.row_begin[i] + k] = own[k].value;
            if (with_errors) rows.error[rows.row_begin[i] + k] = own[k].error;
            balance.add(own[k]);
        }
        rows.lost[i] = balance.lost();
    });
    return rows;
}

}  // namespace naturel
