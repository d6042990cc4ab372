#include "tests/reference/occluded_form_factor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <stdexcept>
#include <tuple>

#include "tests/reference/exact_form_factors.h"

namespace naturel::reference {
namespace {

using glm::dvec3;
using Ring = std::vector<dvec3>;

/// What is nearer to a plane than this lies in it: geometry is rounded to 1 nm.
constexpr double in_plane_m = 1e-7;

dvec3 unit_normal(std::span<const dvec3> ring) {
    dvec3 area{};
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) area += glm::cross(ring[k] - ring[0], ring[k + 1] - ring[0]);
    return glm::normalize(area);
}

/// The part of a ring with sign x height >= 0; heights: [ring].
Ring part(const Ring& ring, std::span<const double> height, double sign) {
    Ring kept;
    for (std::size_t k = 0; k < ring.size(); ++k) {
        const std::size_t next = k + 1 < ring.size() ? k + 1 : 0;
        const double h0 = sign * height[k], h1 = sign * height[next];
        if (h0 >= 0.0) kept.push_back(ring[k]);
        if ((h0 < 0.0) != (h1 < 0.0) && h0 != 0.0 && h1 != 0.0) kept.push_back(ring[k] + h0 / (h0 - h1) * (ring[next] - ring[k]));
    }
    if (kept.size() < 3) kept.clear();
    return kept;
}

Ring above(std::span<const dvec3> ring, const dvec3& point, const dvec3& normal) {
    const Ring all(ring.begin(), ring.end());
    std::vector<double> height;
    for (const dvec3& v : ring) {
        const double h = glm::dot(v - point, normal);
        height.push_back(std::abs(h) < 1e-9 ? 0.0 : h);
    }
    return part(all, height, 1.0);
}

struct Blocker {
    Ring ring;
    dvec3 normal{};
};

/// A half-space normal . x >= offset.
struct HalfSpace {
    dvec3 normal{};
    double offset = 0.0;
};

/// A convex polygon of few corners, without memory of its own.
struct Piece {
    std::size_t count = 0;
    std::array<dvec3, 24> corner{};
};

/// Takes the shadow of a blocker, an intersection of half-spaces, out of a piece: what is outside the first of them is a new piece, of
/// the rest what is outside the second, and so on.
void cut(const Piece& piece, std::span<const HalfSpace> shadow, std::vector<Piece>& left) {
    std::array<double, 24> height{};
    const auto measure = [&](const Piece& p, const HalfSpace& h) {
        bool in = false, out = false;
        for (std::size_t k = 0; k < p.count; ++k) {
            const double d = glm::dot(p.corner[k], h.normal) - h.offset;
            height[k] = std::abs(d) < 1e-11 ? 0.0 : d;  // faces of a solid share edges
            in = in || height[k] > 0.0, out = out || height[k] < 0.0;
        }
        return std::pair(in, out);
    };
    const auto keep = [&](const Piece& p, double sign) {
        Piece kept;
        for (std::size_t k = 0; k < p.count; ++k) {
            const std::size_t next = k + 1 < p.count ? k + 1 : 0;
            const double h0 = sign * height[k], h1 = sign * height[next];
            if (h0 >= 0.0) kept.corner[kept.count++] = p.corner[k];
            if ((h0 > 0.0 && h1 < 0.0) || (h0 < 0.0 && h1 > 0.0))
                kept.corner[kept.count++] = p.corner[k] + h0 / (h0 - h1) * (p.corner[next] - p.corner[k]);
        }
        if (kept.count < 3) kept.count = 0;
        return kept;
    };
    for (const HalfSpace& h : shadow)
        if (!measure(piece, h).first) return left.push_back(piece);
    Piece inside = piece;
    const std::size_t before = left.size();
    for (const HalfSpace& h : shadow) {
        const auto [in, out] = measure(inside, h);
        if (!in) {  // what is left of it, and so not touched at all
            left.resize(before);
            return left.push_back(piece);
        }
        if (!out) continue;
        if (const Piece outside = keep(inside, -1.0); outside.count > 0) left.push_back(outside);
        inside = keep(inside, 1.0);
    }
}

double seen(const dvec3& eye, const dvec3& normal, const Ring& receiver, std::span<const Blocker> blockers) {
    std::vector<Piece> pieces(1), left;
    // The cuts of a shadow add corners.
    if (receiver.size() > pieces[0].corner.size() / 2) throw std::length_error("a receiver of too many corners");
    for (const dvec3& v : receiver) pieces[0].corner[pieces[0].count++] = v;
    std::vector<HalfSpace> shadow;
    for (const Blocker& b : blockers) {
        if (glm::dot(b.normal, eye - b.ring[0]) < 1e-12) continue;  // from behind, or edge-on
        // Beyond the plane of the blocker, and inside the planes through the eye and its edges.
        shadow.assign(1, {-b.normal, -glm::dot(b.normal, b.ring[0])});
        for (std::size_t e = 0; e < b.ring.size(); ++e) {
            const dvec3 across = -glm::cross(b.ring[e] - eye, b.ring[(e + 1) % b.ring.size()] - eye);
            const double length = glm::length(across);
            if (length > 1e-15) shadow.push_back({across / length, glm::dot(across / length, eye)});
        }
        left.clear();
        for (const Piece& piece : pieces) cut(piece, shadow, left);
        pieces.swap(left);
        if (pieces.empty()) return 0.0;
    }
    double sum = 0.0;
    for (const Piece& piece : pieces) sum += point_to_polygon(eye, normal, std::span(piece.corner).first(piece.count));
    return sum;
}

/// Gauss and Kronrod's nodes and weights on (-1, 1), from the outside to the middle (Piessens et al. 1983, QUADPACK; the small one
/// by Kronrod 1965).
template <std::size_t half>
struct Rule {
    std::array<double, half> node, kronrod;
    std::array<double, half / 2> gauss;
};
constexpr Rule<8> rule_15{{0.991455371120812639206854697526329, 0.949107912342758524526189684047851, 0.864864423359769072789712788640926,
                           0.741531185599394439863864773280788, 0.586087235467691130294144691693013, 0.405845151377397166906606412076961,
                           0.207784955007898467600689403773245, 0.0},
                          {0.022935322010529224963732008058970, 0.063092092629978553290700663189204, 0.104790010322250183839876322541518,
                           0.140653259715525918745189590510238, 0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
                           0.204432940075298892414161999234649, 0.209482141084727828012999174891714},
                          {0.129484966168869693270611432679082, 0.279705391489276667901467771423780, 0.381830050505118944950369775488975,
                           0.417959183673469387755102040816327}};
constexpr Rule<4> rule_7{{0.960491268708020283423507092629080, 0.774596669241483377035853079956480, 0.434243749346802558002071502844628, 0.0},
                         {0.104656226026467265193823857192073, 0.268488089868333440728569280666710, 0.401397414775962222905051818618432,
                          0.450916538658474142345110087045571},
                         {0.555555555555555555555555555555556, 0.888888888888888888888888888888889}};

struct Sum {
    double value = 0.0, error = 0.0;
};

/// Integral of f over (low, high) until the error is below `tolerance`, or the interval is halved `deepest` times.
template <std::size_t half_count, class Function>
Sum integrate(const Rule<half_count>& rule, const Function& f, double low, double high, double tolerance, int deepest) {
    constexpr std::size_t last = 2 * half_count - 2;
    const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
    std::array<double, last + 1> value{};
    for (std::size_t k = 0; k < half_count; ++k) {
        value[k] = f(middle - half * rule.node[k]);
        value[last - k] = k + 1 == half_count ? value[k] : f(middle + half * rule.node[k]);
    }
    double fine = 0.0, coarse = 0.0;
    for (std::size_t k = 0; k < half_count; ++k) {
        const double both = k + 1 == half_count ? value[k] : value[k] + value[last - k];
        fine += rule.kronrod[k] * both;
        if (k % 2 == 1) coarse += rule.gauss[k / 2] * both;
    }
    double spread = 0.0;
    for (std::size_t k = 0; k <= last; ++k) spread += rule.kronrod[std::min(k, last - k)] * std::abs(value[k] - 0.5 * fine);
    // QUADPACK's estimate: Kronrod's rule is far better than the difference where that is small.
    double error = std::abs(fine - coarse);
    if (spread > 0.0 && error > 0.0) error = std::min(error, spread * std::pow(200.0 * error / spread, 1.5));
    if (half * error <= tolerance || deepest == 0) return {half * fine, half * error};
    // Errors of parts add up like their squares.
    constexpr double share = 0.7;
    const Sum left = integrate(rule, f, low, middle, share * tolerance, deepest - 1);
    const Sum right = integrate(rule, f, middle, high, share * tolerance, deepest - 1);
    return {left.value + right.value, left.error + right.error};
}

struct Edge {
    dvec3 a{}, b{};
};

/// Whether a point of the plane of a ring is in it or within a hair of it.
bool within(const Ring& ring, const dvec3& normal, const dvec3& point) {
    for (std::size_t k = 0; k < ring.size(); ++k) {
        const dvec3 side = ring[(k + 1) % ring.size()] - ring[k];
        if (glm::dot(normal, glm::cross(side, point - ring[k])) < -1e-9 * glm::dot(side, side)) return false;
    }
    return true;
}

}  // namespace

