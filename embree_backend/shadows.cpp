#include "embree_backend/shadows.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/units.h"

namespace naturel::pairwise {
namespace {

using glm::dvec3;

// The middle of the exact rules below is compared with their mean; a rule whose values do not differ is believed.
constexpr double gauss_2 = 0.21132486540518712;  // (1 - 1 / sqrt 3) / 2
// How much of the difference between the middle and the mean, and of the range of the values, is taken for error. Chosen so
// that rows of furnished rooms close; not calibrated against an independent integration.
constexpr double of_middle = 0.5, of_range = 0.12;
// What may lie between the points of a cell without touching one of them.
constexpr double unseen = 0.03;
constexpr int deepest = 12;
constexpr std::size_t most_cells = 4096;

/// Moves polygons into one half-plane: keeps what has a x + b y + c >= 0.
template <class Flat>
void keep(const Flat& p, double a, double b, double c, Flat& kept) {
    kept.count = 0;
    const int n = p.count;
    double h0 = a * p.x[n - 1] + b * p.y[n - 1] + c;
    for (int k = 0, before = n - 1; k < n; before = k++) {
        const double h1 = a * p.x[k] + b * p.y[k] + c;
        if ((h0 < 0.0) != (h1 < 0.0)) {
            const double t = h0 / (h0 - h1);
            kept.x[kept.count] = p.x[before] + t * (p.x[k] - p.x[before]);
            kept.y[kept.count++] = p.y[before] + t * (p.y[k] - p.y[before]);
        }
        if (h1 >= 0.0) {
            kept.x[kept.count] = p.x[k];
            kept.y[kept.count++] = p.y[k];
        }
        h0 = h1;
    }
    if (kept.count < 3) kept.count = 0;
}

}  // namespace

void Shadows::aim(const Polygon& to, const dvec3& normal, std::span<const Occluder> occluders,
                  std::span<const dvec3> occluder_vertices_m, std::span<const std::uint32_t> chosen, Side side) {
    const auto& v = to.vertices_m;
    origin_m_ = v[0];
    n_ = to.normal;
    dvec3 longest = v[1] - v[0];
    for (std::size_t k = 1; k + 1 < v.size(); ++k)
        if (glm::length(v[k + 1] - v[k]) > glm::length(longest)) longest = v[k + 1] - v[k];
    u_ = glm::normalize(longest);
    v_ = glm::cross(n_, u_);
    target_.count = static_cast<int>(v.size());
    for (std::size_t k = 0; k < v.size(); ++k) {
        target_.x[k] = glm::dot(v[k] - origin_m_, u_);
        target_.y[k] = glm::dot(v[k] - origin_m_, v_);
    }
    const auto flat = [&](const dvec3& d) { return dvec3(glm::dot(d, u_), glm::dot(d, v_), glm::dot(d, n_)); };
    const dvec3 receiving = flat(normal);
    nx_ = receiving.x, ny_ = receiving.y, nz_ = receiving.z;
    blockers_.clear();
    for (const std::uint32_t c : chosen) {
        const Occluder& o = occluders[c];
        Flattened& f = blockers_.emplace_back();
        f.count = static_cast<int>(o.vertex_count);
        for (std::uint32_t k = 0; k < o.vertex_count; ++k) {
            const dvec3 p = flat(occluder_vertices_m[o.first_vertex + k] - origin_m_);
            f.x[k] = p.x, f.y[k] = p.y, f.z[k] = p.z;
        }
        const double sign = side == Side::front ? 1.0 : -1.0;
        const dvec3 n = sign * flat(o.normal);
        f.nx = n.x, f.ny = n.y, f.nz = n.z;
        f.plane = sign * (o.plane_m - glm::dot(o.normal, origin_m_));
    }
}

/// Nusselt's projected solid angle / pi of a polygon in the plane z = 0 seen from (px, py, pz), by Lambert's sum over the edges
/// of angle times normal of the plane through the eye.
double Shadows::lambert(const Flat& piece, double px, double py, double pz) const {
    double sum = 0.0;
    const int n = piece.count;
    double ax = piece.x[n - 1] - px, ay = piece.y[n - 1] - py;
    for (int k = 0; k < n; ++k) {
        const double bx = piece.x[k] - px, by = piece.y[k] - py;
        // cross((ax, ay, -pz), (bx, by, -pz))
        const double cx = pz * (by - ay), cy = pz * (ax - bx), cz = ax * by - ay * bx;
        const double sine_2 = cx * cx + cy * cy + cz * cz;
        if (sine_2 > 0.0) {
            const double sine = std::sqrt(sine_2);
            const double cosine = ax * bx + ay * by + pz * pz;
            sum += (nx_ * cx + ny_ * cy + nz_ * cz) * (std::atan2(sine, cosine) / sine);
        }
        ax = bx, ay = by;
    }
    return std::abs(sum) / (2.0 * pi);
}

/// Takes a convex shadow out of all pieces: what lies outside its first edge is a piece, of the rest what lies outside the
/// second one, and so on.
void Shadows::subtract(const Flat& shadow) {
    next_.clear();
    double low_x = shadow.x[0], high_x = low_x, low_y = shadow.y[0], high_y = low_y;
    for (int k = 1; k < shadow.count; ++k) {
        low_x = std::min(low_x, shadow.x[k]), high_x = std::max(high_x, shadow.x[k]);
        low_y = std::min(low_y, shadow.y[k]), high_y = std::max(high_y, shadow.y[k]);
    }
    double turn = 0.0;
    for (int k = 2; k < shadow.count; ++k)
        turn += (shadow.x[k - 1] - shadow.x[0]) * (shadow.y[k] - shadow.y[0]) -
                (shadow.y[k - 1] - shadow.y[0]) * (shadow.x[k] - shadow.x[0]);
    if (std::abs(turn) < 1e-14) return;  // a line
    const double sense = turn >= 0.0 ? 1.0 : -1.0;
    Flat rest, outside, inside;
    for (const Flat& piece : pieces_) {
        double px0 = piece.x[0], px1 = px0, py0 = piece.y[0], py1 = py0;
        for (int k = 1; k < piece.count; ++k) {
            px0 = std::min(px0, piece.x[k]), px1 = std::max(px1, piece.x[k]);
            py0 = std::min(py0, piece.y[k]), py1 = std::max(py1, piece.y[k]);
        }
        if (px1 <= low_x || px0 >= high_x || py1 <= low_y || py0 >= high_y) {
            next_.push_back(piece);
            continue;
        }
        const std::size_t before = next_.size();
        rest = piece;
        for (int k = 0; k < shadow.count && rest.count > 0; ++k) {
            const int to = k + 1 < shadow.count ? k + 1 : 0;
            const double a = -sense * (shadow.y[to] - shadow.y[k]), b = sense * (shadow.x[to] - shadow.x[k]);
            if (a * a + b * b < 1e-24) continue;
            const double c = -a * shadow.x[k] - b * shadow.y[k];
            keep(rest, -a, -b, -c, outside);
            if (outside.count > 0) next_.push_back(outside);
            keep(rest, a, b, c, inside);
            rest = inside;
        }
        if (rest.count == 0) {  // not touched after all: keep it in one piece
            next_.resize(before);
            next_.push_back(piece);
        }
    }
    pieces_.swap(next_);
}

/// Form factor from a point to what it sees of the target; `all`: to the whole target.
double Shadows::seen_from(const dvec3& point_m, double& all) {
    const dvec3 d = point_m - origin_m_;
    const double px = glm::dot(d, u_), py = glm::dot(d, v_), pz = glm::dot(d, n_);
    all = 0.0;
    if (pz <= 0.0) return 0.0;
    pieces_.assign(1, target_);
    // Above the horizon of the receiving side.
    if (const double c = -(nx_ * px + ny_ * py + nz_ * pz); true) {
        bool below = false;
        for (int k = 0; k < target_.count; ++k)
            below = below || nx_ * target_.x[k] + ny_ * target_.y[k] + c < -1e-12;
        if (below) {
            keep(target_, nx_, ny_, c, pieces_[0]);
            if (pieces_[0].count == 0) return 0.0;
        }
    }
    all = lambert(pieces_[0], px, py, pz);
    // What touches the target's plane along a line casts no shadow of its own on it: geometry is rounded to 1 nm.
    constexpr double bottom = 1e-8;
    const double top = pz * (1.0 - 1e-9);
    if (top <= bottom) return all;
    bool cut = false;
    for (const Flattened& o : blockers_) {
        if (o.nx * px + o.ny * py + o.nz * pz - o.plane <= in_plane_m) continue;  // the wrong side, or edge-on
        // The part of the occluder between the point and the target's plane, cast on the plane.
        double x[2 * most_vertices], y[2 * most_vertices], z[2 * most_vertices];
        int n = 0;
        for (int k = 0, before = o.count - 1; k < o.count; before = k++) {
            for (const double level : {o.z[before] < o.z[k] ? bottom : top, o.z[before] < o.z[k] ? top : bottom})
                if ((o.z[before] < level) != (o.z[k] < level)) {
                    const double t = (level - o.z[before]) / (o.z[k] - o.z[before]);
                    x[n] = o.x[before] + t * (o.x[k] - o.x[before]);
                    y[n] = o.y[before] + t * (o.y[k] - o.y[before]);
                    z[n++] = level;
                }
            if (o.z[k] >= bottom && o.z[k] <= top) x[n] = o.x[k], y[n] = o.y[k], z[n++] = o.z[k];
        }
        if (n < 3) continue;
        Flat shadow;
        shadow.count = n;
        for (int k = 0; k < n; ++k) {
            const double far = pz / std::max(pz - z[k], 1e-9 * pz);
            shadow.x[k] = px + far * (x[k] - px);
            shadow.y[k] = py + far * (y[k] - py);
        }
        subtract(shadow);
        cut = true;
        if (pieces_.empty()) return 0.0;
    }
    if (!cut) return all;
    double sum = 0.0;
    for (const Flat& piece : pieces_) sum += lambert(piece, px, py, pz);
    return std::min(sum, all);
}

void Shadows::evaluate(Cell& cell) {
    const double area = glm::length(glm::cross(cell.u_m, cell.v_m)) * (cell.triangle ? 0.5 : 1.0);
    double lowest = 1.0, highest = 0.0;
    const auto at = [&](double s, double t, double& all) {
        const double visible = seen_from(cell.origin_m + s * cell.u_m + t * cell.v_m, all);
        if (all > 0.0) {
            const double share = visible / all;
            lowest = std::min(lowest, share), highest = std::max(highest, share);
        }
        return visible;
    };
    double sum = 0.0, sum_all = 0.0, all = 0.0, middle = 0.0;
    if (cell.triangle) {
        constexpr double places[3][2] = {{1.0 / 6, 1.0 / 6}, {2.0 / 3, 1.0 / 6}, {1.0 / 6, 2.0 / 3}};  // degree 2
        for (const auto& [s, t] : places) {
            sum += at(s, t, all) / 3;
            sum_all += all / 3;
        }
        middle = at(1.0 / 3, 1.0 / 3, all);
    } else {
        for (const double s : {gauss_2, 1.0 - gauss_2})
            for (const double t : {gauss_2, 1.0 - gauss_2}) {
                sum += at(s, t, all) / 4;
                sum_all += all / 4;
            }
        middle = at(0.5, 0.5, all);
    }
    const double middle_share = all > 0.0 ? middle / all : 0.0;
    const double mean_share = sum_all > 0.0 ? sum / sum_all : 0.0;
    if (highest - lowest < 1e-3) {
        // All alike inside: the corners see what begins at the outline. For one convex solid they decide exactly.
        for (const auto& [s, t] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}})
            if (!cell.triangle || s + t < 1.5) {
                // A hair inside, off the edges of what touches the outline.
                const double centre = cell.triangle ? 1.0 / 3 : 0.5;
                at(s + 1e-6 * (centre - s), t + 1e-6 * (centre - t), all);
            }
    }
    cell.visible = sum * area;
    cell.all = sum_all * area;
    cell.error = cell.all * (of_middle * std::abs(middle_share - mean_share) + of_range * (highest - lowest) + unseen * std::exp2(-2.0 * cell.depth));
}

