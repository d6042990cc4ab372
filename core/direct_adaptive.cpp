#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "core/direct_integrators.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

using ApertureElement = AdaptiveScratch::ApertureElement;
using ViewPart = AdaptiveScratch::ViewPart;

// Before any light is looked at, elements are divided until no edge is longer, as a chord of the unit sphere. Found by trial
// (direct_accuracy_test.cpp).
constexpr double first_edge = 0.7;
constexpr double first_edge_of_steps = 0.2;  ///< under a sky that jumps: the patches of a table are 0.2 wide

/// Near a bright spot elements are no longer than their distance from it, down to this chord: 3 degrees.
constexpr double spot_edge = 0.05;

/// Radon's rule of degree 5 on a triangle (Stroud 1971, T2 5-1): its centroid, three places towards the corners and three
/// towards the middles of the sides. A place is where it lies between centroid and corner; beyond it, if negative.
constexpr double root_15 = 3.872983346207417;
constexpr double towards_corner = (1.0 + root_15) / 7.0, towards_side = (1.0 - root_15) / 7.0;
constexpr double centroid_weight = 9.0 / 40.0, corner_weight = (155.0 - root_15) / 1200.0, side_weight = (155.0 + root_15) / 1200.0;
constexpr std::size_t place_count = 7;

/// Centroid and three places at t of the way to the corners integrate a quadratic exactly if these have this weight together.
constexpr double quadratic_weight(double t) { return 0.25 / (t * t); }

/// Standard deviation of the share of a triangle that lies on one side of a random straight edge, as estimated from a few
/// samples that do not all agree. Measured; docs/method.md, "Direct illuminance".
constexpr double unresolved_error = 0.15;

/// 99 of 100 normal deviates are below this; the errors of edges are of either sign.
constexpr double confidence = 2.6;

/// A point that sees nearly nothing need not know it more accurately than to this share of what its apertures would
/// give it if nothing stood in the way.
constexpr double negligible_share = 0.01;

/// Work ends here even if the tolerance is not met.
constexpr std::size_t max_elements = 16384;
constexpr int max_rounds = 10;  // elements are then 1/1000 as long: finer than rounding of rays leaves edges

/// Apertures closer than this are in the plane of the point: 10 times finer than what lifts sensors off surfaces.
constexpr double min_height_m = 1e-6;

/// Less than this of an aperture in front of the point is rounding of its outline at the horizon of the point: a contour
/// integral of edges of length 1 is good to some 1e-16.
constexpr double min_projected_sr = 1e-13;

/// Pieces of the view smaller than this share of it, per part of the tolerance, are not cut out: thousands of them would not be seen.
constexpr double least_share = 1e-6;

/// Error of a rule of degree 5, from the difference of two of degree 2: where these differ by little, it goes with the square.
double fifth_degree_error(double difference, double value) {
    return value > 0.0 ? difference * std::clamp(20.0 * difference / value, 0.1, 1.0) : difference;
}

double longest_edge(const ApertureElement& element) {
    const auto& [a, b, c] = element.corners;
    return std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
}

/// Halves an element across its longest edge, and returns the other half.
ApertureElement cut_off_half(ApertureElement& element) {
    const auto [a, b, c] = element.corners;
    const double ab = glm::length(b - a), bc = glm::length(c - b), ca = glm::length(a - c);
    const double longest = std::max({ab, bc, ca});
    ApertureElement other = element;
    const auto halve = [&](const glm::dvec3& from, const glm::dvec3& to, const glm::dvec3& tip) {
        const glm::dvec3 middle = glm::normalize(from + to);
        other.corners = {middle, to, tip};
        element.corners = {from, middle, tip};
    };
    if (longest == ab) halve(a, b, c);
    else if (longest == bc) halve(b, c, a);
    else halve(c, a, b);
    return other;
}

double projected_solid_angle(const ApertureElement& element, const glm::dvec3& normal) {
    return std::max(0.0, glm::dot(normal, vector_solid_angle(element.corners)));
}

/// Radon's rule on an element.
struct Places {
    std::array<glm::dvec3, place_count> directions;
    /// Projected solid angle per area of the plane through the corners, up to a factor: cos / r^2 times an obliquity that goes
    /// with 1 / r, where r is inverse to how far a unit direction reaches towards the plane.
    std::array<double, place_count> density;
    std::array<double, place_count> weights;  ///< density times that of the rule
    double all = 0.0;                         ///< sum of the weights
};

