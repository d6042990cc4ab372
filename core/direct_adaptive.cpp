#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "core/direct_integrators.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

using Edge = AdaptiveScratch::Edge;
using Element = AdaptiveScratch::Element;

// Before any light is looked at, elements are divided to these limits, lest a glazing bar or a piece of furniture fall
// between the samples and an estimate from too few of them look converged. Found by trial (tests/core/direct_test.cpp).
constexpr double first_edge = 0.5;          // longest edge, as a chord of the unit sphere
constexpr double first_share = 1.0 / 64.0;  // of the projected solid angle of all apertures together

/// Standard deviation of the share of a triangle that lies on one side of a random straight edge, as estimated from six
/// samples that do not all agree. Measured; docs/method.md, "Direct illuminance".
constexpr double edge_error = 0.15;

/// A point that sees nearly nothing need not know it more accurately than to this share of what its apertures would
/// give it if nothing stood in the way.
constexpr double negligible_share = 0.01;

/// Work ends here even if the tolerance is not met.
constexpr std::size_t max_samples = 4096;
constexpr std::size_t samples_per_division = 9;  // at most: three new edges inside and six halves

/// Apertures closer than this are in the plane of the point: 10 times finer than what lifts sensors off surfaces.
constexpr double min_height_m = 1e-6;

/// Samples keep this share of an aperture's size from its outline, so that they do not graze walls and reveals: 20
/// micrometres at 1 m, which single precision resolves within 100 m of the origin.
constexpr double inset = 2e-5;

bool same_source(const IncomingLight& a, const IncomingLight& b) {
    if (a.seen != b.seen || a.apertures_crossed != b.apertures_crossed) return false;
    return a.seen == FacetId::none || a.source_luminance == b.source_luminance;
}