ExchangeEstimate Shadows::exchange(const Polygon& from, const Polygon& to, double unoccluded_m2, double tolerance_m2,
                                   std::span<const Occluder> occluders, std::span<const dvec3> occluder_vertices_m,
                                   std::span<const std::uint32_t> chosen, Side side) {
    aim(to, from.normal, occluders, occluder_vertices_m, chosen, side);
    cells_.clear();
    const auto& v = from.vertices_m;
    if (v.size() == 4 && glm::length(v[0] + v[2] - v[1] - v[3]) < 1e-8)
        cells_.push_back({.origin_m = v[0], .u_m = v[1] - v[0], .v_m = v[3] - v[0]});
    else
        for (std::size_t k = 1; k + 1 < v.size(); ++k)
            cells_.push_back({.origin_m = v[0], .u_m = v[k] - v[0], .v_m = v[k + 1] - v[0], .triangle = true});
    double visible = 0.0, all = 0.0, error_2 = 0.0;
    for (Cell& cell : cells_) evaluate(cell);
    const auto worse = [](const Cell& a, const Cell& b) { return a.error < b.error; };
    std::ranges::make_heap(cells_, worse);
    const auto sum_up = [&] {
        visible = all = error_2 = 0.0;
        for (const Cell& cell : cells_) {
            visible += cell.visible;
            all += cell.all;
            error_2 += cell.error * cell.error;
        }
    };
    sum_up();
    // Errors of neighbouring cells are as often of one sign as of the other.
    double running = error_2;
    while (running > tolerance_m2 * tolerance_m2 && cells_.size() < most_cells && cells_.front().depth < deepest) {
        std::ranges::pop_heap(cells_, worse);
        const Cell parent = cells_.back();
        cells_.pop_back();
        running -= parent.error * parent.error;
        const dvec3 u = 0.5 * parent.u_m, w = 0.5 * parent.v_m;
        Cell children[4];
        for (Cell& c : children) c.triangle = parent.triangle, c.depth = parent.depth + 1, c.u_m = u, c.v_m = w;
        children[0].origin_m = parent.origin_m;
        children[1].origin_m = parent.origin_m + u;
        children[2].origin_m = parent.origin_m + w;
        children[3].origin_m = parent.origin_m + u + w;
        if (parent.triangle) children[3].u_m = -u, children[3].v_m = -w;
        for (Cell& c : children) {
            evaluate(c);
            running += c.error * c.error;
            cells_.push_back(c);
            std::ranges::push_heap(cells_, worse);
        }
    }
    sum_up();
    if (all <= 0.0) return {0.0, 0.0};
    return {unoccluded_m2 * (visible / all), unoccluded_m2 / all * std::sqrt(error_2)};
}

double Shadows::from_point(const dvec3& point_m, const dvec3& normal, const Polygon& to, std::span<const Occluder> occluders,
                           std::span<const dvec3> occluder_vertices_m, std::span<const std::uint32_t> chosen) {
    aim(to, normal, occluders, occluder_vertices_m, chosen, Side::front);
    double all = 0.0;
    return seen_from(point_m, all);
}

}  // namespace naturel::pairwise