Places places_in(const ApertureElement& element, const glm::dvec3& normal) {
    Places places;
    const auto& [a, b, c] = element.corners;
    const glm::dvec3 centroid = (a + b + c) / 3.0;
    places.directions[0] = glm::normalize(centroid);
    for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec3 to_corner = element.corners[k] - centroid;
        places.directions[1 + k] = glm::normalize(centroid + towards_corner * to_corner);
        places.directions[4 + k] = glm::normalize(centroid + towards_side * to_corner);
    }
    const glm::dvec3 plane_normal = glm::cross(c - a, b - a);
    for (std::size_t k = 0; k < place_count; ++k) {
        const double reach = glm::dot(plane_normal, places.directions[k]);
        places.density[k] = std::max(0.0, glm::dot(normal, places.directions[k])) * reach * reach * reach;
        places.weights[k] = places.density[k] * (k == 0 ? centroid_weight : k < 4 ? corner_weight : side_weight);
        places.all += places.weights[k];
    }
    return places;
}

/// The view from a point in parts that show one thing each: geometry alone.
class ViewDivision {
public:
    /// Pieces that a relative error of `tolerance` would not show are not cut out.
    ViewDivision(const GatherPoint& point, const Outlook& outlook, const FacetTree& tree, double tolerance, const Visibility& visibility,
                 AdaptiveScratch& scratch)
        : point_(point), outlook_(outlook), tree_(tree), visibility_(visibility), memory_(scratch), tolerance_(tolerance) {
        memory_.parts.clear();
        memory_.corners.clear();
        memory_.elements.clear();
        memory_.rays.clear();
    }

    /// What is in front of the point, cut at its horizon, where sky and ground meet.
    void add_aperture(std::size_t aperture, const Opening& opening) {
        if (opening.inner || opening.height_m(point_.position_m) < min_height_m) return;
        const PlaneFrame frame = make_plane_frame(point_.position_m, opening.normal);
        for (const Opening::Part& part : opening.parts) {
            memory_.polygon.clear();
            for (const glm::dvec3& vertex : part.vertices_m) memory_.polygon.push_back(vertex - point_.position_m);
            keep_half_space(memory_.polygon, point_.normal, memory_.clipped);
            if (memory_.clipped.empty()) continue;
            if (is_small(memory_.clipped)) {
                add_above_and_below(aperture);
                continue;
            }
            // Edges near a half circle have no middle: quarters around the foot of the perpendicular have none.
            std::swap(memory_.polygon, memory_.clipped);
            for (const double x : {1.0, -1.0}) {
                for (const double y : {1.0, -1.0}) {
                    keep_half_space(memory_.polygon, x * frame.x, memory_.quarter);
                    if (memory_.quarter.empty()) continue;
                    keep_half_space(memory_.quarter, y * frame.y, memory_.clipped);
                    if (!memory_.clipped.empty()) add_above_and_below(aperture);
                }
            }
        }
    }

    /// The hemisphere in front of the point, in quarters.
    void add_open_air() {
        const PlaneFrame frame = make_plane_frame(point_.position_m, point_.normal);
        for (const auto& [x, y] : {std::pair{1.0, 1.0}, std::pair{-1.0, 1.0}, std::pair{-1.0, -1.0}, std::pair{1.0, -1.0}}) {
            memory_.clipped = {frame.normal, x * frame.x, y * frame.y};
            if (x * y > 0.0) std::swap(memory_.clipped[1], memory_.clipped[2]);
            add_above_and_below(0);
        }
    }

    /// Asks what is seen in every part. Where the answers differ, as those of a projection do for what is no larger than its cells, the
    /// triangles over the sides of a part are parts of their own.
    void look() {
        for (const ViewPart& part : memory_.parts) {
            const std::span<const glm::dvec3> corners = corners_of(part);
            const glm::dvec3 middle = middle_of(corners);
            for (std::size_t k = 0; k < corners.size(); ++k)
                memory_.rays.push_back(glm::normalize(middle + corners[k] + corners[(k + 1) % corners.size()]));
        }
        memory_.seen.resize(memory_.rays.size());
        visibility_.first_seen(point_, memory_.rays, memory_.seen);
        const FacetId* seen = memory_.seen.data();
        const std::size_t count = memory_.parts.size();
        for (std::size_t p = 0; p < count; ++p) {
            const ViewPart part = memory_.parts[p];
            memory_.parts[p].seen = seen[0];
            if (!part.mixed && std::any_of(seen, seen + part.count, [&](FacetId other) { return other != seen[0]; })) divide(p, seen);
            seen += part.count;
        }
    }

