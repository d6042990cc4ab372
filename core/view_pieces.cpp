#include "core/view_pieces.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace naturel {
namespace {

/// Directions this close to a plane, rad, are on it: rounding of unit vectors is 1000 times finer, and coordinates are good to
/// 1 nm, which is as much at 10 m.
constexpr double on_plane = 1e-10;
/// An edge seen end-on has no plane; as a sine.
constexpr double end_on = 1e-12;
constexpr std::size_t most_pieces = 4096;

double flat_area(std::span<const glm::dvec3> polygon) {
    glm::dvec3 sum{};
    for (std::size_t k = 2; k < polygon.size(); ++k)
        sum += glm::cross(polygon[k - 1] - polygon[0], polygon[k] - polygon[0]);
    return 0.5 * glm::length(sum);
}

}  // namespace

void ViewPieces::start(std::span<const glm::dvec3> polygon, double least) {
    directions_.clear();
    pieces_.clear();
    complete_ = true;
    least_ = least;
    inside_.clear();
    for (const glm::dvec3& vertex : polygon) inside_.push_back(glm::normalize(vertex));
    pieces_.push_back(keep(inside_, std::numeric_limits<double>::infinity()));
}

ViewPieces::Piece ViewPieces::keep(std::span<const glm::dvec3> polygon, double covered_m) {
    const Piece piece{static_cast<std::uint32_t>(directions_.size()), static_cast<std::uint32_t>(polygon.size()), covered_m};
    directions_.insert(directions_.end(), polygon.begin(), polygon.end());
    return piece;
}

void ViewPieces::find_sides(const glm::dvec3& from_m, std::span<const glm::dvec3> outline_m, bool from_front) {
    sides_.clear();
    for (std::size_t k = 0; k < outline_m.size(); ++k) {
        const glm::dvec3 a = outline_m[k] - from_m, b = outline_m[k + 1 < outline_m.size() ? k + 1 : 0] - from_m;
        const glm::dvec3 inwards = from_front ? glm::cross(b, a) : glm::cross(a, b);
        const double length = glm::length(inwards);
        if (length > end_on * glm::length(a) * glm::length(b)) sides_.push_back(inwards / length);
    }
}

void ViewPieces::cut_along(const glm::dvec3& from_m, const FacetTree& tree, const FacetTree::Found& facet) {
    find_sides(from_m, tree.vertices_of(facet.facet), facet.height_m > 0.0);
    const std::size_t count = pieces_.size();
    for (std::size_t i = 0; i < count && complete_; ++i) {
        if (facet.distance_m >= pieces_[i].covered_m || !cut(i)) continue;
        // On a plane the farthest direction of a convex polygon is a vertex.
        double least_cosine = 1.0;
        for (const glm::dvec3& direction : directions_of(pieces_[i]))
            least_cosine = std::min(least_cosine, std::abs(glm::dot(tree.normal_of(facet.facet), direction)));
        if (least_cosine > 0.0) pieces_[i].covered_m = std::min(pieces_[i].covered_m, std::abs(facet.height_m) / least_cosine);
    }
}

void ViewPieces::cut_along(const glm::dvec3& from_m, std::span<const glm::dvec3> outline_m) {
    glm::dvec3 area{};
    for (std::size_t k = 2; k < outline_m.size(); ++k)
        area += glm::cross(outline_m[k - 1] - outline_m[0], outline_m[k] - outline_m[0]);
    find_sides(from_m, outline_m, glm::dot(area, from_m - outline_m[0]) > 0.0);
    const std::size_t count = pieces_.size();
    for (std::size_t i = 0; i < count && complete_; ++i) cut(i);
}

bool ViewPieces::cut(std::size_t position) {
    const Piece piece = pieces_[position];
    const std::span<const glm::dvec3> whole = directions_of(piece);
    // Most pieces are outside one of the planes.
    for (const glm::dvec3& side : sides_) {
        bool reaches_in = false;
        for (const glm::dvec3& vertex : whole) reaches_in = reaches_in || glm::dot(side, vertex) > on_plane;
        if (!reaches_in) return false;
    }
    inside_.assign(whole.begin(), whole.end());
    cut_off_.clear();
    cut_off_counts_.clear();
    for (const glm::dvec3& side : sides_) {
        heights_.clear();
        double lowest = 0.0, highest = 0.0;
        for (const glm::dvec3& vertex : inside_) {
            double height = glm::dot(side, vertex);
            if (std::abs(height) <= on_plane) height = 0.0;
            heights_.push_back(height);
            lowest = std::min(lowest, height), highest = std::max(highest, height);
        }
        if (highest == 0.0) return false;
        if (lowest == 0.0) continue;
        next_.clear();
        outside_.clear();
        for (std::size_t k = 0; k < inside_.size(); ++k) {
            const std::size_t after = k + 1 < inside_.size() ? k + 1 : 0;
            if (heights_[k] >= 0.0) next_.push_back(inside_[k]);
            if (heights_[k] <= 0.0) outside_.push_back(inside_[k]);
            if (heights_[k] * heights_[after] < 0.0) {
                const double share = heights_[k] / (heights_[k] - heights_[after]);
                const glm::dvec3 crossing = glm::normalize((1.0 - share) * inside_[k] + share * inside_[after]);
                next_.push_back(crossing);
                outside_.push_back(crossing);
            }
        }
        std::swap(inside_, next_);
        if (outside_.size() >= 3 && flat_area(outside_) >= least_) {
            cut_off_.insert(cut_off_.end(), outside_.begin(), outside_.end());
            cut_off_counts_.push_back(static_cast<std::uint32_t>(outside_.size()));
        }
    }
    if (cut_off_counts_.empty()) return true;
    if (inside_.size() < 3 || flat_area(inside_) < least_) return false;
    pieces_[position] = keep(inside_, piece.covered_m);
    std::size_t first = 0;
    for (const std::uint32_t count : cut_off_counts_) {
        pieces_.push_back(keep({cut_off_.data() + first, count}, piece.covered_m));
        first += count;
    }
    complete_ = pieces_.size() <= most_pieces;
    return true;
}

}  // namespace naturel