/// In [0, 1): a hash of a number (SplitMix64, Steele et al. 2014).
double uniform_from(std::uint64_t number) {
    std::uint64_t z = (number + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

class Integration {
public:
    Integration(const GatherPoint& point, const ApertureLight& light, const Visibility& visibility,
                AdaptiveScratch& scratch)
        : point_(point), light_(light), visibility_(visibility), mesh_(scratch) {
        mesh_.elements.clear();
        mesh_.edges.clear();
        mesh_.directions.clear();
        mesh_.apertures.clear();
        mesh_.seen.clear();
        mesh_.light.clear();
        mesh_.fresh.clear();
    }

    SkyAndOutdoors run(double tolerance) {
        for (std::size_t k = 0; k < light_.openings().size(); ++k) add_aperture(k);
        if (mesh_.elements.empty()) return {};
        for (const Element& element : mesh_.elements) all_apertures_sr_ += element.projected_solid_angle_sr;
        halve_large_elements();
        add_probes();
        mesh_.fresh.resize(mesh_.elements.size());
        std::iota(mesh_.fresh.begin(), mesh_.fresh.end(), 0u);
        do {
            look();
            for (const std::uint32_t i : mesh_.fresh) estimate(mesh_.elements[i]);
            for (Element& element : mesh_.elements) learn_from_other_samples(element);
        } while (refine(tolerance));
        return total();
    }

private:
    /// What is in front of the point, cut at its horizon, where sky and ground meet.
    void add_aperture(std::size_t aperture) {
        const Opening& opening = light_.openings()[aperture];
        if (opening.inner || opening.height_m(point_.position_m) < min_height_m) return;
        for (const Opening::Part& part : opening.parts) {
            mesh_.polygon.clear();
            for (const glm::dvec3& vertex : part.vertices_m) mesh_.polygon.push_back(vertex - point_.position_m);
            keep_half_space(mesh_.polygon, point_.normal, mesh_.clipped);
            for (const double up : {1.0, -1.0}) {
                keep_half_space(mesh_.clipped, {0, 0, up}, mesh_.half);
                if (!mesh_.half.empty()) add_polygon(mesh_.half, aperture);
            }
        }
    }

    /// Divides a polygon into triangles: around a direction well inside, so that no edge comes near a half circle even where
    /// the point almost touches the aperture; if small, without a sample there. Overwrites the polygon.
    void add_polygon(std::vector<glm::dvec3>& polygon, std::size_t aperture) {
        const glm::dvec3 whole = vector_solid_angle(polygon);
        const double whole_sr = glm::dot(point_.normal, whole);
        if (!(whole_sr > 0.0)) return;
        const glm::dvec3 middle = glm::normalize(whole);
        double reach = 0.0;
        for (glm::dvec3& vertex : polygon) {
            const glm::dvec3 direction = glm::normalize(vertex);
            vertex = glm::normalize(direction + inset * (middle - direction));
            reach = std::max(reach, glm::length(vertex - middle));
        }
        // Off the middle, lest all samples of a row fall on one side of an edge in a symmetric scene.
        const glm::dvec3 apex = glm::normalize(middle + 0.17 * (polygon[0] - middle) + 0.11 * (polygon[1] - middle));
        // The inset takes up to 4e-5 of the polygon away: what is left stands for the whole.
        const double scale = whole_sr / glm::dot(point_.normal, vector_solid_angle(polygon));

        const auto count = static_cast<std::uint32_t>(polygon.size());
        const auto first = static_cast<std::uint32_t>(mesh_.directions.size());
        for (const glm::dvec3& vertex : polygon) add_sample(vertex, aperture);
        const bool small = reach <= 0.5 * first_edge;
        const std::uint32_t hub = small ? first : add_sample(apex, aperture);
        const std::uint32_t begin = small ? 1 : 0, end = small ? count - 1 : count;
        std::uint32_t before = add_edge(hub, first + begin);
        const std::uint32_t first_spoke = before;
        for (std::uint32_t k = begin; k < end; ++k) {
            const std::uint32_t from = first + k, to = first + (k + 1) % count;
            const std::uint32_t rim = add_edge(from, to);
            const std::uint32_t after = !small && k + 1 == end ? first_spoke : add_edge(to, hub);
            add_element({.corners = {hub, from, to}, .edges = {before, rim, after}, .aperture = aperture, .scale = scale});
            before = after;
        }
    }

    std::uint32_t add_sample(const glm::dvec3& direction, std::size_t aperture) {
        mesh_.directions.push_back(direction);
        mesh_.apertures.push_back(aperture);
        return static_cast<std::uint32_t>(mesh_.directions.size() - 1);
    }

    std::uint32_t add_edge(std::uint32_t a, std::uint32_t b) {
        const glm::dvec3 middle = glm::normalize(mesh_.directions[a] + mesh_.directions[b]);
        mesh_.edges.push_back({.a = a, .b = b, .middle = add_sample(middle, mesh_.apertures[a])});
        return static_cast<std::uint32_t>(mesh_.edges.size() - 1);
    }

    void measure(Element& element) const {
        const auto& [a, b, c] = element.corners;
        const std::array<glm::dvec3, 3> triangle{mesh_.directions[a], mesh_.directions[b], mesh_.directions[c]};
        const double projected = glm::dot(point_.normal, vector_solid_angle(triangle));
        element.projected_solid_angle_sr = element.scale * std::max(0.0, projected);
    }

    void add_element(Element element) {
        measure(element);
        mesh_.elements.push_back(element);
    }

    /// The half of an edge at one of its ends.
    std::uint32_t half_of(std::uint32_t edge, std::uint32_t end) {
        if (mesh_.edges[edge].halves == AdaptiveScratch::none) {
            const Edge whole = mesh_.edges[edge];
            const std::uint32_t first = add_edge(whole.a, whole.middle);
            add_edge(whole.middle, whole.b);
            mesh_.edges[edge].halves = first;
        }
        return mesh_.edges[edge].halves + (mesh_.edges[edge].a == end ? 0 : 1);
    }

    void halve_large_elements() {
        const double largest_sr = first_share * all_apertures_sr_;
        for (std::size_t i = 0; i < mesh_.elements.size();) {
            const Element whole = mesh_.elements[i];
            std::size_t k = 0;
            double longest = 0.0;
            for (std::size_t side = 0; side < 3; ++side) {
                const Edge& edge = mesh_.edges[whole.edges[side]];
                const double length = glm::length(mesh_.directions[edge.b] - mesh_.directions[edge.a]);
                if (length > longest) longest = length, k = side;
            }
            if (longest <= first_edge && whole.projected_solid_angle_sr <= largest_sr) {
                ++i;
                continue;
            }
            const std::uint32_t a = whole.corners[k], b = whole.corners[(k + 1) % 3], tip = whole.corners[(k + 2) % 3];
            const std::uint32_t edge_ab = whole.edges[k], edge_b_tip = whole.edges[(k + 1) % 3],
                                edge_tip_a = whole.edges[(k + 2) % 3];
            const std::uint32_t middle = mesh_.edges[edge_ab].middle;
            const std::uint32_t cut = add_edge(middle, tip);
            Element part = whole;
            part.corners = {a, middle, tip};
            part.edges = {half_of(edge_ab, a), cut, edge_tip_a};
            measure(part);
            mesh_.elements[i] = part;
            part.corners = {middle, b, tip};
            part.edges = {half_of(edge_ab, b), edge_b_tip, cut};
            add_element(part);
        }
    }

    /// Corners and middles stand in rows, between which a glazing bar can hide: probes do not.
    void add_probes() {
        for (std::size_t i = 0; i < mesh_.elements.size(); ++i) {
            Element& element = mesh_.elements[i];
            double s = uniform_from(2 * i), t = uniform_from(2 * i + 1);
            if (s + t > 1.0) s = 1.0 - s, t = 1.0 - t;
            const auto& [a, b, c] = element.corners;
            element.probe = add_sample(glm::normalize((1.0 - s - t) * mesh_.directions[a] + s * mesh_.directions[b] +
                                                      t * mesh_.directions[c]),
                                       element.aperture);
        }
    }

    bool contains(const Element& element, std::uint32_t sample) const {
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec3& from = mesh_.directions[element.corners[k]];
            const glm::dvec3& to = mesh_.directions[element.corners[(k + 1) % 3]];
            if (glm::dot(glm::cross(to, from), mesh_.directions[sample]) < 0.0) return false;
        }
        return true;
    }

    /// Asks what is seen in the directions that are new.
    void look() {
        const std::size_t known = mesh_.light.size();
        const std::size_t count = mesh_.directions.size() - known;
        mesh_.seen.resize(mesh_.directions.size());
        mesh_.light.resize(mesh_.directions.size());
        visibility_.first_seen(point_, std::span(mesh_.directions).subspan(known, count),
                               std::span(mesh_.seen).subspan(known, count));
        for (std::size_t i = known; i < mesh_.directions.size(); ++i) {
            mesh_.light[i] =
                light_.along(point_.position_m, mesh_.directions[i], mesh_.seen[i], mesh_.apertures[i]);
        }
    }

    /// Where all samples see the same, light is smooth: the three middles integrate a quadratic exactly, and the
    /// corners tell the error. Where they do not, an edge runs through: each of the four quarters has the mean of its
    /// corners, and the error is what edges do on average.
    void estimate(Element& element) const {
        const double whole_sr = element.projected_solid_angle_sr;
        if (whole_sr == 0.0) return;
        const auto& [a, b, c] = element.corners;
        const glm::dvec3 plane_normal = glm::cross(mesh_.directions[c] - mesh_.directions[a],
                                                   mesh_.directions[b] - mesh_.directions[a]);
        // Projected solid angle per area of the plane through the corners, up to a factor: cos / r^2 times an obliquity
        // that goes with 1 / r, where r is inverse to how far a unit direction reaches towards the plane.
        const auto density_of = [&](std::uint32_t sample) {
            const double reach = glm::dot(plane_normal, mesh_.directions[sample]);
            return std::max(0.0, glm::dot(point_.normal, mesh_.directions[sample])) * reach * reach * reach;
        };
        std::array<const IncomingLight*, 6> light{};
        std::array<double, 6> density{};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t middle = mesh_.edges[element.edges[k]].middle;
            light[k] = &mesh_.light[element.corners[k]];
            light[k + 3] = &mesh_.light[middle];
            density[k] = density_of(element.corners[k]);
            density[k + 3] = density_of(middle);
        }
        constexpr double corner_share = 1.0 / 12.0, middle_share = 1.0 / 4.0;
        const double middles = density[3] + density[4] + density[5];
        const double all = corner_share * (density[0] + density[1] + density[2]) + middle_share * middles;
        double low = std::numeric_limits<double>::infinity(), high = 0.0, by_middles = 0.0, by_quarters = 0.0;
        bool smooth = true;
        for (std::size_t k = 0; k < 6; ++k) {
            const double mean = light[k]->mean();
            low = std::min(low, mean);
            high = std::max(high, mean);
            smooth = smooth && same_source(*light[k], *light[0]);
            by_quarters += whole_sr * (k < 3 ? corner_share : middle_share) * density[k] / all * mean;
            if (k >= 3) by_middles += whole_sr * density[k] / middles * mean;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            element.corner_weights_sr[k] = smooth ? 0.0 : whole_sr * corner_share * density[k] / all;
            element.middle_weights_sr[k] =
                whole_sr * density[k + 3] * (smooth ? 1.0 / middles : middle_share / all);
        }
        element.illuminance_lx = smooth ? by_middles : by_quarters;
        element.error_lx = smooth ? std::abs(by_middles - by_quarters) : edge_error * whole_sr * (high - low);
    }

    /// The probe inside, or quarter points of an edge that a neighbour has looked at since it was divided, may tell that
    /// an edge runs where the six samples did not see it.
    void learn_from_other_samples(Element& element) const {
        const auto learn_from = [&](std::uint32_t sample) {
            const IncomingLight& own = mesh_.light[element.corners[0]];
            const IncomingLight& other = mesh_.light[sample];
            if (same_source(own, other)) return;
            const double step = std::abs(other.mean() - own.mean());
            element.error_lx = std::max(element.error_lx, edge_error * element.projected_solid_angle_sr * step);
        };
        if (element.probe != AdaptiveScratch::none) learn_from(element.probe);
        const auto learn_from_parts_of = [&](const auto& self, std::uint32_t edge) -> void {
            const std::uint32_t halves = mesh_.edges[edge].halves;
            if (halves == AdaptiveScratch::none) return;
            for (const std::uint32_t half : {halves, halves + 1}) {
                learn_from(mesh_.edges[half].middle);
                self(self, half);
            }
        };
        for (const std::uint32_t edge : element.edges) learn_from_parts_of(learn_from_parts_of, edge);
    }

    /// Divides in four the elements that matter most; false when there is no need, or no budget.
    bool refine(double tolerance) {
        double sum = 0.0, squared_error = 0.0;
        for (const Element& element : mesh_.elements) {
            sum += element.illuminance_lx;
            squared_error += element.error_lx * element.error_lx;
        }
        const double unobstructed = all_apertures_sr_ * light_.outdoors().horizontal_illuminance().value / pi;
        const double allowed = tolerance * std::max(sum, negligible_share * unobstructed);
        if (squared_error <= allowed * allowed) return false;

        // Errors are independent and of either sign, so their squares add up. The smallest ones that together use up
        // half of what is allowed can stay as they are.
        std::vector<std::uint32_t>& order = mesh_.order;
        order.resize(mesh_.elements.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            const double error_a = mesh_.elements[a].error_lx, error_b = mesh_.elements[b].error_lx;
            return error_a != error_b ? error_a > error_b : a < b;
        });
        mesh_.fresh.clear();
        double staying = squared_error;
        for (const std::uint32_t i : order) {
            const double error = mesh_.elements[i].error_lx;
            if (staying <= 0.5 * allowed * allowed || error == 0.0) break;
            if (mesh_.directions.size() + samples_per_division > max_samples) break;
            staying -= error * error;
            divide_in_four(i);
        }
        return !mesh_.fresh.empty();
    }

    void divide_in_four(std::uint32_t position) {
        const Element whole = mesh_.elements[position];
        const auto& [a, b, c] = whole.corners;
        const auto& [edge_ab, edge_bc, edge_ca] = whole.edges;
        const std::uint32_t ab = mesh_.edges[edge_ab].middle, bc = mesh_.edges[edge_bc].middle,
                            ca = mesh_.edges[edge_ca].middle;
        const std::uint32_t at_a = add_edge(ca, ab), at_b = add_edge(ab, bc), at_c = add_edge(bc, ca);
        const auto part = [&](const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& edges) {
            Element element = whole;
            element.corners = corners;
            element.edges = edges;
            if (whole.probe != AdaptiveScratch::none && !contains(element, whole.probe)) {
                element.probe = AdaptiveScratch::none;
            }
            measure(element);
            return element;
        };
        const auto add = [&](const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& edges) {
            mesh_.fresh.push_back(static_cast<std::uint32_t>(mesh_.elements.size()));
            mesh_.elements.push_back(part(corners, edges));
        };
        mesh_.elements[position] = part({ab, bc, ca}, {at_b, at_c, at_a});
        mesh_.fresh.push_back(position);
        add({a, ab, ca}, {half_of(edge_ab, a), at_a, half_of(edge_ca, a)});
        add({ab, b, bc}, {half_of(edge_ab, b), half_of(edge_bc, b), at_b});
        add({ca, bc, c}, {at_c, half_of(edge_bc, c), half_of(edge_ca, c)});
    }

    SkyAndOutdoors total() const {
        SkyAndOutdoors sum;
        for (const Element& element : mesh_.elements) {
            for (std::size_t k = 0; k < 3; ++k) {
                sum.add(element.corner_weights_sr[k], mesh_.light[element.corners[k]]);
                sum.add(element.middle_weights_sr[k], mesh_.light[mesh_.edges[element.edges[k]].middle]);
            }
        }
        return sum;
    }

    const GatherPoint& point_;
    const ApertureLight& light_;
    const Visibility& visibility_;
    AdaptiveScratch& mesh_;
    double all_apertures_sr_ = 0.0;  // projected solid angle
};

}  // namespace

SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch) {
    return Integration(point, light, visibility, scratch).run(tolerance);
}

}  // namespace naturel