    static glm::dvec3 middle_of(std::span<const glm::dvec3> corners) {
        glm::dvec3 sum{};
        for (const glm::dvec3& corner : corners) sum += corner;
        return glm::normalize(sum);
    }

    const GatherPoint& point() const { return point_; }
    const Visibility& visibility() const { return visibility_; }
    bool is_empty() const { return memory_.parts.empty(); }
    bool is_dark(const ViewPart& part) const { return !part.mixed && outlook_.is_dark(middle_of(corners_of(part)), part.seen); }
    std::span<const glm::dvec3> corners_of(const ViewPart& part) const { return {memory_.corners.data() + part.first, part.count}; }
    double projected_solid_angle_sr() const { return all_parts_sr_; }

private:
    static bool is_small(std::span<const glm::dvec3> polygon) {
        const glm::dvec3 first = glm::normalize(polygon[0]);
        return std::all_of(polygon.begin(), polygon.end(), [&](const glm::dvec3& v) { return glm::dot(first, v) > 0.0; });
    }

    void add_above_and_below(std::size_t aperture) {
        for (const double up : {1.0, -1.0}) {
            keep_half_space(memory_.clipped, {0, 0, up}, memory_.half);
            if (!memory_.half.empty()) add_view(memory_.half, aperture);
        }
    }

    /// Cuts a convex view into parts that show one thing each.
    void add_view(std::span<const glm::dvec3> polygon, std::size_t aperture) {
        const double projected_sr = glm::dot(point_.normal, vector_solid_angle(polygon));
        if (!(projected_sr > min_projected_sr)) return;
        all_parts_sr_ += projected_sr;
        memory_.inwards.clear();
        for (std::size_t k = 0; k < polygon.size(); ++k) {
            const glm::dvec3 inward = glm::cross(polygon[k + 1 < polygon.size() ? k + 1 : 0], polygon[k]);
            const double length = glm::length(inward);
            if (length > 0.0) memory_.inwards.push_back(inward / length);
        }
        ViewPieces& pieces = memory_.pieces;
        pieces.start(polygon, least_share * tolerance_ * projected_sr);
        tree_.find(point_.position_m, memory_.inwards, memory_.facets);
        for (const FacetTree::Found& facet : memory_.facets) pieces.cut_along(point_.position_m, tree_, facet);
        outlook_.cut_further(point_.position_m, aperture, pieces);
        for (const ViewPieces::Piece& piece : pieces.pieces()) {
            const std::span<const glm::dvec3> corners = pieces.directions_of(piece);
            memory_.parts.push_back({.aperture = aperture,
                                     .mixed = !pieces.complete(),
                                     .first = static_cast<std::uint32_t>(memory_.corners.size()),
                                     .count = piece.count});
            memory_.corners.insert(memory_.corners.end(), corners.begin(), corners.end());
        }
    }

    /// seen: [corners of the part].
    void divide(std::size_t position, const FacetId* seen) {
        const ViewPart whole = memory_.parts[position];
        const glm::dvec3 middle = middle_of(corners_of(whole));
        for (std::uint32_t k = 0; k < whole.count; ++k) {
            ViewPart part = whole;
            part.seen = seen[k];
            part.first = static_cast<std::uint32_t>(memory_.corners.size());
            part.count = 3;
            const glm::dvec3 from = memory_.corners[whole.first + k], to = memory_.corners[whole.first + (k + 1) % whole.count];
            memory_.corners.insert(memory_.corners.end(), {middle, from, to});
            if (k == 0) memory_.parts[position] = part;
            else memory_.parts.push_back(part);
        }
    }

    const GatherPoint& point_;
    const Outlook& outlook_;
    const FacetTree& tree_;
    const Visibility& visibility_;
    AdaptiveScratch& memory_;
    double tolerance_;
    double all_parts_sr_ = 0.0;  // projected solid angle
};

class Integration {
public:
    /// view: has looked.
    Integration(const ViewDivision& view, const DirectionalLight& light, double tolerance, AdaptiveScratch& scratch)
        : view_(view), point_(view.point()), light_(light), memory_(scratch), tolerance_(tolerance) {}

