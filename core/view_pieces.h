#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/facet_tree.h"

namespace naturel {

/// A view from a point, cut along the outlines of all that may stand in it: in each piece just one thing is seen. Which one,
/// this does not say. Pieces are convex polygons of unit directions, counter-clockwise (core/spherical_polygon.h).
class ViewPieces {
public:
    struct Piece {
        std::uint32_t first = 0, count = 0;  ///< vertices
        /// Something opaque fills the piece no farther than this: what is farther cannot be seen.
        double covered_m = std::numeric_limits<double>::infinity();
    };

    /// The view as one piece. polygon: convex, inside one hemisphere, vectors of any length.
    /// least: pieces of a smaller flat area (on chords of the unit sphere) are not made, but belong to a neighbour.
    void start(std::span<const glm::dvec3> polygon, double least);

    /// Cuts along the outline of an opaque facet. Call with the nearest first: what stands behind it then need not be cut.
    void cut_along(const glm::dvec3& from_m, const FacetTree& tree, const FacetTree::Found& facet);

    /// Cuts along the outline of a convex polygon that does not hide what is behind it.
    void cut_along(const glm::dvec3& from_m, std::span<const glm::dvec3> outline_m);

    std::span<const Piece> pieces() const { return pieces_; }
    std::span<const glm::dvec3> directions_of(const Piece& piece) const {
        return {directions_.data() + piece.first, piece.count};
    }

    /// False once there are too many pieces to cut any more: they may then show several things.
    bool complete() const { return complete_; }

private:
    /// Planes through the point and the edges of a convex polygon, normals inwards.
    void find_sides(const glm::dvec3& from_m, std::span<const glm::dvec3> outline_m, bool from_front);
    /// Cuts one piece along sides_; true if it is now inside.
    bool cut(std::size_t position);
    Piece keep(std::span<const glm::dvec3> polygon, double covered_m);

    std::vector<glm::dvec3> directions_;
    std::vector<Piece> pieces_;
    std::vector<glm::dvec3> sides_;
    std::vector<double> heights_;
    std::vector<glm::dvec3> inside_, next_, outside_;
    std::vector<glm::dvec3> cut_off_;              ///< vertices of what was cut off a piece so far
    std::vector<std::uint32_t> cut_off_counts_;    ///< of each of these polygons
    double least_ = 0.0;
    bool complete_ = true;
};

}  // namespace naturel