double occluded_form_factor(const dvec3& point, const dvec3& normal, std::span<const dvec3> to,
                            std::span<const std::vector<dvec3>> occluders) {
    const Ring receiver = above(to, point, normal);
    if (receiver.empty() || glm::dot(unit_normal(to), point - to[0]) <= 0.0) return 0.0;
    std::vector<Blocker> blockers;
    for (const auto& ring : occluders) blockers.push_back({ring, unit_normal(ring)});
    return seen(point, normal, receiver, blockers);
}

OccludedFormFactor occluded_form_factor(std::span<const dvec3> from, std::span<const dvec3> to,
                                        std::span<const std::vector<dvec3>> occluders, double tolerance) {
    const dvec3 normal = unit_normal(from), to_normal = unit_normal(to);
    const Ring emitter = above(from, to[0], to_normal), receiver = above(to, from[0], normal);
    if (emitter.empty() || receiver.empty()) return {};
    const auto highest = [](const Ring& ring, const dvec3& point, const dvec3& axis) {
        double h = -1e300;
        for (const dvec3& v : ring) h = std::max(h, glm::dot(v - point, axis));
        return h;
    };
    if (highest(emitter, to[0], to_normal) < in_plane_m || highest(receiver, from[0], normal) < in_plane_m) return {};
    // Blockers with a part between the planes of both, and in the box around both.
    dvec3 low = emitter[0], high = low;
    for (const Ring* ring : {&emitter, &receiver})
        for (const dvec3& v : *ring) low = glm::min(low, v), high = glm::max(high, v);
    std::vector<Blocker> blockers;
    for (const Ring& ring : occluders) {
        dvec3 ring_low = ring[0], ring_high = ring[0];
        for (const dvec3& v : ring) ring_low = glm::min(ring_low, v), ring_high = glm::max(ring_high, v);
        if (glm::any(glm::greaterThan(ring_low, high)) || glm::any(glm::lessThan(ring_high, low))) continue;
        if (highest(ring, from[0], normal) > in_plane_m && highest(ring, to[0], to_normal) > in_plane_m)
            blockers.push_back({ring, unit_normal(ring)});
    }

    // Coordinates on the emitter: s along its longest side, t across.
    dvec3 axis_s{};
    double area_m2 = 0.0;
    for (std::size_t k = 0; k < from.size(); ++k) {
        const dvec3 side = from[(k + 1) % from.size()] - from[k];
        if (glm::length(side) > glm::length(axis_s)) axis_s = side;
        area_m2 += 0.5 * glm::dot(normal, glm::cross(from[k] - from[0], from[(k + 1) % from.size()] - from[0]));
    }
    axis_s = glm::normalize(axis_s);
    const dvec3 axis_t = glm::cross(normal, axis_s);
    std::vector<double> corners;
    for (const dvec3& v : emitter) corners.push_back(glm::dot(v - from[0], axis_s));
    std::ranges::sort(corners);

    // Edges and corners that may be passed in one line.
    const auto edges_of = [](const Ring& ring, std::vector<Edge>& edges) {
        for (std::size_t k = 0; k < ring.size(); ++k) edges.push_back({ring[k], ring[(k + 1) % ring.size()]});
    };
    std::vector<Edge> edges;
    edges_of(receiver, edges);
    Ring vertices = receiver;
    for (const Blocker& b : blockers) {
        edges_of(b.ring, edges);
        vertices.insert(vertices.end(), b.ring.begin(), b.ring.end());
    }
    // Faces of a solid share edges and corners.
    const auto less = [](const dvec3& a, const dvec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
    std::ranges::sort(vertices, less);
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    for (Edge& e : edges)
        if (less(e.b, e.a)) std::swap(e.a, e.b);
    std::ranges::sort(edges, [&](const Edge& e, const Edge& f) { return less(e.a, f.a) || (e.a == f.a && less(e.b, f.b)); });
    edges.erase(std::unique(edges.begin(), edges.end(), [](const Edge& e, const Edge& f) { return e.a == f.a && e.b == f.b; }), edges.end());

    struct Plane {
        dvec3 normal{}, vertex{};
        Edge edge{};
        double along_t = 0.0;
    };
    std::vector<Plane> planes;
    for (const Edge& e : edges)
        for (const dvec3& v : vertices) {
            if (v == e.a || v == e.b) continue;
            Plane p{glm::cross(e.a - v, e.b - v), v, e};
            const double length = glm::length(p.normal);
            if (length < 1e-12) continue;
            p.normal /= length;
            p.along_t = glm::dot(p.normal, axis_t);
            if (std::abs(p.along_t) > 1e-12) planes.push_back(p);
        }

    const auto over_line = [&](double s, double line_tolerance, double& error, bool past_blockers) {
        const dvec3 base = from[0] + s * axis_s;
        double low = 1e300, high = -1e300;
        for (std::size_t k = 0; k < emitter.size(); ++k) {
            const dvec3 &a = emitter[k], &b = emitter[(k + 1) % emitter.size()];
            const double sa = glm::dot(a - base, axis_s), sb = glm::dot(b - base, axis_s);
            if ((sa < 0.0) == (sb < 0.0)) continue;
            const double t = glm::dot(a + sa / (sa - sb) * (b - a) - base, axis_t);
            low = std::min(low, t), high = std::max(high, t);
        }
        if (!(high > low)) return 0.0;
        std::vector<double> splits{low, high};
        for (const Plane& p : planes) {
            if (!past_blockers) break;
            const double t = glm::dot(p.vertex - base, p.normal) / p.along_t;
            if (t <= low || t >= high) continue;
            // In the plane of the emitter's point, edge and corner: does the ray through the corner meet the edge?
            const dvec3 eye = base + t * axis_t, ray = p.vertex - eye;
            const dvec3 ea = glm::cross(p.edge.a - eye, ray), eb = glm::cross(p.edge.b - eye, ray);
            const double slack = 1e-9 * (glm::dot(ea, ea) + glm::dot(eb, eb));
            if (glm::dot(ea, eb) > slack) continue;  // both ends on one side
            // And does it meet the receiver?
            const double to_plane = glm::dot(receiver[0] - eye, to_normal) / glm::dot(ray, to_normal);
            if (!(to_plane > 0.0) || !within(receiver, to_normal, eye + to_plane * ray)) continue;
            splits.push_back(t);
        }
        std::ranges::sort(splits);
        const std::span<const Blocker> used = past_blockers ? std::span<const Blocker>(blockers) : std::span<const Blocker>();
        double sum = 0.0;
        for (std::size_t k = 0; k + 1 < splits.size(); ++k) {
            const double length = splits[k + 1] - splits[k];
            if (length < 1e-10 * (high - low)) continue;
            const Sum part_sum = integrate(rule_7, [&](double t) { return seen(base + t * axis_t, normal, receiver, used); }, splits[k],
                                           splits[k + 1], line_tolerance * std::sqrt(length / (high - low)), 8);
            sum += part_sum.value;
            error = std::max(error, part_sum.error);
        }
        return sum;
    };
    const double width = corners.back() - corners.front();
    OccludedFormFactor result;
    for (const bool past_blockers : {false, true}) {
        Sum all;
        double inner = 0.0;
        for (std::size_t k = 0; k + 1 < corners.size(); ++k) {
            const double length = corners[k + 1] - corners[k];
            if (length < 1e-12 * width) continue;
            const Sum one = integrate(rule_15, [&](double s) { return over_line(s, 0.02 * tolerance * area_m2 / width, inner, past_blockers); },
                                      corners[k], corners[k + 1], tolerance * area_m2 * length / width, 5);
            all.value += one.value, all.error += one.error;
        }
        if (past_blockers) {
            result.value = all.value / area_m2;
            result.error = (all.error + inner * width) / area_m2;
        } else {
            result.unoccluded = all.value / area_m2;
            if (blockers.empty()) {
                result.value = result.unoccluded, result.error = all.error / area_m2;
                break;
            }
        }
    }
    return result;
}

}  // namespace naturel::reference