    SkyAndOutdoors run() {
        find_bright_spot();
        for (std::uint32_t p = 0; p < memory_.parts.size(); ++p) add_elements(p);
        std::size_t estimated = 0;
        for (int round = 0;; ++round) {
            estimate(estimated);
            if (round == max_rounds || !refine(estimated)) break;
        }
        SkyAndOutdoors sum;
        for (const ApertureElement& element : memory_.elements) sum.add(element.value);
        return sum;
    }

private:
    /// The sun's surroundings, where the sky is clear there.
    void find_bright_spot() {
        const OutdoorLight& outdoors = light_.outdoors();
        const glm::dvec3& sun = outdoors.sun_direction;
        if (sun.z <= 0.0) return;
        // 0.2 rad from it, on the same altitude but for the second order.
        const double horizontal = std::hypot(sun.x, sun.y);
        const glm::dvec3 aside = horizontal > 1e-6 ? glm::dvec3{sun.y, -sun.x, 0.0} / horizontal : glm::dvec3{1, 0, 0};
        const double at_sun = outdoors.sky.luminance(sun).value;
        const double beside = outdoors.sky.luminance(std::cos(0.2) * sun + std::sin(0.2) * aside).value;
        if (at_sun > 1.05 * beside) bright_spot_ = sun;
    }

    /// Divides a part that is not dark into triangles of moderate size.
    void add_elements(std::uint32_t id) {
        const ViewPart& part = memory_.parts[id];
        const std::span<const glm::dvec3> corners = view_.corners_of(part);
        if (view_.is_dark(part)) return;
        const std::size_t first = memory_.elements.size();
        if (bright_spot_ && contains(corners, *bright_spot_)) {
            // Luminance has a cusp there: at a corner it does no harm.
            for (std::size_t k = 0; k < corners.size(); ++k)
                memory_.elements.push_back({.corners = {*bright_spot_, corners[k], corners[(k + 1) % corners.size()]}, .part = id});
        } else {
            for (std::size_t k = 2; k < corners.size(); ++k)
                memory_.elements.push_back({.corners = {corners[0], corners[k - 1], corners[k]}, .part = id});
        }
        halve_large_elements(first);
    }

    static bool contains(std::span<const glm::dvec3> polygon, const glm::dvec3& direction) {
        for (std::size_t k = 0; k < polygon.size(); ++k) {
            const glm::dvec3& next = polygon[k + 1 < polygon.size() ? k + 1 : 0];
            if (!(glm::dot(glm::cross(next, polygon[k]), direction) > 0.0)) return false;
        }
        return true;
    }

    void halve_large_elements(std::size_t first) {
        const double longest_allowed = memory_.parts[memory_.elements[first].part].mixed || !light_.outdoors().sky.is_smooth()
                                           ? first_edge_of_steps : first_edge;
        for (std::size_t i = first; i < memory_.elements.size();) {
            const auto& [a, b, c] = memory_.elements[i].corners;
            const double longest = longest_edge(memory_.elements[i]);
            bool small_enough = longest <= longest_allowed;
            if (small_enough && bright_spot_ && longest > spot_edge)
                small_enough = longest <= glm::length((a + b + c) / 3.0 - *bright_spot_);
            if (small_enough || memory_.elements.size() >= max_elements / 4) {
                measure(memory_.elements[i++]);
            } else {
                const ApertureElement other = cut_off_half(memory_.elements[i]);
                memory_.elements.push_back(other);
            }
        }
    }

    void measure(ApertureElement& element) const {
        element.projected_solid_angle_sr = projected_solid_angle(element, point_.normal);
    }

    /// Looks where several things may be seen, and estimates the elements from `first` on.
    void estimate(std::size_t first) {
        memory_.rays.clear();
        for (std::size_t i = first; i < memory_.elements.size(); ++i) {
            if (!memory_.parts[memory_.elements[i].part].mixed) continue;
            const auto directions = places_in(memory_.elements[i], point_.normal).directions;
            memory_.rays.insert(memory_.rays.end(), directions.begin(), directions.end());
        }
        memory_.seen.resize(memory_.rays.size());
        if (!memory_.rays.empty()) view_.visibility().first_seen(point_, memory_.rays, memory_.seen);
        const FacetId* seen = memory_.seen.data();
        for (std::size_t i = first; i < memory_.elements.size(); ++i) {
            ApertureElement& element = memory_.elements[i];
            const ViewPart& part = memory_.parts[element.part];
            estimate(element, part, part.mixed ? seen : nullptr);
            if (part.mixed) seen += place_count;
        }
    }

