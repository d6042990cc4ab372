#include "embree_backend/shadows.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/errors.h"
#include "core/units.h"

namespace naturel::pairwise {
namespace {

using glm::dvec3;

constexpr double gauss_2 = 0.21132486540518712;  // (1 - 1 / sqrt 3) / 2
// The share of a cell that is seen is a mean of three rules: Gauss's points, the middle and the corners. Middle and corners
// together are exact for polynomials of degree 2, as Gauss's points are. Of 52 000 partly visible pairs in three furnished rooms
// the RMS error was 0.0115 with 0.6 for Gauss's points, 0.026 with them alone.
constexpr double of_gauss = 0.6, of_middle = 0.4 * 2 / 3, of_corners = 0.4 / 3;
constexpr double of_centroid = 0.4 * 3 / 4, of_vertices = 0.4 / 4;  // on triangles
// What is taken for the error of the mean: so much of the spread of the three rules, of the range of the values, and of all,
// for what lies between the points without touching one. Of the combinations with an error below the estimate in 99 % of
// those pairs this had the lowest mean estimate; 1.2 times that, for scenes of another kind, and ten times as much for what lies
// between: past oblique solids one sees through narrow gaps (docs/embree.md, "Pairwise").
constexpr double of_spread = 0.18, of_range = 0.03, unseen = 0.02;
// Where a corner of the cell comes close to the target the form factor rises steeply and would give that corner all the weight.
// There Gauss's points stand alone, with a greater share for error, found in the same way.
constexpr double steep = 1.5, of_spread_alone = 0.24, of_range_alone = 0.12, unseen_alone = 0.04;
// They also do where that error is a small part of what is allowed.
constexpr double enough = 0.25;
// How much of a wrong weight of one part of the cell against another goes wrong in the mean.
constexpr double of_weight = 0.3;
constexpr int deepest = 12;
constexpr std::size_t most_cells = 4096;

/// asin(sqrt(x)) / sqrt(x): its series to x^9, within 1e-12 for x < 0.06.
double arc_over_sine(double x) {
    constexpr double c[] = {1.0, 1.0 / 6, 3.0 / 40, 15.0 / 336, 105.0 / 3456, 945.0 / 42240, 10395.0 / 599040, 135135.0 / 9676800,
                            2027025.0 / 175472640, 34459425.0 / 3530096640};
    double sum = c[9];
    for (int k = 8; k >= 0; --k) sum = sum * x + c[k];
    return sum;
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
        const double cosine = ax * bx + ay * by + pz * pz, all_2 = sine_2 + cosine * cosine;
        const double across = nx_ * cx + ny_ * cy + nz_ * cz;
        if (sine_2 < 0.06 * all_2 && cosine > 0.0) {  // short edges
            sum += across * arc_over_sine(sine_2 / all_2) / std::sqrt(all_2);
        } else if (sine_2 > 0.0) {
            const double sine = std::sqrt(sine_2);
            sum += across * (std::atan2(sine, cosine) / sine);
        }
        ax = bx, ay = by;
    }
    return std::abs(sum) / (2.0 * pi);
}

/// The part of a polygon with sign x height >= 0.
void Shadows::keep(const Flat& p, const double* height, double sign, Flat& kept) {
    int n = 0;
    double h0 = sign * height[p.count - 1];
    for (int k = 0, before = p.count - 1; k < p.count; before = k++) {
        const double h1 = sign * height[k];
        if ((h0 < 0.0) != (h1 < 0.0)) {
            const double t = h0 / (h0 - h1);
            kept.x[n] = p.x[before] + t * (p.x[k] - p.x[before]);
            kept.y[n++] = p.y[before] + t * (p.y[k] - p.y[before]);
        }
        if (h1 >= 0.0) kept.x[n] = p.x[k], kept.y[n++] = p.y[k];
        h0 = h1;
    }
    kept.count = n < 3 ? 0 : n;
}

/// Takes a convex shadow out of all pieces: what lies outside its first edge is a piece, of the rest what lies outside the
/// second one, and so on.
void Shadows::subtract(const Shade& shade) {
    next_.clear();
    double height[most_corners];
    Flat rest, inside;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
        if (pieces_[i].count > most_corners / 2) {
            // An edge adds a corner at most: two parts have room for more.
            Flat part;
            const int half = pieces_[i].count / 2;
            part.count = half + 1;
            std::copy_n(pieces_[i].x, half + 1, part.x);
            std::copy_n(pieces_[i].y, half + 1, part.y);
            std::copy(pieces_[i].x + half, pieces_[i].x + pieces_[i].count, pieces_[i].x + 1);
            std::copy(pieces_[i].y + half, pieces_[i].y + pieces_[i].count, pieces_[i].y + 1);
            pieces_[i].count -= half - 1;
            pieces_.push_back(part);
        }
        const Flat& piece = pieces_[i];
        const auto measure = [&](const Flat& p, int e) {
            double low = 0.0, high = 0.0;
            for (int k = 0; k < p.count; ++k) {
                height[k] = shade.a[e] * p.x[k] + shade.b[e] * p.y[k] + shade.c[e];
                low = std::min(low, height[k]), high = std::max(high, height[k]);
            }
            return std::pair(low < 0.0, high > 0.0);
        };
        int cutting[2 * most_vertices], cuts = 0;
        bool apart = false;
        for (int e = 0; e < shade.edges && !apart; ++e) {
            const auto [out, in] = measure(piece, e);
            apart = !in;
            if (out) cutting[cuts++] = e;
        }
        if (apart) {
            next_.push_back(piece);
            continue;
        }
        const std::size_t before = next_.size();
        rest = piece;
        for (int c = 0; c < cuts && rest.count > 0; ++c) {
            const auto [out, in] = measure(rest, cutting[c]);
            if (!out) continue;
            if (!in) {
                rest.count = 0;
                break;
            }
            keep(rest, height, -1.0, next_.emplace_back());
            if (next_.back().count == 0) next_.pop_back();
            keep(rest, height, 1.0, inside);
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
        double height[most_corners];
        for (int k = 0; k < target_.count; ++k) {
            height[k] = nx_ * target_.x[k] + ny_ * target_.y[k] + c;
            below = below || height[k] < -1e-12;
        }
        if (below) {
            keep(target_, height, 1.0, pieces_[0]);
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
        for (int k = 0; k < n; ++k) {
            const double far = pz / std::max(pz - z[k], 1e-9 * pz);
            x[k] = px + far * (x[k] - px);
            y[k] = py + far * (y[k] - py);
        }
        double turn = 0.0;
        for (int k = 2; k < n; ++k) turn += (x[k - 1] - x[0]) * (y[k] - y[0]) - (y[k - 1] - y[0]) * (x[k] - x[0]);
        if (std::abs(turn) < 1e-14) continue;  // a line
        const double sense = turn >= 0.0 ? 1.0 : -1.0;
        Shade shadow;
        for (int k = 0; k < n; ++k) {
            const int to = k + 1 < n ? k + 1 : 0;
            const double a = -sense * (y[to] - y[k]), b = sense * (x[to] - x[k]);
            if (a * a + b * b < 1e-24) continue;
            shadow.a[shadow.edges] = a, shadow.b[shadow.edges] = b;
            shadow.c[shadow.edges++] = -a * x[k] - b * y[k];
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
    double all = 0.0;
    const auto share_of = [](double visible, double possible) { return possible > 0.0 ? visible / possible : 0.0; };
    double sum = 0.0, sum_all = 0.0, corners = 0.0, corners_all = 0.0, middle_share = 0.0, middle_all = 0.0, largest = 0.0, largest_corner = 0.0;
    // Corners a hair inside, so that they are in front of what stands on the outline, and not in its plane.
    const double hair = std::clamp(10.0 * in_plane_m / std::min(glm::length(cell.u_m), glm::length(cell.v_m)), 1e-4, 0.2);
    const auto corner = [&](double s, double t, double centre) {
        corners += at(s + hair * (centre - s), t + hair * (centre - t), all);
        corners_all += all;
        largest_corner = std::max(largest_corner, all);
    };
    if (cell.triangle) {
        constexpr double places[3][2] = {{1.0 / 6, 1.0 / 6}, {2.0 / 3, 1.0 / 6}, {1.0 / 6, 2.0 / 3}};  // degree 2
        for (const auto& [s, t] : places) {
            sum += at(s, t, all) / 3;
            sum_all += all / 3;
            largest = std::max(largest, all);
        }
        const double middle = at(1.0 / 3, 1.0 / 3, all);
        middle_share = share_of(middle, all), middle_all = all;
    } else {
        for (const double s : {gauss_2, 1.0 - gauss_2})
            for (const double t : {gauss_2, 1.0 - gauss_2}) {
                sum += at(s, t, all) / 4;
                sum_all += all / 4;
                largest = std::max(largest, all);
            }
        const double middle = at(0.5, 0.5, all);
        middle_share = share_of(middle, all), middle_all = all;
    }
    const double gauss_share = share_of(sum, sum_all), finer = std::exp2(-cell.depth);
    const auto gauss_error = [&] {
        return of_spread_alone * std::abs(middle_share - gauss_share) + of_range_alone * (highest - lowest) + unseen_alone * finer;
    };
    cell.all = sum_all * area;
    if (cell.depth == 0) range_ = std::max(range_, highest - lowest);
    if (cell.depth == 0 && cell.all * gauss_error() < enough * tolerance_m2_) {
        cell.visible = gauss_share * cell.all;
        cell.error = cell.all * gauss_error();
        return;
    }
    if (cell.triangle) {
        for (const auto& [s, t] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}) corner(s, t, 1.0 / 3);
    } else {
        for (const double s : {0.0, 1.0})
            for (const double t : {0.0, 1.0}) corner(s, t, 0.5);
    }
    const double corner_share = share_of(corners, corners_all), range = highest - lowest;
    double share = 0.0;
    if (largest_corner > steep * largest) {
        share = gauss_share;
        cell.error = gauss_error();
    } else {
        share = cell.triangle ? of_gauss * gauss_share + of_centroid * middle_share + of_vertices * corner_share
                              : of_gauss * gauss_share + of_middle * middle_share + of_corners * corner_share;
        const double spread = std::max({gauss_share, middle_share, corner_share}) - std::min({gauss_share, middle_share, corner_share});
        cell.error = of_spread * spread + of_range * range + unseen * finer;
    }
    cell.visible = share * cell.all;
    // Where the unoccluded form factor is not smooth, parts that see more or less than the rest have the wrong weight.
    const double few = cell.triangle ? 0.75 * middle_all + 0.25 * corners_all / 3 : (2 * middle_all + corners_all / 4) / 3;
    if (cell.depth == 0) range_ = std::max(range_, range);
    cell.error = cell.all * cell.error + of_weight * std::abs(few - sum_all) * area * range_;
}

ExchangeEstimate Shadows::exchange(const Polygon& from, const Polygon& to, double unoccluded_m2, double tolerance_m2,
                                   std::span<const Occluder> occluders, std::span<const dvec3> occluder_vertices_m,
                                   std::span<const std::uint32_t> chosen, Side side) {
    NATUREL_EXPECT(to.vertices_m.size() <= most_vertices);
    aim(to, from.normal, occluders, occluder_vertices_m, chosen, side);
    cells_.clear();
    const auto& v = from.vertices_m;
    if (v.size() == 4 && glm::length(v[0] + v[2] - v[1] - v[3]) < 1e-8)
        cells_.push_back({.origin_m = v[0], .u_m = v[1] - v[0], .v_m = v[3] - v[0]});
    else
        for (std::size_t k = 1; k + 1 < v.size(); ++k)
            cells_.push_back({.origin_m = v[0], .u_m = v[k] - v[0], .v_m = v[k + 1] - v[0], .triangle = true});
    double visible = 0.0, all = 0.0, error_2 = 0.0;
    range_ = 0.0;
    tolerance_m2_ = tolerance_m2;
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
    double running = error_2, running_all = all;
    // The estimate is for the cells' sum, which is scaled to the unoccluded exchange in the end.
    const auto too_large = [&] {
        return running * unoccluded_m2 * unoccluded_m2 > tolerance_m2 * tolerance_m2 * running_all * running_all;
    };
    while (too_large() && cells_.size() < most_cells && cells_.front().depth < deepest) {
        std::ranges::pop_heap(cells_, worse);
        const Cell parent = cells_.back();
        cells_.pop_back();
        running -= parent.error * parent.error;
        running_all -= parent.all;
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
            running_all += c.all;
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
    NATUREL_EXPECT(to.vertices_m.size() <= most_vertices);
    aim(to, normal, occluders, occluder_vertices_m, chosen, Side::front);
    double all = 0.0;
    return seen_from(point_m, all);
}

}  // namespace naturel::pairwise
