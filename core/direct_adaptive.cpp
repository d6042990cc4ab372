#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "core/direct_integrators.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

using Element = AdaptiveScratch::Element;
using Sample = AdaptiveScratch::Sample;
using Triangle = std::array<glm::dvec3, 3>;

// Before any light is looked at, elements are divided to these limits, lest a glazing bar or a piece of furniture fall
// between the samples and an estimate from too few of them look converged. Found by trial (tests/core/direct_test.cpp).
constexpr double first_edge = 0.5;           // longest edge, as a chord of the unit sphere
constexpr double first_share = 1.0 / 16.0;   // of the projected solid angle of all apertures together

/// Standard deviation of the share of a triangle that lies on one side of a random straight edge, as estimated by four
/// samples that do not all agree. Measured; docs/method.md, "Direct illuminance".
constexpr double edge_error = 0.15;

/// A point that sees nearly nothing need not know it more accurately than to this share of what its apertures would
/// give it if nothing stood in the way.
constexpr double negligible_share = 0.01;

/// Work ends here even if the tolerance is not met: light falls in a pattern finer than the eye resolves.
constexpr std::size_t max_samples = 4096;

/// Apertures closer than this are in the plane of the point: 10 times finer than what lifts sensors off surfaces.
constexpr double min_height_m = 1e-6;

bool same_source(const IncomingLight& a, const IncomingLight& b) {
    if (a.seen != b.seen || a.apertures_crossed != b.apertures_crossed) return false;
    return a.seen == FacetId::none || a.source_luminance == b.source_luminance;
}

class Integration {
public:
    Integration(const GatherPoint& point, const ApertureLight& light, const Visibility& visibility,
                AdaptiveScratch& scratch)
        : point_(point), light_(light), visibility_(visibility), scratch_(scratch) {
        scratch_.elements.clear();
        scratch_.samples.clear();
        scratch_.directions.clear();
        scratch_.fresh.clear();
    }

    SkyAndOutdoors run(double tolerance) {
        collect_polygons();
        if (scratch_.elements.empty()) return {};
        divide_coarse_elements();
        for (Element& element : scratch_.elements) place_samples(element, 0);
        scratch_.fresh.resize(scratch_.elements.size());
        std::iota(scratch_.fresh.begin(), scratch_.fresh.end(), 0u);
        do evaluate_fresh_elements();
        while (refine(tolerance));
        return total();
    }

private:
    /// Triangles of directions that cover what is in front of the point, each wholly above or below its horizon, where
    /// sky and ground meet.
    void collect_polygons() {
        const auto openings = light_.openings();
        for (std::size_t k = 0; k < openings.size(); ++k) {
            if (openings[k].inner || openings[k].height_m(point_.position_m) < min_height_m) continue;
            for (const Opening::Part& part : openings[k].parts) {
                scratch_.polygon.clear();
                for (const glm::dvec3& vertex : part.vertices_m) scratch_.polygon.push_back(vertex - point_.position_m);
                keep_half_space(scratch_.polygon, point_.normal, scratch_.clipped);
                for (const double up : {1.0, -1.0}) {
                    keep_half_space(scratch_.clipped, {0, 0, up}, scratch_.above);
                    add_fan(k);
                }
            }
        }
        for (const Element& element : scratch_.elements) all_apertures_sr_ += element.projected_solid_angle_sr;
    }

    /// The polygon scratch_.above, in triangles around its mean direction: no edge of them comes near a half circle even
    /// where the point almost touches the aperture.
    void add_fan(std::size_t aperture) {
        std::vector<glm::dvec3>& polygon = scratch_.above;
        if (polygon.empty()) return;
        for (glm::dvec3& vertex : polygon) vertex = glm::normalize(vertex);
        const glm::dvec3 mean = vector_solid_angle(polygon);
        if (!(glm::dot(mean, mean) > 0.0)) return;
        const glm::dvec3 apex = glm::normalize(mean);
        const double reach = std::accumulate(polygon.begin(), polygon.end(), 0.0, [&](double r, const glm::dvec3& v) {
            return std::max(r, glm::length(v - apex));
        });
        if (reach <= 0.5 * first_edge) {
            for (std::size_t i = 2; i < polygon.size(); ++i) {
                add_element({polygon[0], polygon[i - 1], polygon[i]}, aperture);
            }
        } else {
            for (std::size_t i = 0; i < polygon.size(); ++i) {
                add_element({apex, polygon[i], polygon[(i + 1) % polygon.size()]}, aperture);
            }
        }
    }