    /// seen: [place_count], or none where the part shows one thing.
    void estimate(ApertureElement& element, const ViewPart& part, const FacetId* seen) const {
        element.value = {};
        element.mean_lx = element.smooth_error_lx = element.edge_error_lx = 0.0;
        const double whole_sr = element.projected_solid_angle_sr;
        if (!(whole_sr > 0.0)) return;
        const Places places = places_in(element, point_.normal);
        if (!(places.all > 0.0)) return;
        const bool smooth = !part.mixed && (part.seen != FacetId::none || light_.outdoors().sky.is_smooth());
        std::array<double, place_count> mean{};
        double all_lx = 0.0, low = std::numeric_limits<double>::infinity(), high = 0.0;
        for (std::size_t k = 0; k < place_count; ++k) {
            const IncomingLight light =
                light_.along(point_.position_m, places.directions[k], seen ? seen[k] : part.seen, part.aperture);
            mean[k] = light.mean();
            all_lx += places.weights[k] * mean[k];
            low = std::min(low, mean[k]), high = std::max(high, mean[k]);
            element.value.add(whole_sr * places.weights[k] / places.all, light);
        }
        element.mean_lx = whole_sr * all_lx / places.all;
        if (!smooth) {
            element.edge_error_lx = unresolved_error * whole_sr * (high - low);
            return;
        }
        const auto by_quadratic = [&](double t, std::size_t first) {
            const double share = quadratic_weight(t);
            double weights = (1.0 - share) * places.density[0], sum = (1.0 - share) * places.density[0] * mean[0];
            for (std::size_t k = first; k < first + 3; ++k) {
                weights += share / 3.0 * places.density[k];
                sum += share / 3.0 * places.density[k] * mean[k];
            }
            return weights > 0.0 ? whole_sr * sum / weights : 0.0;
        };
        const double difference = std::abs(by_quadratic(towards_corner, 1) - by_quadratic(towards_side, 4));
        element.smooth_error_lx = fifth_degree_error(difference, element.mean_lx);
    }

    /// Divides in four the elements that matter most, and moves them behind `estimated`; false when there is no need, or no budget.
    bool refine(std::size_t& estimated) {
        double sum = 0.0, smooth_error = 0.0, squared_edge_error = 0.0;
        for (const ApertureElement& element : memory_.elements) {
            sum += element.mean_lx;
            smooth_error += element.smooth_error_lx;
            squared_edge_error += element.edge_error_lx * element.edge_error_lx;
        }
        const double unobstructed = view_.projected_solid_angle_sr() * light_.outdoors().horizontal_illuminance().value / pi;
        const double allowed = tolerance_ * std::max(sum, negligible_share * unobstructed);
        const auto total = [&] { return smooth_error + confidence * std::sqrt(std::max(0.0, squared_edge_error)); };
        if (!(total() > allowed)) return false;

        std::vector<ApertureElement>& elements = memory_.elements;
        const auto error_of = [&](std::uint32_t i) { return elements[i].smooth_error_lx + confidence * elements[i].edge_error_lx; };
        std::vector<std::uint32_t>& order = memory_.order;
        order.clear();
        // The smallest errors that together use up part of what is allowed can stay as they are.
        const double least = 0.05 * allowed / static_cast<double>(elements.size());
        for (std::uint32_t i = 0; i < elements.size(); ++i) {
            if (error_of(i) > least) order.push_back(i);
        }
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            const double error_a = error_of(a), error_b = error_of(b);
            return error_a != error_b ? error_a > error_b : a < b;
        });
        std::size_t divided = 0;
        while (divided < order.size() && total() > 0.6 * allowed && elements.size() + 3 * divided < max_elements) {
            const ApertureElement& element = elements[order[divided++]];
            smooth_error -= element.smooth_error_lx;
            squared_edge_error -= element.edge_error_lx * element.edge_error_lx;
        }
        if (divided == 0) return false;
        // The divided ones go to the end, their first quarters in their places.
        std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(divided));
        std::size_t kept = elements.size();
        for (std::size_t n = divided; n-- > 0;) std::swap(elements[order[n]], elements[--kept]);
        estimated = kept;
        for (std::size_t n = 0; n < divided; ++n) divide_in_four(kept + n);
        return true;
    }

    void divide_in_four(std::size_t position) {
        ApertureElement quarter = memory_.elements[position];
        const auto [a, b, c] = quarter.corners;
        const glm::dvec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
        quarter.corners = {ab, bc, ca};
        measure(quarter);
        memory_.elements[position] = quarter;
        for (const auto& corners : {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}}) {
            quarter.corners = corners;
            measure(quarter);
            memory_.elements.push_back(quarter);
        }
    }

    const ViewDivision& view_;
    const GatherPoint& point_;
    const DirectionalLight& light_;
    AdaptiveScratch& memory_;
    double tolerance_;
    std::optional<glm::dvec3> bright_spot_;
};

