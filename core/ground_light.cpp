#include "core/ground_light.h"

#include <algorithm>
#include <cmath>

namespace naturel {
namespace {

/// A wall of height h hides (1 - d / sqrt(d^2 + h^2)) / 2 of a uniform sky from the ground d in front of it: 0.25 % at 10 h.
constexpr double reach_in_heights = 10.0;
constexpr double growth = 1.35;           // of the steps outside the site
constexpr std::size_t max_site_lines = 120;
constexpr double off_walls_m = 1e-3;

/// Lines through the given coordinates and between them, and a graded margin.
std::vector<double> lines(std::vector<double> corners, double spacing_m, double reach_m) {
    std::sort(corners.begin(), corners.end());
    std::vector<double> distinct;
    for (const double c : corners) {
        if (distinct.empty() || c - distinct.back() > 2.0 * off_walls_m) distinct.push_back(c);
    }
    const double low = distinct.front(), high = distinct.back();
    if (distinct.size() > max_site_lines) distinct = {low, high};
    const double step = std::max(spacing_m, (high - low) / static_cast<double>(max_site_lines));
    std::vector<double> result;
    for (std::size_t k = 0; k + 1 < distinct.size(); ++k) {
        const double width = distinct[k + 1] - distinct[k];
        const int count = static_cast<int>(std::ceil(width / step));
        for (int i = 0; i < count; ++i) result.push_back(distinct[k] + width * i / count);
    }
    result.push_back(high);
    for (double s = step, d = step; ; s *= growth, d += s) {
        const double margin = std::min(d, reach_m);
        result.insert(result.begin(), low - margin);
        result.push_back(high + margin);
        if (d >= reach_m) break;
    }
    return result;
}

}  // namespace

bool GroundLattice::find(double x, double y, Place& place) const {
    if (x_m.empty() || !(x >= x_m.front() && x <= x_m.back() && y >= y_m.front() && y <= y_m.back())) return false;
    const auto cell = [](const std::vector<double>& at, double value) {
        const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, value);
        return static_cast<std::size_t>(above - at.begin()) - 1;
    };
    const std::size_t i = cell(x_m, x), j = cell(y_m, y);
    place.first_node = j * x_m.size() + i;
    place.along_x = (x - x_m[i]) / (x_m[i + 1] - x_m[i]);
    place.along_y = (y - y_m[j]) / (y_m[j + 1] - y_m[j]);
    return true;
}

std::array<std::pair<std::size_t, double>, 4> GroundLattice::weights(const Place& place) const {
    const std::size_t k = place.first_node, above = k + x_m.size();
    const double s = place.along_x, t = place.along_y;
    return {{{k, (1.0 - t) * (1.0 - s)}, {k + 1, (1.0 - t) * s}, {above, t * (1.0 - s)}, {above + 1, t * s}}};
}

LightBySource GroundLattice::interpolate(const Place& place, const std::vector<LightBySource>& values) const {
    LightBySource sum;
    for (const auto& [node, weight] : weights(place)) sum += weight * values[node];
    return sum;
}

void GroundLattice::fill_closed(std::vector<LightBySource>& values) const {
    std::vector<char> known(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) known[k] = nodes[k].open;
    for (bool filled = true; filled;) {
        filled = false;
        std::vector<char> next = known;
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            if (known[k]) continue;
            const std::size_t i = k % x_m.size();
            LightBySource sum;
            int count = 0;
            const auto take = [&](bool exists, std::size_t from) {
                if (exists && known[from]) sum += values[from], ++count;
            };
            take(i > 0, k - 1), take(i + 1 < x_m.size(), k + 1);
            take(k >= x_m.size(), k - x_m.size()), take(k + x_m.size() < nodes.size(), k + x_m.size());
            if (count == 0) continue;
            values[k] = 1.0 / count * sum;
            next[k] = 1;
            filled = true;
        }
        known = std::move(next);
    }
}

GroundLattice make_ground_lattice(const Scene& scene, const Building& building, double spacing_m) {
    std::vector<double> x, y;
    double top = building.ground_z_m;
    for (const Facet& facet : building.facets) {
        if (facet.environment != Environment::outdoor) continue;
        for (const glm::dvec3& vertex : facet.vertices_m) {
            x.push_back(vertex.x), y.push_back(vertex.y);
            top = std::max(top, vertex.z);
        }
    }
    GroundLattice lattice;
    if (x.empty()) return lattice;
    const double reach_m = std::max(spacing_m, reach_in_heights * (top - building.ground_z_m));
    lattice.x_m = lines(std::move(x), spacing_m, reach_m);
    lattice.y_m = lines(std::move(y), spacing_m, reach_m);
    const double z = building.ground_z_m + off_walls_m;
    for (const double y_m : lattice.y_m) {
        for (const double x_m : lattice.x_m) {
            glm::dvec3 shift{};
            int open = 0;
            for (const auto& [dx, dy] : {std::pair{-1.0, -1.0}, std::pair{1.0, -1.0}, std::pair{-1.0, 1.0}, std::pair{1.0, 1.0}}) {
                const glm::dvec3 aside = off_walls_m * glm::dvec3{dx, dy, 0.0};
                if (medium_at(scene, glm::dvec3{x_m, y_m, z} + aside) != Medium::outdoor_air) continue;
                shift += aside;
                ++open;
            }
            // In an inner corner the one open quarter; along a wall the side that is open.
            lattice.nodes.push_back({glm::dvec3{x_m, y_m, z} + (open > 0 ? 1.0 / open : 0.0) * shift, open > 0});
        }
    }
    return lattice;
}

}  // namespace naturel