    void add_element(const Triangle& corners, std::size_t aperture) {
        const double weight = glm::dot(point_.normal, vector_solid_angle(corners));
        if (!(weight > 0.0)) return;
        scratch_.elements.push_back(
            {.corners = corners, .projected_solid_angle_sr = weight, .aperture = aperture});
    }

    /// Halves the longest edge of elements that are too large, along great circles.
    void divide_coarse_elements() {
        const double largest_share_sr = first_share * all_apertures_sr_;
        for (std::size_t i = 0; i < scratch_.elements.size();) {
            Element& element = scratch_.elements[i];
            const Triangle& c = element.corners;
            std::size_t longest = 0;
            double length = 0.0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double edge = glm::length(c[(k + 1) % 3] - c[k]);
                if (edge > length) length = edge, longest = k;
            }
            if (length <= first_edge && element.projected_solid_angle_sr <= largest_share_sr) {
                ++i;
                continue;
            }
            const glm::dvec3 a = c[longest], b = c[(longest + 1) % 3], apex = c[(longest + 2) % 3];
            const glm::dvec3 middle = glm::normalize(a + b);
            element.corners = {a, middle, apex};
            element.projected_solid_angle_sr =
                std::max(0.0, glm::dot(point_.normal, vector_solid_angle(element.corners)));
            add_element({middle, b, apex}, element.aperture);
        }
    }

    /// Adds the samples `first`.. 3 of an element.
    void place_samples(Element& element, std::size_t first) {
        const auto& [a, b, c] = element.corners;
        const std::array<glm::dvec3, 4> places{(a + b + c) / 3.0, (4.0 * a + b + c) / 6.0, (a + 4.0 * b + c) / 6.0,
                                               (a + b + 4.0 * c) / 6.0};
        for (std::size_t k = first; k < places.size(); ++k) {
            const double squared = glm::dot(places[k], places[k]);
            // cos / r^2 times the obliquity of the element's plane, which is proportional to 1 / r.
            const double density = std::max(0.0, glm::dot(point_.normal, places[k])) / (squared * squared);
            element.samples[k] = static_cast<std::uint32_t>(scratch_.samples.size());
            scratch_.samples.push_back({.density = density, .light = {}});
            scratch_.directions.push_back(places[k] / std::sqrt(squared));
        }
    }

    void evaluate_fresh_elements() {
        const std::size_t begin = known_samples_;
        const std::size_t count = scratch_.directions.size() - begin;
        scratch_.seen.resize(scratch_.directions.size());
        visibility_.first_seen(point_, std::span(scratch_.directions).subspan(begin, count),
                               std::span(scratch_.seen).subspan(begin, count));
        for (const std::uint32_t i : scratch_.fresh) {
            Element& element = scratch_.elements[i];
            for (const std::uint32_t s : element.samples) {
                if (s < begin) continue;
                scratch_.samples[s].light =
                    light_.along(point_.position_m, scratch_.directions[s], scratch_.seen[s], element.aperture);
            }
            estimate(element);
        }
        known_samples_ = scratch_.directions.size();
    }

    /// Where all samples see the same, light is smooth: the three outer samples integrate a quadratic exactly, and the
    /// fourth tells the error. Where they do not, an edge runs through and each stands for the quarter around it.
    void estimate(Element& element) const {
        std::array<double, 4> density{}, mean{};
        double low = std::numeric_limits<double>::infinity(), high = 0.0;
        bool smooth = true;
        for (std::size_t k = 0; k < 4; ++k) {
            const Sample& sample = scratch_.samples[element.samples[k]];
            density[k] = sample.density;
            mean[k] = sample.light.mean();
            low = std::min(low, mean[k]);
            high = std::max(high, mean[k]);
            smooth = smooth && same_source(sample.light, scratch_.samples[element.samples[0]].light);
        }
        const double outer = density[1] + density[2] + density[3];
        const double all = density[0] + outer;
        const double weight = element.projected_solid_angle_sr;
        if (weight == 0.0) return;
        double by_quarters = 0.0, by_outer = 0.0;
        for (std::size_t k = 0; k < 4; ++k) {
            by_quarters += weight * density[k] / all * mean[k];
            if (k > 0) by_outer += weight * density[k] / outer * mean[k];
            element.weights_sr[k] = smooth ? (k > 0 ? weight * density[k] / outer : 0.0) : weight * density[k] / all;
        }
        element.illuminance_lx = smooth ? by_outer : by_quarters;
        element.error_lx = smooth ? std::abs(by_outer - by_quarters) : edge_error * weight * (high - low);
    }

    /// Divides in four the elements that matter most; false when there is no need, or no budget.
    bool refine(double tolerance) {
        double sum = 0.0, squared_error = 0.0;
        for (const Element& element : scratch_.elements) {
            sum += element.illuminance_lx;
            squared_error += element.error_lx * element.error_lx;
        }
        const double unobstructed =
            all_apertures_sr_ * light_.outdoors().horizontal_illuminance().value / pi;
        const double allowed = tolerance * std::max(sum, negligible_share * unobstructed);
        if (squared_error <= allowed * allowed) return false;

        // Errors are of either sign and independent, so their squares add up. The smallest ones that together use up
        // half of what is allowed can stay as they are.
        std::vector<std::uint32_t>& order = scratch_.order;
        order.resize(scratch_.elements.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            const double error_a = scratch_.elements[a].error_lx, error_b = scratch_.elements[b].error_lx;
            return error_a != error_b ? error_a > error_b : a < b;
        });
        std::size_t divided = 0;
        double staying = squared_error;
        while (divided < order.size() && staying > 0.5 * allowed * allowed) {
            if (scratch_.samples.size() + 12 * (divided + 1) > max_samples) break;
            const double error = scratch_.elements[order[divided]].error_lx;
            if (error == 0.0) break;
            staying -= error * error;
            ++divided;
        }
        scratch_.fresh.clear();
        for (std::size_t k = 0; k < divided; ++k) divide_in_four(order[k]);
        return divided > 0;
    }

    void divide_in_four(std::uint32_t position) {
        const Element parent = scratch_.elements[position];
        const auto& [a, b, c] = parent.corners;
        const glm::dvec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
        const std::array<Triangle, 4> parts{Triangle{bc, ca, ab}, Triangle{a, ab, ca}, Triangle{ab, b, bc},
                                            Triangle{ca, bc, c}};
        for (std::size_t k = 0; k < parts.size(); ++k) {
            Element part{.corners = parts[k],
                         .projected_solid_angle_sr =
                             std::max(0.0, glm::dot(point_.normal, vector_solid_angle(parts[k]))),
                         .aperture = parent.aperture};
            part.samples[0] = parent.samples[k];  // the centroid of the part is a sample of the whole
            place_samples(part, 1);
            if (k == 0) {
                scratch_.elements[position] = part;
                scratch_.fresh.push_back(position);
            } else {
                scratch_.fresh.push_back(static_cast<std::uint32_t>(scratch_.elements.size()));
                scratch_.elements.push_back(part);
            }
        }
    }

    SkyAndOutdoors total() const {
        SkyAndOutdoors sum;
        for (const Element& element : scratch_.elements) {
            for (std::size_t k = 0; k < 4; ++k) {
                sum.add(element.weights_sr[k], scratch_.samples[element.samples[k]].light);
            }
        }
        return sum;
    }

    const GatherPoint& point_;
    const ApertureLight& light_;
    const Visibility& visibility_;
    AdaptiveScratch& scratch_;
    double all_apertures_sr_ = 0.0;  // projected solid angle
    std::size_t known_samples_ = 0;
};

}  // namespace

SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch) {
    return Integration(point, light, visibility, scratch).run(tolerance);
}

}  // namespace naturel