SkyAndOutdoors integrate(ViewDivision& view, const DirectionalLight& light, double tolerance, AdaptiveScratch& scratch) {
    if (view.is_empty()) return {};
    view.look();
    return Integration(view, light, tolerance, scratch).run();
}

void spread_rays(ViewDivision& view, const RaySpacing& spacing, AdaptiveScratch& memory, std::vector<ViewRay>& rays) {
    rays.clear();
    if (view.is_empty()) return;
    view.look();
    const glm::dvec3& normal = view.point().normal;
    const auto add_element = [&](const ApertureElement& element, const ViewPart& part) {
        const double whole_sr = projected_solid_angle(element, normal);
        const Places places = places_in(element, normal);
        if (!(whole_sr > 0.0) || !(places.all > 0.0)) return;
        for (std::size_t k = 0; k < place_count; ++k)
            rays.push_back({places.directions[k], whole_sr * places.weights[k] / places.all, part.seen, part.aperture});
    };
    std::vector<ApertureElement>& waiting = memory.elements;
    for (const bool mixed : {false, true}) {
        const std::size_t first = rays.size();
        for (const ViewPart& part : memory.parts) {
            if (part.mixed != mixed || view.is_dark(part)) continue;
            const std::span<const glm::dvec3> corners = view.corners_of(part);
            const bool of_sky = mixed || (part.seen == FacetId::none && ViewDivision::middle_of(corners).z >= 0.0);
            const double longest_allowed = of_sky ? spacing.sky : spacing.surfaces;
            waiting.clear();
            for (std::size_t k = 2; k < corners.size(); ++k) waiting.push_back({.corners = {corners[0], corners[k - 1], corners[k]}});
            while (!waiting.empty()) {
                if (longest_edge(waiting.back()) <= longest_allowed) {
                    add_element(waiting.back(), part);
                    waiting.pop_back();
                } else {
                    const ApertureElement other = cut_off_half(waiting.back());
                    waiting.push_back(other);
                }
            }
        }
        if (!mixed || rays.size() == first) continue;
        memory.rays.clear();
        for (std::size_t k = first; k < rays.size(); ++k) memory.rays.push_back(rays[k].direction);
        memory.seen.resize(memory.rays.size());
        view.visibility().first_seen(view.point(), memory.rays, memory.seen);
        for (std::size_t k = first; k < rays.size(); ++k) rays[k].seen = memory.seen[k - first];
    }
}

void add_apertures(ViewDivision& view, std::span<const Opening> openings) {
    for (std::size_t k = 0; k < openings.size(); ++k) view.add_aperture(k, openings[k]);
}

}  // namespace

void spread_rays(const GatherPoint& point, const ApertureOutlook& apertures, const FacetTree& tree, double tolerance,
                 const Visibility& visibility, const RaySpacing& spacing, AdaptiveScratch& scratch, std::vector<ViewRay>& rays) {
    ViewDivision view(point, apertures, tree, tolerance, visibility, scratch);
    add_apertures(view, apertures.openings());
    spread_rays(view, spacing, scratch, rays);
}

void spread_rays_in_open_air(const GatherPoint& point, const OpenAir& air, const FacetTree& tree, double tolerance,
                             const Visibility& visibility, const RaySpacing& spacing, AdaptiveScratch& scratch,
                             std::vector<ViewRay>& rays) {
    ViewDivision view(point, air, tree, tolerance, visibility, scratch);
    view.add_open_air();
    spread_rays(view, spacing, scratch, rays);
}

SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, const FacetTree& tree, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch) {
    ViewDivision view(point, light.outlook(), tree, tolerance, visibility, scratch);
    add_apertures(view, light.openings());
    return integrate(view, light, tolerance, scratch);
}

SkyAndOutdoors integrate_open_air(const GatherPoint& point, const OpenAirLight& light, const FacetTree& tree, double tolerance,
                                  const Visibility& visibility, AdaptiveScratch& scratch) {
    ViewDivision view(point, light.outlook(), tree, tolerance, visibility, scratch);
    view.add_open_air();
    return integrate(view, light, tolerance, scratch);
}

}  // namespace naturel
