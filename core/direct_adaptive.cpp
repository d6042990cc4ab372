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
using ApertureElement = AdaptiveScratch::ApertureElement;

// Before any light is looked at, elements are divided to these limits, lest a glazing bar or a piece of furniture fall
// between the samples and an estimate from too few of them look converged. Found by trial (tests/core/direct_test.cpp).
constexpr double first_edge = 0.5;          // longest edge, as a chord of the unit sphere
constexpr double first_share = 1.0 / 64.0;  // of the projected solid angle of all apertures together

/// Standard deviation of the share of a triangle that lies on one side of a random straight edge, as estimated from six
/// samples that do not all agree. Measured; docs/method.md, "Direct illuminance".
constexpr double edge_error = 0.15;

/// Crossings of an edge of what is seen with a side of an element are located to this share of the side.
constexpr double crossing_width = 1.0 / 16.0;

/// The same where the edge has been located on both sides that it crosses: it may still bend between them.
constexpr double bent_error = 0.08;

/// A point that sees nearly nothing need not know it more accurately than to this share of what its apertures would
/// give it if nothing stood in the way.
constexpr double negligible_share = 0.01;

/// Work ends here even if the tolerance is not met.
constexpr std::size_t max_samples = 4096;
constexpr std::size_t samples_per_division = 9;  // at most: three new edges inside and six halves

/// Apertures closer than this are in the plane of the point: 10 times finer than what lifts sensors off surfaces.
constexpr double min_height_m = 1e-6;

/// Less than this of an aperture in front of the point is rounding of its outline at the horizon of the point: a contour
/// integral of edges of length 1 is good to some 1e-16.
constexpr double min_projected_sr = 1e-13;

/// Samples keep this share of an aperture's size from its outline, so that they do not graze walls and reveals: 0.1 mm
/// at 1 m, several times what single precision makes of places in a building (and of lifting points off surfaces).
constexpr double inset = 1e-4;

