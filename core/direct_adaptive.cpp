#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <optional>

#include "core/direct_integrators.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

using Edge = AdaptiveScratch::Edge;
using EdgePoint = AdaptiveScratch::EdgePoint;
using ApertureElement = AdaptiveScratch::ApertureElement;
using Sample = AdaptiveScratch::Sample;
using Form = AdaptiveScratch::Form;
constexpr std::uint32_t none = AdaptiveScratch::none;

// Before any light is looked at, elements are divided to these limits, lest a glazing bar or a piece of furniture fall
// between the samples and an estimate from too few of them look converged. Found by trial (direct_accuracy_test.cpp).
constexpr double first_edge = 0.5;          // longest edge, as a chord of the unit sphere
constexpr double first_share = 1.0 / 64.0;  // of the projected solid angle of all apertures together
constexpr std::uint32_t extra_probes = 3;   // where other elements of the part see several things
constexpr double least_share = 1.0 / 24.0;  // of that of a convex part of an aperture

/// Near a bright spot elements are no longer than half their distance from it, down to this chord: 3 degrees.
constexpr double spot_edge = 0.05;

/// Standard deviation of the share of a triangle that lies on one side of a random straight edge, as estimated from six
/// samples that do not all agree. Measured; docs/method.md, "Direct illuminance".
constexpr double unresolved_error = 0.15;

/// How far an edge may stray from its chord, as a share of the distance to the samples that did not see it stray.
constexpr double stray = 0.1;

/// 99 of 100 normal deviates are below this; the errors of edges are of either sign.
constexpr double confidence = 2.6;

/// A point that sees nearly nothing need not know it more accurately than to this share of what its apertures would
/// give it if nothing stood in the way.
constexpr double negligible_share = 0.01;

/// Work ends here even if the tolerance is not met.
constexpr std::size_t max_samples = 16384;
constexpr std::uint32_t max_rounds = 10;  // elements are then 1/1000 as long: finer than rounding of rays leaves edges
constexpr std::size_t samples_per_division = 9;  // at most: three new edges inside and six halves

/// Apertures closer than this are in the plane of the point: 10 times finer than what lifts sensors off surfaces.
constexpr double min_height_m = 1e-6;

/// Less than this of an aperture in front of the point is rounding of its outline at the horizon of the point: a contour
/// integral of edges of length 1 is good to some 1e-16.
constexpr double min_projected_sr = 1e-13;

/// Rays keep this share of an aperture's size from its outline, so that they do not graze walls and reveals: 0.1 mm
/// at 1 m, several times what single precision makes of places in a building (and of lifting points off surfaces).
constexpr double inset = 1e-4;

/// Error of a rule of second order, from its difference to one of first order: small differences mean much smaller errors.
double second_order_error(double difference, double value) {
    return value > 0.0 ? difference * std::clamp(25.0 * difference / value, 0.1, 1.0) : difference;
}

/// In [0, 1): a hash of a number (SplitMix64, Steele et al. 2014).
double uniform_from(std::uint64_t number) {
    std::uint64_t z = (number + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/// Where the outline of an element passes from one source to another.
struct Crossing {
    glm::dvec3 place{};      // between the two samples that saw them
    double width = 0.0;      // chord between these
    std::uint32_t side = 0;  // of the element
    std::uint32_t before = 0, after = 0;  // samples
    std::uint32_t edge = 0;
};

/// Outline of an element: its corners and the crossings between them, counter-clockwise.
struct Outline {
    static constexpr std::size_t max_crossings = 4;
    std::array<Crossing, max_crossings> crossings{};
    std::size_t count = 0;
    bool readable = true;  // no crowded edge, and not more crossings than fit
};

class Integration {
public:
    Integration(const GatherPoint& point, const DirectionalLight& light, double tolerance, const Visibility& visibility,
                AdaptiveScratch& scratch)
        : point_(point),
          light_(light),
          visibility_(visibility),
          mesh_(scratch),
          tolerance_(tolerance),
          crossing_width_(std::clamp(32.0 * tolerance, 1.0 / 512.0, 1.0 / 16.0)),
          check_offset_(std::clamp(0.15 * std::sqrt(tolerance / 1e-3), 0.03, 0.3)) {
        mesh_.parts.clear();
        mesh_.elements.clear();
        mesh_.edges.clear();
        mesh_.samples.clear();
        mesh_.asked.clear();
        mesh_.light.clear();
        mesh_.fresh.clear();
    }

    /// What is in front of the point, cut at its horizon, where sky and ground meet.
    void add_aperture(std::size_t aperture, const Opening& opening) {
        if (opening.inner || opening.height_m(point_.position_m) < min_height_m) return;
        for (const Opening::Part& part : opening.parts) {
            mesh_.polygon.clear();
            for (const glm::dvec3& vertex : part.vertices_m) mesh_.polygon.push_back(vertex - point_.position_m);
            keep_half_space(mesh_.polygon, point_.normal, mesh_.clipped);
            add_above_and_below(aperture);
        }
    }

    /// The hemisphere in front of the point, in quarters.
    void add_open_air() {
        const PlaneFrame frame = make_plane_frame(point_.position_m, point_.normal);
        for (const auto& [x, y] : {std::pair{1.0, 1.0}, std::pair{-1.0, 1.0}, std::pair{-1.0, -1.0}, std::pair{1.0, -1.0}}) {
            mesh_.clipped = {frame.normal, x * frame.x, y * frame.y};
            if (x * y > 0.0) std::swap(mesh_.clipped[1], mesh_.clipped[2]);
            add_above_and_below(0);
        }
    }

    SkyAndOutdoors run() {
        if (mesh_.elements.empty()) return {};
        for (const ApertureElement& element : mesh_.elements) all_parts_sr_ += element.projected_solid_angle_sr;
        find_bright_spot();
        halve_large_elements();
        add_probes();
        look();
        do {
            locate_crossings();
            estimate_changed();
            if (round_ == 0 && search_mixed_parts()) estimate_changed();
            ++round_;
        } while (refine() && (look(), true));
        SkyAndOutdoors sum;
        for (const ApertureElement& element : mesh_.elements) sum.add(element.value);
        return sum;
    }

private:
    void add_above_and_below(std::size_t aperture) {
        for (const double up : {1.0, -1.0}) {
            keep_half_space(mesh_.clipped, {0, 0, up}, mesh_.half);
            if (!mesh_.half.empty()) add_polygon(mesh_.half, aperture);
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
        const auto first = static_cast<std::uint32_t>(mesh_.samples.size());
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
            ApertureElement element{.corners = {hub, from, to}, .edges = {before, rim, after}, .value = {}};
            measure(element);
            mesh_.elements.push_back(element);
            before = after;
        }
    }

    const glm::dvec3& direction(std::uint32_t sample) const { return mesh_.samples[sample].direction; }
    std::uint32_t source(std::uint32_t sample) const { return mesh_.samples[sample].source; }

    std::uint32_t add_sample(const glm::dvec3& direction, std::uint32_t part) {
        const auto id = static_cast<std::uint32_t>(mesh_.samples.size());
        mesh_.samples.push_back({.direction = direction, .part = part});
        mesh_.asked.push_back(id);
        return id;
    }

    /// A sample that need not be asked for: it lies among others that saw the same.
    std::uint32_t add_known_sample(const glm::dvec3& direction, std::uint32_t like) {
        const Sample& known = mesh_.samples[like];
        const Sample sample{.direction = direction, .part = known.part, .seen = known.seen, .source = known.source};
        mesh_.samples.push_back(sample);
        return static_cast<std::uint32_t>(mesh_.samples.size() - 1);
    }

    /// like: a sample of the source that is known to be all along the edge; none: to be asked for.
    std::uint32_t add_edge(std::uint32_t a, std::uint32_t b, std::uint32_t like = none) {
        const glm::dvec3 middle = glm::normalize(direction(a) + direction(b));
        Edge edge{.a = a, .b = b};
        edge.middle = like == none ? add_sample(middle, mesh_.samples[a].part) : add_known_sample(middle, like);
        edge.points[0] = {0.0, a};
        edge.points[1] = {1.0, b};
        edge.point_count = 2;
        edge.changed = round_;
        mesh_.edges.push_back(edge);
        return static_cast<std::uint32_t>(mesh_.edges.size() - 1);
    }

    void measure(ApertureElement& element) const {
        const auto& [a, b, c] = element.corners;
        const std::array<glm::dvec3, 3> triangle{direction(a), direction(b), direction(c)};
        element.projected_solid_angle_sr = std::max(0.0, glm::dot(point_.normal, vector_solid_angle(triangle)));
    }

    /// The half of an edge at one of its ends.
    std::uint32_t half_of(std::uint32_t id, std::uint32_t end) {
        if (mesh_.edges[id].halves == none) {
            const Edge whole = mesh_.edges[id];
            std::array<Edge, 2> halves{};
            for (std::uint32_t k = 0; k < whole.point_count; ++k) {
                const EdgePoint& point = whole.points[k];
                if (point.share <= 0.0 || point.share >= 1.0 || point.share == 0.5) continue;
                Edge& half = halves[point.share < 0.5 ? 0 : 1];
                half.points[half.point_count++] = {point.share < 0.5 ? 2.0 * point.share : 2.0 * point.share - 1.0, point.sample};
            }
            const std::array<std::uint32_t, 3> ends{whole.a, whole.middle, whole.b};
            for (std::size_t side = 0; side < 2; ++side) {
                // Known only where the whole edge has been looked at and shows one source on either side of the half's middle.
                const bool plain = halves[side].point_count == 0 && whole.point_count > 2 && !whole.crowded &&
                                   source(ends[side]) == source(ends[side + 1]) && plain_halves_;
                const std::uint32_t half = add_edge(ends[side], ends[side + 1], plain ? ends[side] : none);
                if (side == 0) mesh_.edges[id].halves = half;
                Edge& made = mesh_.edges[half];
                made.parent = id;
                for (std::uint32_t k = 0; k < halves[side].point_count; ++k) made.points[k + 1] = halves[side].points[k];
                made.point_count = halves[side].point_count + 2;
                made.points[made.point_count - 1] = {1.0, ends[side + 1]};
            }
        }
        return mesh_.edges[id].halves + (mesh_.edges[id].a == end ? 0 : 1);
    }

    /// The sun's surroundings, where the sky is clear there.
    void find_bright_spot() {
        const OutdoorLight& outdoors = light_.outdoors();
        const glm::dvec3& sun = outdoors.sun_direction;
        if (sun.z <= 0.0) return;
        const glm::dvec3 aside = glm::normalize(glm::cross(sun, std::abs(sun.x) < 0.5 ? glm::dvec3{1, 0, 0} : glm::dvec3{0, 1, 0}));
        const double at_sun = outdoors.sky.luminance(sun).value;
        // 0.2 rad from it, at the same altitude or nearly so.
        const double beside = outdoors.sky.luminance(glm::normalize(sun + 0.2 * glm::dvec3{aside.x, aside.y, 0.0})).value;
        if (at_sun > 1.2 * beside) bright_spot_ = sun;
    }

    void halve_large_elements() {
        const double largest_sr = first_share * all_parts_sr_;
        for (const ApertureElement& element : mesh_.elements)
            mesh_.parts[mesh_.samples[element.corners[0]].part].projected_solid_angle_sr += element.projected_solid_angle_sr;
        for (std::size_t i = 0; i < mesh_.elements.size();) {
            const ApertureElement whole = mesh_.elements[i];
            std::size_t k = 0;
            double longest = 0.0;
            for (std::size_t side = 0; side < 3; ++side) {
                const Edge& edge = mesh_.edges[whole.edges[side]];
                const double length = glm::length(direction(edge.b) - direction(edge.a));
                if (length > longest) longest = length, k = side;
            }
            bool small_enough = longest <= first_edge && whole.projected_solid_angle_sr <= largest_sr &&
                                whole.projected_solid_angle_sr <=
                                    least_share * mesh_.parts[mesh_.samples[whole.corners[0]].part].projected_solid_angle_sr;
            if (small_enough && bright_spot_ && longest > spot_edge) {
                const glm::dvec3 middle = (direction(whole.corners[0]) + direction(whole.corners[1]) + direction(whole.corners[2])) / 3.0;
                small_enough = longest <= glm::length(middle - *bright_spot_);
            }
            if (small_enough || mesh_.samples.size() + samples_per_division > max_samples / 4) {
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
            measure(part);
            mesh_.elements.push_back(part);
        }
    }

    /// Corners and middles stand in rows, between which a glazing bar can hide: probes do not.
    void add_probes() {
        for (std::size_t i = 0; i < mesh_.elements.size(); ++i) {
            ApertureElement& element = mesh_.elements[i];
            element.probe = add_sample(inside(element, i), mesh_.samples[element.corners[0]].part);
        }
    }

    /// A direction anywhere in an element.
    glm::dvec3 inside(const ApertureElement& element, std::uint64_t number) const {
        double s = uniform_from(2 * number), t = uniform_from(2 * number + 1);
        if (s + t > 1.0) s = 1.0 - s, t = 1.0 - t;
        const auto& [a, b, c] = element.corners;
        return glm::normalize((1.0 - s - t) * direction(a) + s * direction(b) + t * direction(c));
    }

    bool contains(const ApertureElement& element, std::uint32_t sample) const {
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec3& from = direction(element.corners[k]);
            const glm::dvec3& to = direction(element.corners[(k + 1) % 3]);
            if (glm::dot(glm::cross(to, from), direction(sample)) < 0.0) return false;
        }
        return true;
    }

    /// Asks what is seen in the directions that are new, and takes down what edges learn from their middles.
    void look() {
        const std::size_t count = mesh_.asked.size();
        if (count > 0) {
            mesh_.rays.resize(count);
            mesh_.seen.resize(count);
            for (std::size_t i = 0; i < count; ++i) {
                const Sample& sample = mesh_.samples[mesh_.asked[i]];
                mesh_.rays[i] =
                    glm::normalize(sample.direction + inset * (mesh_.parts[sample.part].inside - sample.direction));
            }
            visibility_.first_seen(point_, mesh_.rays, mesh_.seen);
            for (std::size_t i = 0; i < count; ++i) {
                Sample& sample = mesh_.samples[mesh_.asked[i]];
                sample.seen = mesh_.seen[i];
                sample.source = light_.source_along(point_.position_m, mesh_.rays[i], mesh_.seen[i],
                                                    mesh_.parts[sample.part].aperture);
            }
            mesh_.asked.clear();
        }
        for (; settled_edges_ < mesh_.edges.size(); ++settled_edges_) {
            add_point(static_cast<std::uint32_t>(settled_edges_), 0.5, mesh_.edges[settled_edges_].middle);
        }
    }

    void add_point(std::uint32_t id, double share, std::uint32_t sample) {
        Edge& edge = mesh_.edges[id];
        const auto same = [&](std::uint32_t k) { return source(edge.points[k].sample) == source(sample); };
        if (edge.point_count == Edge::max_points) drop_plain_points(edge);
        std::uint32_t place = 1;
        while (edge.points[place].share < share) ++place;
        const bool news = !same(place - 1) || !same(place);
        if (edge.point_count == Edge::max_points) {
            edge.crowded = true;
        } else {
            std::copy_backward(edge.points.begin() + place, edge.points.begin() + edge.point_count,
                               edge.points.begin() + edge.point_count + 1);
            edge.points[place] = {share, sample};
            ++edge.point_count;
        }
        if (!news) return;
        for (std::uint32_t k = id; k != none; k = mesh_.edges[k].parent) mesh_.edges[k].changed = round_;
    }

    /// Forgets points between others of the same source.
    void drop_plain_points(Edge& edge) const {
        std::uint32_t kept = 1;
        for (std::uint32_t k = 1; k < edge.point_count; ++k) {
            const bool plain = k + 1 < edge.point_count &&
                               source(edge.points[kept - 1].sample) == source(edge.points[k].sample) &&
                               source(edge.points[k].sample) == source(edge.points[k + 1].sample);
            if (!plain) edge.points[kept++] = edge.points[k];
        }
        edge.point_count = kept;
    }

    glm::dvec3 on_edge(const Edge& edge, double share) const {
        return glm::normalize((1.0 - share) * direction(edge.a) + share * direction(edge.b));
    }

    void read_edge(std::uint32_t id, bool backwards, std::uint32_t side, Outline& outline) const {
        const Edge& edge = mesh_.edges[id];
        if (edge.halves != none) {
            read_edge(edge.halves + (backwards ? 1 : 0), backwards, side, outline);
            read_edge(edge.halves + (backwards ? 0 : 1), backwards, side, outline);
            return;
        }
        outline.readable = outline.readable && !edge.crowded;
        for (std::uint32_t k = 1; k < edge.point_count; ++k) {
            const std::uint32_t at = backwards ? edge.point_count - 1 - k : k - 1;
            const EdgePoint& low = edge.points[at];
            const EdgePoint& high = edge.points[at + 1];
            if (source(low.sample) == source(high.sample)) continue;
            if (outline.count == Outline::max_crossings) {
                outline.readable = false;
                return;
            }
            Crossing& crossing = outline.crossings[outline.count++];
            crossing.place = on_edge(edge, 0.5 * (low.share + high.share));
            crossing.width = (high.share - low.share) * glm::length(direction(edge.b) - direction(edge.a));
            crossing.side = side;
            crossing.before = backwards ? high.sample : low.sample;
            crossing.after = backwards ? low.sample : high.sample;
            crossing.edge = id;
        }
    }

    Outline outline_of(const ApertureElement& element) const {
        Outline outline;
        for (std::uint32_t side = 0; side < 3; ++side) {
            read_edge(element.edges[side], mesh_.edges[element.edges[side]].a != element.corners[side], side, outline);
        }
        return outline;
    }

    bool has_changed(const ApertureElement& element) const {
        if (element.judged == none) return true;
        for (const std::uint32_t edge : element.edges) {
            if (mesh_.edges[edge].changed > element.judged) return true;
        }
        return false;
    }

    /// On the sides of new elements that straight edges may cut, finds where what is seen changes, by bisection.
    void locate_crossings() {
        mesh_.crossed.clear();
        for (const ApertureElement& element : mesh_.elements) {
            if (!has_changed(element)) continue;
            const Outline outline = outline_of(element);
            if (!outline.readable || !may_be_cut(outline)) continue;
            for (std::size_t k = 0; k < outline.count; ++k) mesh_.crossed.push_back(outline.crossings[k].edge);
        }
        std::sort(mesh_.crossed.begin(), mesh_.crossed.end());
        mesh_.crossed.erase(std::unique(mesh_.crossed.begin(), mesh_.crossed.end()), mesh_.crossed.end());
        while (!mesh_.crossed.empty() && mesh_.samples.size() + 3 * mesh_.crossed.size() <= max_samples) {
            mesh_.order.clear();  // sample by sample, the edge
            shares_.clear();
            auto& kept = mesh_.crossed;
            std::size_t write = 0;
            for (const std::uint32_t id : kept) {
                const Edge& edge = mesh_.edges[id];
                if (edge.crowded) continue;  // could not take down what it learns
                bool wide = false;
                for (std::uint32_t k = 1; k < edge.point_count; ++k) {
                    const EdgePoint low = edge.points[k - 1], high = edge.points[k];
                    if (source(low.sample) == source(high.sample) || high.share - low.share <= crossing_width_) continue;
                    add_sample(on_edge(edge, 0.5 * (low.share + high.share)), mesh_.samples[edge.a].part);
                    mesh_.order.push_back(id);
                    shares_.push_back(0.5 * (low.share + high.share));
                    wide = true;
                }
                if (wide) kept[write++] = id;
            }
            kept.resize(write);
            if (mesh_.order.empty()) return;
            auto sample = static_cast<std::uint32_t>(mesh_.samples.size() - mesh_.order.size());
            look();
            for (std::size_t k = 0; k < mesh_.order.size(); ++k) add_point(mesh_.order[k], shares_[k], sample++);
            shares_.clear();
        }
    }

    static bool may_be_cut(const Outline& outline) {
        const auto& c = outline.crossings;
        if (outline.count == 2) return c[0].side != c[1].side;
        return outline.count == 4;
    }

    /// Light along the direction of a sample.
    const IncomingLight& light_of(std::uint32_t id) {
        Sample& sample = mesh_.samples[id];
        if (sample.light == none) {
            sample.light = static_cast<std::uint32_t>(mesh_.light.size());
            mesh_.light.push_back(sample.source == 0 ? IncomingLight{} : light_towards(sample.direction, id));
        }
        return mesh_.light[sample.light];
    }

    /// Light along a direction in which the same is seen as by a sample.
    IncomingLight light_towards(const glm::dvec3& direction, std::uint32_t like) const {
        const Sample& sample = mesh_.samples[like];
        const AdaptiveScratch::ViewPart& part = mesh_.parts[sample.part];
        // Off the outline by next to nothing: the horizon belongs to the sky above it and to the ground below it.
        return light_.along(point_.position_m, direction + 1e-9 * (part.inside - direction), sample.seen, part.aperture);
    }

    /// A part of an element with one source.
    struct Piece {
        std::array<glm::dvec3, 8> corners{};
        std::size_t count = 0;
        std::uint32_t sample = none;  // one that saw its source
        void add(const glm::dvec3& corner) { corners[count++] = corner; }
        glm::dvec3 centre() const {
            glm::dvec3 sum{};
            for (std::size_t k = 0; k < count; ++k) sum += corners[k];
            return glm::normalize(sum);
        }
    };
    struct Chord {
        std::size_t from = 0, to = 0;  // crossings
        std::size_t inner = 0, outer = 0;  // pieces
    };
    struct Cut {
        std::array<Piece, 3> pieces{};
        std::size_t piece_count = 0;
        std::array<Chord, 2> chords{};
        std::size_t chord_count = 0;
    };

    /// What lies along the outline from one crossing to another.
    void follow(const ApertureElement& element, const Outline& outline, std::size_t from, std::size_t to, Piece& piece) const {
        const Crossing& start = outline.crossings[from];
        const Crossing& end = outline.crossings[to];
        piece.add(start.place);
        const std::size_t corners = to > from ? end.side - start.side : 3 + end.side - start.side;
        for (std::size_t k = 1; k <= corners; ++k) piece.add(direction(element.corners[(start.side + k) % 3]));
        piece.add(end.place);
    }

    std::optional<Cut> cut_of(const ApertureElement& element, const Outline& outline) const {
        if (!outline.readable || !may_be_cut(outline)) return {};
        Cut cut;
        const auto& c = outline.crossings;
        if (outline.count == 2) {
            // On the way round each source is left for the other.
            if (source(c[0].after) != source(c[1].before) || source(c[1].after) != source(c[0].before)) return {};
            follow(element, outline, 0, 1, cut.pieces[0]);
            follow(element, outline, 1, 0, cut.pieces[1]);
            cut.pieces[0].sample = c[0].after;
            cut.pieces[1].sample = c[1].after;
            cut.piece_count = 2;
            cut.chords[0] = {0, 1, 0, 1};
            cut.chord_count = 1;
            return cut;
        }
        std::array<std::uint32_t, 4> arc{};
        for (std::size_t k = 0; k < 4; ++k) arc[k] = source(c[k].after);
        const auto length = [&](std::size_t a, std::size_t b) { return glm::length(c[a].place - c[b].place); };
        // Two corners of what is between are cut off: arcs 0 and 2, or arcs 1 and 3.
        const bool even = arc[1] == arc[3], odd = arc[0] == arc[2];
        if (!even && !odd) return {};
        const std::size_t first = even && (!odd || length(0, 1) + length(2, 3) <= length(1, 2) + length(3, 0)) ? 0 : 1;
        const std::array<std::size_t, 4> order{first, first + 1, first + 2, (first + 3) % 4};
        if (c[order[0]].side == c[order[1]].side || c[order[2]].side == c[order[3]].side) return {};
        follow(element, outline, order[0], order[1], cut.pieces[0]);
        follow(element, outline, order[2], order[3], cut.pieces[1]);
        follow(element, outline, order[1], order[2], cut.pieces[2]);
        follow(element, outline, order[3], order[0], cut.pieces[2]);
        cut.pieces[0].sample = c[order[0]].after;
        cut.pieces[1].sample = c[order[2]].after;
        cut.pieces[2].sample = c[order[1]].after;
        cut.piece_count = 3;
        cut.chords[0] = {order[0], order[1], 0, 2};
        cut.chords[1] = {order[2], order[3], 1, 2};
        cut.chord_count = 2;
        return cut;
    }

    /// Estimates what is new or has learnt from its neighbours.
    void estimate_changed() {
        mesh_.checks.clear();
        for (std::size_t i = 0; i < mesh_.elements.size(); ++i) {
            ApertureElement& element = mesh_.elements[i];
            if (!has_changed(element)) continue;
            element.judged = round_;
            element.form = Form::unresolved;
            if (element.projected_solid_angle_sr == 0.0) {
                set_dark(element);
                continue;
            }
            const Outline outline = outline_of(element);
            if (outline.count == 0 && outline.readable) {
                if (element.probe == none || source(element.probe) == source(element.corners[0])) {
                    estimate_whole(element);
                } else {
                    estimate_unresolved(element);
                }
            } else if (const std::optional<Cut> cut = cut_of(element, outline)) {
                ask_about(static_cast<std::uint32_t>(i), outline, *cut);
            } else {
                estimate_unresolved(element);
            }
        }
        look();
        for (const AdaptiveScratch::CutCheck& check : mesh_.checks) {
            ApertureElement& element = mesh_.elements[check.element];
            bool as_expected = true;
            for (std::uint32_t k = 0; k < check.count; ++k)
                as_expected = as_expected && source(check.first_sample + k) == check.expected[k];
            const Outline outline = outline_of(element);
            const std::optional<Cut> cut = as_expected ? cut_of(element, outline) : std::nullopt;
            if (cut && probe_agrees(element, outline, *cut)) {
                estimate_cut(element, outline, *cut);
            } else {
                estimate_unresolved(element);
            }
        }
    }

    /// Bars and legs come in numbers and are longer than wide: where something stands in front of a part, its elements that
    /// saw nothing of it are looked at again. True if something was found.
    bool search_mixed_parts() {
        for (AdaptiveScratch::ViewPart& part : mesh_.parts) part.source = none;
        for (const ApertureElement& element : mesh_.elements) {
            AdaptiveScratch::ViewPart& part = mesh_.parts[mesh_.samples[element.corners[0]].part];
            const std::uint32_t own = source(element.corners[0]);
            if (part.source == none) part.source = own;
            if (element.form != Form::whole || own != part.source) part.mixed = true;
        }
        const auto first = static_cast<std::uint32_t>(mesh_.samples.size());
        mesh_.fresh.clear();
        for (std::uint32_t i = 0; i < mesh_.elements.size(); ++i) {
            const ApertureElement& element = mesh_.elements[i];
            const std::uint32_t part = mesh_.samples[element.corners[0]].part;
            if (element.form != Form::whole || !mesh_.parts[part].mixed) continue;
            mesh_.fresh.push_back(i);
            for (std::size_t k = 0; k < extra_probes; ++k)
                add_sample(inside(element, 7919 * (i + 1) + k), part);
        }
        look();
        bool found = false;
        for (std::size_t n = 0; n < mesh_.fresh.size(); ++n) {
            ApertureElement& element = mesh_.elements[mesh_.fresh[n]];
            for (std::uint32_t k = 0; k < extra_probes; ++k) {
                const std::uint32_t sample = first + static_cast<std::uint32_t>(n) * extra_probes + k;
                if (source(sample) == source(element.corners[0])) continue;
                element.probe = sample;
                element.judged = none;
                found = true;
            }
        }
        return found;
    }

    double check_distance(const Outline& outline, const Chord& chord, const glm::dvec3& middle, const Piece& piece) const {
        const double reach = glm::length(piece.centre() - middle);
        const double width = std::max(outline.crossings[chord.from].width, outline.crossings[chord.to].width);
        return std::min(0.7 * reach, std::max(check_offset_ * reach, width));
    }

    void ask_about(std::uint32_t i, const Outline& outline, const Cut& cut) {
        AdaptiveScratch::CutCheck check{.element = i, .first_sample = static_cast<std::uint32_t>(mesh_.samples.size())};
        for (std::size_t k = 0; k < cut.chord_count; ++k) {
            const Chord& chord = cut.chords[k];
            const glm::dvec3 middle = 0.5 * (outline.crossings[chord.from].place + outline.crossings[chord.to].place);
            for (const std::size_t side : {chord.inner, chord.outer}) {
                const Piece& piece = cut.pieces[side];
                const glm::dvec3 away = piece.centre() - middle;
                const double distance = check_distance(outline, chord, middle, piece);
                add_sample(glm::normalize(middle + (distance / std::max(1e-300, glm::length(away))) * away),
                           mesh_.samples[piece.sample].part);
                check.expected[check.count++] = source(piece.sample);
            }
        }
        mesh_.checks.push_back(check);
    }

    /// A probe away from the edges of a cut sees what the cut says.
    bool probe_agrees(const ApertureElement& element, const Outline& outline, const Cut& cut) const {
        if (element.probe == none) return true;
        std::size_t where = cut.piece_count - 1;  // not cut off
        for (std::size_t k = 0; k < cut.chord_count; ++k) {
            const Crossing& from = outline.crossings[cut.chords[k].from];
            const Crossing& to = outline.crossings[cut.chords[k].to];
            const glm::dvec3 across = glm::cross(from.place, to.place);  // towards the piece cut off: it lies right of from - to
            const double side = glm::dot(across, direction(element.probe)) / std::max(1e-300, glm::length(across));
            if (std::abs(side) <= from.width + to.width) return true;
            if (side > 0.0) where = cut.chords[k].inner;
        }
        return source(element.probe) == source(cut.pieces[where].sample);
    }

    static void set_dark(ApertureElement& element) {
        element.form = Form::whole;
        element.value = {};
        element.mean_lx = element.smooth_error_lx = element.edge_error_lx = 0.0;
    }

    /// Six samples of an element: its corners and the middles of its sides, with the density of projected solid angle.
    struct SixSamples {
        std::array<std::uint32_t, 6> id{};
        std::array<double, 6> density{};
    };
    SixSamples six_samples(const ApertureElement& element) const {
        SixSamples six;
        const auto& [a, b, c] = element.corners;
        const glm::dvec3 plane_normal = glm::cross(direction(c) - direction(a), direction(b) - direction(a));
        for (std::size_t k = 0; k < 6; ++k) {
            six.id[k] = k < 3 ? element.corners[k] : mesh_.edges[element.edges[k - 3]].middle;
            // Projected solid angle per area of the plane through the corners, up to a factor: cos / r^2 times an obliquity
            // that goes with 1 / r, where r is inverse to how far a unit direction reaches towards the plane.
            const double reach = glm::dot(plane_normal, direction(six.id[k]));
            six.density[k] = std::max(0.0, glm::dot(point_.normal, direction(six.id[k]))) * reach * reach * reach;
        }
        return six;
    }

    /// The three middles integrate a quadratic exactly, and the corners tell the error.
    void estimate_whole(ApertureElement& element) {
        set_dark(element);
        if (source(element.corners[0]) == 0) return;
        const SixSamples six = six_samples(element);
        const double whole_sr = element.projected_solid_angle_sr;
        constexpr double corner_share = 1.0 / 12.0, middle_share = 1.0 / 4.0;
        const double middles = six.density[3] + six.density[4] + six.density[5];
        const double all = corner_share * (six.density[0] + six.density[1] + six.density[2]) + middle_share * middles;
        if (!(middles > 0.0)) return;
        double by_quarters = 0.0;
        for (std::size_t k = 0; k < 6; ++k) {
            const IncomingLight& light = light_of(six.id[k]);
            const double mean = light.mean();
            by_quarters += whole_sr * (k < 3 ? corner_share : middle_share) * six.density[k] / all * mean;
            if (k < 3) continue;
            const double weight_sr = whole_sr * six.density[k] / middles;
            element.value.add(weight_sr, light);
            element.mean_lx += weight_sr * mean;
        }
        element.smooth_error_lx = second_order_error(std::abs(element.mean_lx - by_quarters), element.mean_lx);
    }

    /// Each of the four quarters has the mean of its corners, and the error is what edges do on average.
    void estimate_unresolved(ApertureElement& element) {
        set_dark(element);
        element.form = Form::unresolved;
        const SixSamples six = six_samples(element);
        const double whole_sr = element.projected_solid_angle_sr;
        double all = 0.0;
        for (std::size_t k = 0; k < 6; ++k) all += (k < 3 ? 1.0 : 3.0) * six.density[k];
        if (!(all > 0.0)) return;
        double low = std::numeric_limits<double>::infinity(), high = 0.0;
        const auto widen = [&](double mean) { low = std::min(low, mean), high = std::max(high, mean); };
        for (std::size_t k = 0; k < 6; ++k) {
            const IncomingLight& light = light_of(six.id[k]);
            const double mean = light.mean();
            const double weight_sr = whole_sr * (k < 3 ? 1.0 : 3.0) * six.density[k] / all;
            element.value.add(weight_sr, light);
            element.mean_lx += weight_sr * mean;
            widen(mean);
        }
        if (element.probe != none) widen(light_of(element.probe).mean());
        const Outline outline = outline_of(element);
        for (std::size_t k = 0; k < outline.count; ++k) {
            widen(light_of(outline.crossings[k].before).mean());
            widen(light_of(outline.crossings[k].after).mean());
        }
        element.edge_error_lx = unresolved_error * whole_sr * (high - low);
    }

    /// Every piece has its own projected solid angle, and the light of its corners and centre.
    void estimate_cut(ApertureElement& element, const Outline& outline, const Cut& cut) {
        set_dark(element);
        element.form = Form::cut;
        std::array<double, 3> luminance{};
        for (std::size_t i = 0; i < cut.piece_count; ++i) {
            const Piece& piece = cut.pieces[i];
            if (source(piece.sample) == 0) continue;
            const glm::dvec3 centre = piece.centre();
            // Exact for a quadratic on regular polygons.
            const double corners_share = (2.0 + std::cos(2.0 * pi / static_cast<double>(piece.count))) / 6.0;
            const auto density = [&](const glm::dvec3& d) { return std::max(1e-12, glm::dot(point_.normal, d)); };
            const IncomingLight middle = light_towards(centre, piece.sample);
            SkyAndOutdoors sum;
            sum.add((1.0 - corners_share) * density(centre), middle);
            double weight = (1.0 - corners_share) * density(centre), mean = weight * middle.mean();
            for (std::size_t k = 0; k < piece.count; ++k) {
                const double own = corners_share / static_cast<double>(piece.count) * density(piece.corners[k]);
                const IncomingLight light = light_towards(piece.corners[k], piece.sample);
                sum.add(own, light);
                weight += own;
                mean += own * light.mean();
            }
            const double piece_sr =
                std::max(0.0, glm::dot(point_.normal, vector_solid_angle({piece.corners.data(), piece.count})));
            element.value.add(piece_sr / weight, sum);
            luminance[i] = mean / weight;
            element.mean_lx += piece_sr * luminance[i];
            element.smooth_error_lx += second_order_error(piece_sr * std::abs(luminance[i] - middle.mean()), piece_sr * luminance[i]);
        }
        const auto& [a, b, c] = element.corners;
        const double flat = 0.5 * glm::length(glm::cross(direction(b) - direction(a), direction(c) - direction(a)));
        double squares = 0.0;
        for (std::size_t k = 0; k < cut.chord_count; ++k) {
            const Chord& chord = cut.chords[k];
            const Crossing& from = outline.crossings[chord.from];
            const Crossing& to = outline.crossings[chord.to];
            const glm::dvec3 middle = 0.5 * (from.place + to.place);
            const double checked = 0.5 * (check_distance(outline, chord, middle, cut.pieces[chord.inner]) +
                                          check_distance(outline, chord, middle, cut.pieces[chord.outer]));
            const double step = luminance[chord.inner] - luminance[chord.outer];
            const double length = glm::length(to.place - from.place);
            squares += step * step * length * length *
                       ((from.width * from.width + to.width * to.width) / 48.0 + stray * stray * checked * checked);
        }
        element.edge_error_lx = element.projected_solid_angle_sr / std::max(flat, 1e-300) * std::sqrt(squares);
    }

    /// Divides in four the elements that matter most; false when there is no need, or no budget.
    bool refine() {
        double sum = 0.0, smooth_error = 0.0, squared_edge_error = 0.0;
        for (const ApertureElement& element : mesh_.elements) {
            sum += element.mean_lx;
            smooth_error += element.smooth_error_lx;
            squared_edge_error += element.edge_error_lx * element.edge_error_lx;
        }
        const double unobstructed = all_parts_sr_ * light_.outdoors().horizontal_illuminance().value / pi;
        const double allowed = tolerance_ * std::max(sum, negligible_share * unobstructed);
        const auto total = [&] { return smooth_error + confidence * std::sqrt(std::max(0.0, squared_edge_error)); };
        if (!(total() > allowed) || round_ >= max_rounds) return false;

        // The smallest errors that together use up part of what is allowed can stay as they are.
        const auto error_of = [&](std::uint32_t i) {
            return mesh_.elements[i].smooth_error_lx + confidence * mesh_.elements[i].edge_error_lx;
        };
        const double least = 0.05 * allowed / static_cast<double>(mesh_.elements.size());
        std::vector<std::uint32_t>& order = mesh_.order;
        order.clear();
        for (std::uint32_t i = 0; i < mesh_.elements.size(); ++i) {
            if (error_of(i) > least) order.push_back(i);
        }
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            const double error_a = error_of(a), error_b = error_of(b);
            return error_a != error_b ? error_a > error_b : a < b;
        });
        bool divided = false;
        for (const std::uint32_t i : order) {
            if (total() <= 0.6 * allowed) break;
            if (mesh_.samples.size() + samples_per_division > max_samples) break;
            smooth_error -= mesh_.elements[i].smooth_error_lx;
            squared_edge_error -= mesh_.elements[i].edge_error_lx * mesh_.elements[i].edge_error_lx;
            divide_in_four(i);
            divided = true;
        }
        return divided;
    }

    void divide_in_four(std::uint32_t position) {
        ApertureElement whole = mesh_.elements[position];
        whole.judged = none;
        const auto& [a, b, c] = whole.corners;
        const auto& [edge_ab, edge_bc, edge_ca] = whole.edges;
        const std::uint32_t ab = mesh_.edges[edge_ab].middle, bc = mesh_.edges[edge_bc].middle,
                            ca = mesh_.edges[edge_ca].middle;
        plain_halves_ = whole.form == Form::whole;
        const std::uint32_t like = plain_halves_ ? a : none;
        const std::uint32_t at_a = add_edge(ca, ab, like), at_b = add_edge(ab, bc, like), at_c = add_edge(bc, ca, like);
        const auto part = [&](const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& edges) {
            ApertureElement element = whole;
            element.corners = corners;
            element.edges = edges;
            if (whole.probe != none && !contains(element, whole.probe)) element.probe = none;
            measure(element);
            return element;
        };
        mesh_.elements[position] = part({ab, bc, ca}, {at_b, at_c, at_a});
        mesh_.elements.push_back(part({a, ab, ca}, {half_of(edge_ab, a), at_a, half_of(edge_ca, a)}));
        mesh_.elements.push_back(part({ab, b, bc}, {half_of(edge_ab, b), half_of(edge_bc, b), at_b}));
        mesh_.elements.push_back(part({ca, bc, c}, {at_c, half_of(edge_bc, c), half_of(edge_ca, c)}));
    }

    const GatherPoint& point_;
    const DirectionalLight& light_;
    const Visibility& visibility_;
    AdaptiveScratch& mesh_;
    double tolerance_;
    double crossing_width_;  // crossings are located to this share of a side
    double check_offset_;    // of the way from a cut to the centre of a piece: where it is checked
    double all_parts_sr_ = 0.0;  // projected solid angle
    std::optional<glm::dvec3> bright_spot_;
    std::size_t settled_edges_ = 0;
    std::uint32_t round_ = 0;
    bool plain_halves_ = false;  // halves of edges between like points need not be asked for
    std::vector<double> shares_;
};

}  // namespace

SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch) {
    Integration integration(point, light, tolerance, visibility, scratch);
    for (std::size_t k = 0; k < light.openings().size(); ++k) integration.add_aperture(k, light.openings()[k]);
    return integration.run();
}

SkyAndOutdoors integrate_open_air(const GatherPoint& point, const OpenAirLight& light, double tolerance,
                                  const Visibility& visibility, AdaptiveScratch& scratch) {
    Integration integration(point, light, tolerance, visibility, scratch);
    integration.add_open_air();
    return integration.run();
}

}  // namespace naturel