bool same_source(const IncomingLight& a, const IncomingLight& b) {
    if (a.source_luminance == 0.0 && b.source_luminance == 0.0) return true;
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
        mesh_.parts.clear();
        mesh_.elements.clear();
        mesh_.edges.clear();
        mesh_.directions.clear();
        mesh_.part_of.clear();
        mesh_.rays.clear();
        mesh_.seen.clear();
        mesh_.light.clear();
        mesh_.fresh.clear();
    }

    SkyAndOutdoors run(double tolerance) {
        for (std::size_t k = 0; k < light_.openings().size(); ++k) add_aperture(k);
        if (mesh_.elements.empty()) return {};
        for (const ApertureElement& element : mesh_.elements) all_apertures_sr_ += element.projected_solid_angle_sr;
        halve_large_elements();
        add_probes();
        mesh_.fresh.resize(mesh_.elements.size());
        std::iota(mesh_.fresh.begin(), mesh_.fresh.end(), 0u);
        do {
            look();
            locate_crossings();
            for (const std::uint32_t i : mesh_.fresh) estimate(mesh_.elements[i]);
            for (ApertureElement& element : mesh_.elements) learn_from_other_samples(element);
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

    /// Divides a polygon into triangles: around a direction well inside, so that no edge comes near a half circle even
    /// where the point almost touches the aperture; if small, without a sample there. Overwrites the polygon.
    void add_polygon(std::vector<glm::dvec3>& polygon, std::size_t aperture) {
        const glm::dvec3 whole = vector_solid_angle(polygon);
        if (!(glm::dot(point_.normal, whole) > min_projected_sr)) return;
        const glm::dvec3 middle = glm::normalize(whole);
        double reach = 0.0;
        for (glm::dvec3& vertex : polygon) {
            vertex = glm::normalize(vertex);
            reach = std::max(reach, glm::length(vertex - middle));
        }
        // Off the middle, lest all samples of a row fall on one side of an edge in a symmetric scene.
        const glm::dvec3 inside =
            glm::normalize(middle + 0.17 * (polygon[0] - middle) + 0.11 * (polygon[1] - middle));
        const auto part = static_cast<std::uint32_t>(mesh_.parts.size());
        mesh_.parts.push_back({aperture, inside});

        const auto count = static_cast<std::uint32_t>(polygon.size());
        const auto first = static_cast<std::uint32_t>(mesh_.directions.size());
        for (const glm::dvec3& vertex : polygon) add_sample(vertex, part);
        const bool small = reach <= 0.5 * first_edge;
        const std::uint32_t hub = small ? first : add_sample(inside, part);
        const std::uint32_t begin = small ? 1 : 0, end = small ? count - 1 : count;
        std::uint32_t before = add_edge(hub, first + begin);
        const std::uint32_t first_spoke = before;
        for (std::uint32_t k = begin; k < end; ++k) {
            const std::uint32_t from = first + k, to = first + (k + 1) % count;
            const std::uint32_t rim = add_edge(from, to);
            const std::uint32_t after = !small && k + 1 == end ? first_spoke : add_edge(to, hub);
            add_element({.corners = {hub, from, to}, .edges = {before, rim, after}});
            before = after;
        }
    }

    std::uint32_t add_sample(const glm::dvec3& direction, std::uint32_t part) {
        mesh_.directions.push_back(direction);
        mesh_.part_of.push_back(part);
        mesh_.rays.push_back(glm::normalize(direction + inset * (mesh_.parts[part].inside - direction)));
        return static_cast<std::uint32_t>(mesh_.directions.size() - 1);
    }

    std::uint32_t add_edge(std::uint32_t a, std::uint32_t b) {
        const glm::dvec3 middle = glm::normalize(mesh_.directions[a] + mesh_.directions[b]);
        mesh_.edges.push_back({.a = a, .b = b, .middle = add_sample(middle, mesh_.part_of[a])});
        return static_cast<std::uint32_t>(mesh_.edges.size() - 1);
    }

    void measure(ApertureElement& element) const {
        const auto& [a, b, c] = element.corners;
        const std::array<glm::dvec3, 3> triangle{mesh_.directions[a], mesh_.directions[b], mesh_.directions[c]};
        element.projected_solid_angle_sr = std::max(0.0, glm::dot(point_.normal, vector_solid_angle(triangle)));
    }

    void add_element(ApertureElement element) {
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
            if (whole.high <= 0.5) {
                mesh_.edges[first].low = 2.0 * whole.low, mesh_.edges[first].high = 2.0 * whole.high;
            } else if (whole.low >= 0.5) {
                mesh_.edges[first + 1].low = 2.0 * whole.low - 1.0;
                mesh_.edges[first + 1].high = 2.0 * whole.high - 1.0;
            }
        }
        return mesh_.edges[edge].halves + (mesh_.edges[edge].a == end ? 0 : 1);
    }

    void halve_large_elements() {
        const double largest_sr = first_share * all_apertures_sr_;
        for (std::size_t i = 0; i < mesh_.elements.size();) {
            const ApertureElement whole = mesh_.elements[i];
            std::size_t k = 0;
            double longest = 0.0;
            for (std::size_t side = 0; side < 3; ++side) {
                const Edge& edge = mesh_.edges[whole.edges[side]];
                const double length = glm::length(mesh_.directions[edge.b] - mesh_.directions[edge.a]);
                if (length > longest) longest = length, k = side;
            }
            const bool small_enough = longest <= first_edge && whole.projected_solid_angle_sr <= largest_sr;
            if (small_enough || mesh_.directions.size() + samples_per_division > max_samples) {
                ++i;
                continue;
            }
            const std::uint32_t a = whole.corners[k], b = whole.corners[(k + 1) % 3], tip = whole.corners[(k + 2) % 3];
            const std::uint32_t edge_ab = whole.edges[k], edge_b_tip = whole.edges[(k + 1) % 3],
                                edge_tip_a = whole.edges[(k + 2) % 3];
            const std::uint32_t middle = mesh_.edges[edge_ab].middle;
            const std::uint32_t cut = add_edge(middle, tip);
            ApertureElement part = whole;
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
            ApertureElement& element = mesh_.elements[i];
            double s = uniform_from(2 * i), t = uniform_from(2 * i + 1);
            if (s + t > 1.0) s = 1.0 - s, t = 1.0 - t;
            const auto& [a, b, c] = element.corners;
            element.probe = add_sample(glm::normalize((1.0 - s - t) * mesh_.directions[a] + s * mesh_.directions[b] +
                                                      t * mesh_.directions[c]),
                                       mesh_.part_of[a]);
        }
    }

    bool contains(const ApertureElement& element, std::uint32_t sample) const {
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
        visibility_.first_seen(point_, std::span(mesh_.rays).subspan(known, count),
                               std::span(mesh_.seen).subspan(known, count));
        for (std::size_t i = known; i < mesh_.directions.size(); ++i) {
            const std::size_t aperture = mesh_.parts[mesh_.part_of[i]].aperture;
            mesh_.light[i] = light_.along(point_.position_m, mesh_.rays[i], mesh_.seen[i], aperture);
        }
    }

    /// The corner that one straight edge of what is seen would cut off, judging by the six samples; 3 if there is none.
    std::size_t odd_corner(const ApertureElement& element) const {
        for (std::size_t k = 0; k < 3; ++k) {
            const IncomingLight& odd = mesh_.light[element.corners[k]];
            const IncomingLight& rest = mesh_.light[element.corners[(k + 1) % 3]];
            const auto middle = [&](std::size_t side) -> const IncomingLight& {
                return mesh_.light[mesh_.edges[element.edges[side % 3]].middle];
            };
            const auto is_either = [&](const IncomingLight& light) {
                return same_source(light, odd) || same_source(light, rest);
            };
            if (!same_source(odd, rest) && same_source(mesh_.light[element.corners[(k + 2) % 3]], rest) &&
                same_source(middle(k + 1), rest) && is_either(middle(k)) && is_either(middle(k + 2))) {
                return k;
            }
        }
        return 3;
    }

    /// On the sides of fresh elements with an odd corner, finds where what is seen changes, by bisection.
    void locate_crossings() {
        mesh_.crossed.clear();
        for (const std::uint32_t i : mesh_.fresh) {
            const ApertureElement& element = mesh_.elements[i];
            const std::size_t odd = odd_corner(element);
            if (odd == 3) continue;
            for (const std::size_t side : {odd, (odd + 2) % 3}) {
                const std::uint32_t id = element.edges[side];
                Edge& edge = mesh_.edges[id];
                if (edge.low == 0.0 && edge.high == 1.0) bisect(edge, edge.middle);
                mesh_.crossed.push_back(id);
            }
        }
        std::sort(mesh_.crossed.begin(), mesh_.crossed.end());
        mesh_.crossed.erase(std::unique(mesh_.crossed.begin(), mesh_.crossed.end()), mesh_.crossed.end());
        for (;;) {
            std::erase_if(mesh_.crossed, [&](std::uint32_t id) {
                return mesh_.edges[id].high - mesh_.edges[id].low <= crossing_width;
            });
            if (mesh_.crossed.empty() || mesh_.directions.size() + mesh_.crossed.size() > max_samples) return;
            auto sample = static_cast<std::uint32_t>(mesh_.directions.size());
            for (const std::uint32_t id : mesh_.crossed) {
                const Edge& edge = mesh_.edges[id];
                add_sample(on_edge(edge, 0.5 * (edge.low + edge.high)), mesh_.part_of[edge.a]);
            }
            look();
            for (const std::uint32_t id : mesh_.crossed) bisect(mesh_.edges[id], sample++);
        }
    }

    glm::dvec3 on_edge(const Edge& edge, double share) const {
        return glm::normalize((1.0 - share) * mesh_.directions[edge.a] + share * mesh_.directions[edge.b]);
    }

    /// sample: half way between the bounds.
    void bisect(Edge& edge, std::uint32_t sample) const {
        const double middle = 0.5 * (edge.low + edge.high);
        if (same_source(mesh_.light[sample], mesh_.light[edge.a])) edge.low = middle;
        else if (same_source(mesh_.light[sample], mesh_.light[edge.b])) edge.high = middle;
        else edge.low = edge.high = middle;
    }

    /// Weighs the samples of an element.
    /// Where all see the same, light is smooth: the three middles integrate a quadratic exactly, and the corners tell
    /// the error. Where one corner is odd, a straight edge between the two crossings divides the element. Else each of
    /// its four quarters has the mean of its corners, and the error is what edges do on average.
    void estimate(ApertureElement& element) const {
        element.cut_normal = {};
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
        std::array<double, 6> density{}, mean{};
        bool smooth = true;
        for (std::size_t k = 0; k < 6; ++k) {
            const std::uint32_t sample = k < 3 ? element.corners[k] : mesh_.edges[element.edges[k - 3]].middle;
            light[k] = &mesh_.light[sample];
            density[k] = density_of(sample);
            mean[k] = light[k]->mean();
            smooth = smooth && same_source(*light[k], *light[0]);
        }
        const auto [low, high] = std::minmax_element(mean.begin(), mean.end());
        constexpr double corner_share = 1.0 / 12.0, middle_share = 1.0 / 4.0;
        const double middles = density[3] + density[4] + density[5];
        const double all = corner_share * (density[0] + density[1] + density[2]) + middle_share * middles;
        double by_quarters = 0.0;
        for (std::size_t k = 0; k < 6; ++k) {
            element.weights_sr[k] = whole_sr * (k < 3 ? corner_share : middle_share) * density[k] / all;
            by_quarters += element.weights_sr[k] * mean[k];
        }
        element.error_lx = edge_error * whole_sr * (*high - *low);

        const std::size_t odd = smooth ? 3 : odd_corner(element);
        if (smooth) {
            for (std::size_t k = 0; k < 6; ++k) element.weights_sr[k] = k < 3 ? 0.0 : whole_sr * density[k] / middles;
        } else if (odd < 3) {
            const Edge& edge_p = mesh_.edges[element.edges[odd]];
            const Edge& edge_q = mesh_.edges[element.edges[(odd + 2) % 3]];
            const double width_p = edge_p.high - edge_p.low, width_q = edge_q.high - edge_q.low;
            if (width_p > 0.0 && width_q > 0.0 && width_p < 1.0 && width_q < 1.0) {
                const std::uint32_t corner = element.corners[odd];
                const double along_p = 0.5 * (edge_p.low + edge_p.high), along_q = 0.5 * (edge_q.low + edge_q.high);
                const double s = edge_p.a == corner ? along_p : 1.0 - along_p;
                const double t = edge_q.a == corner ? along_q : 1.0 - along_q;
                const double p = density[(odd + 1) % 3], q = density[(odd + 2) % 3];
                const double odd_density = density[odd] + (s * (p - density[odd]) + t * (q - density[odd])) / 3.0;
                const double odd_share = std::min(1.0, s * t * odd_density / ((density[odd] + p + q) / 3.0));
                std::array<bool, 6> is_odd{};
                double odd_count = 0.0;
                for (std::size_t k = 0; k < 6; ++k) {
                    is_odd[k] = same_source(*light[k], *light[odd]);
                    odd_count += is_odd[k] ? 1.0 : 0.0;
                }
                for (std::size_t k = 0; k < 6; ++k) {
                    element.weights_sr[k] =
                        whole_sr * (is_odd[k] ? odd_share / odd_count : (1.0 - odd_share) / (6.0 - odd_count));
                }
                const glm::dvec3 normal = glm::cross(on_edge(edge_p, along_p), on_edge(edge_q, along_q));
                const double side = glm::dot(normal, mesh_.directions[corner]) < 0.0 ? -1.0 : 1.0;
                element.cut_normal = side / glm::length(normal) * normal;
                element.odd = corner;
                element.error_lx = whole_sr * (*high - *low) *
                                   std::sqrt((width_p * width_p * t * t + width_q * width_q * s * s) / 12.0 +
                                             bent_error * bent_error);
            }
        }
        element.illuminance_lx = 0.0;
        for (std::size_t k = 0; k < 6; ++k) element.illuminance_lx += element.weights_sr[k] * mean[k];
        if (smooth) element.error_lx = std::abs(element.illuminance_lx - by_quarters);
    }

    /// The probe inside, or points of an edge that a neighbour has looked at since it was divided, may tell that an
    /// edge runs otherwise than the six samples made believe.
    void learn_from_other_samples(ApertureElement& element) const {
        const bool cut = element.cut_normal != glm::dvec3{};
        const auto learn_from = [&](std::uint32_t sample) {
            std::uint32_t alike = element.corners[0];
            if (cut) {
                const double side = glm::dot(element.cut_normal, mesh_.directions[sample]);
                const double margin = crossing_width * glm::length(mesh_.directions[element.corners[1]] -
                                                                   mesh_.directions[element.corners[0]]);
                if (std::abs(side) < margin) return;
                alike = side > 0.0                           ? element.odd
                        : element.odd == element.corners[0] ? element.corners[1]
                                                            : element.corners[0];
            }
            const IncomingLight& expected = mesh_.light[alike];
            const IncomingLight& found = mesh_.light[sample];
            if (same_source(expected, found)) return;
            const double step = std::abs(found.mean() - expected.mean());
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
        for (const ApertureElement& element : mesh_.elements) {
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
        const ApertureElement whole = mesh_.elements[position];
        const auto& [a, b, c] = whole.corners;
        const auto& [edge_ab, edge_bc, edge_ca] = whole.edges;
        const std::uint32_t ab = mesh_.edges[edge_ab].middle, bc = mesh_.edges[edge_bc].middle,
                            ca = mesh_.edges[edge_ca].middle;
        const std::uint32_t at_a = add_edge(ca, ab), at_b = add_edge(ab, bc), at_c = add_edge(bc, ca);
        const auto part = [&](const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& edges) {
            ApertureElement element = whole;
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
        for (const ApertureElement& element : mesh_.elements) {
            for (std::size_t k = 0; k < 3; ++k) {
                sum.add(element.weights_sr[k], mesh_.light[element.corners[k]]);
                sum.add(element.weights_sr[k + 3], mesh_.light[mesh_.edges[element.edges[k]].middle]);
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
