#pragma once
#include <span>
#include <vector>

#include "hemicube_backend/cell_kernels.h"
#include "hemicube_backend/facet_set.h"
#include "hemicube_backend/projection_cells.h"

namespace naturel {

/// Facets are drawn wider by this, so that no cell is lost between facets that share an edge, even where only
/// a part of it is an edge of the other (a T-junction). Geometry is rounded to 1 nm, so that cracks are a few
/// nm wide. A cell drawn by both keeps the nearer one. Facets seen from behind are drawn narrower instead:
/// the back of a solid must not show along its outline.
inline constexpr double crack_m = 1e-8;

/// How a plane of a projection lies in the world: orthonormal, right x up = forward. x of its cells follows
/// `right`, y follows `up`.
struct ProjectionAxes {
    glm::dvec3 right{}, up{}, forward{};
};

struct Projection {
    glm::dvec3 eye_m{};
    ProjectionAxes axes{};
    /// false: rays leave the eye, the point (x, y) lies in the direction x right + y up + forward.
    /// true: rays leave eye + x right + y up along `forward`; x and y in metres.
    bool parallel = false;
    std::span<const CutPlane> cut_planes{};  ///< only what they leave is drawn; alive as long as the buffer draws
    SeeThrough see_through = SeeThrough::nothing;
};

/// What each cell of a plane of a projection shows: the facet that is nearest along the ray through the cell's
/// centre. Where two are equally near it is the one that faces the viewpoint, then the one with the smaller FacetId: what
/// is shown does not depend on the order of drawing. Scratch memory: drawing again allocates nothing once warm.
class ItemBuffer {
public:
    struct Entry {
        FacetId facet{};
        glm::dvec3 inverse_depth{};  ///< perspective: the ray eye + t d meets the plane at 1 / t = dot(inverse_depth, d)
        double w_1 = 0.0, w_x = 0.0, w_y = 0.0;  ///< depth w_1 + w_x x + w_y y: 1 / t, or - t if parallel
    };

    /// Draws rows [row_begin, row_end) of `cells`, which must live as long as what is asked about it.
    /// Facets may surround the viewpoint. docs/hemicube.md, "Item buffer".
    void draw(const FacetSet& facets, const Projection& projection, const ProjectionCells& cells, FacetKind kind, int row_begin,
              int row_end);
    void draw(const FacetSet& facets, const Projection& projection, const ProjectionCells& cells, FacetKind kind) {
        draw(facets, projection, cells, kind, 0, cells.rows);
    }
    /// Draws more facets over what is there.
    void add(const FacetSet& facets, FacetKind kind);

    /// FacetId::none where a cell shows nothing; row in [row_begin, row_end) of the last draw().
    FacetId facet(int row, int column) const { return facet_of(codes(row)[column]); }

    static FacetId facet_of(ItemCode code) {
        return code == empty_item ? FacetId::none : make_id<FacetId>(static_cast<std::uint32_t>(code) & 0x7fff'ffffu);
    }
    static bool faces_viewpoint(ItemCode code) { return code < 0; }

    /// [columns], and kernel_lanes more that may be read.
    const ItemCode* codes(int row) const { return items_.data() + (row - row_begin_) * stride_; }
    const Projection& projection() const { return projection_; }
    /// Of a facet that some cell shows.
    std::uint32_t entry_number(FacetId facet) const { return entry_of_[index(facet)]; }
    const std::vector<Entry>& entries() const { return entries_; }

private:
    struct Window;
    struct Extent {
        double begin, end;
    };
    void draw_facet(const FacetSet& facets, FacetId facet, bool from_air);
    /// Cuts corners_, along the axes, by the planes of the view.
    void cut_corners();
    /// True if nothing in the rectangle can come before what is drawn. nearest: depth of what may be there.
    bool is_hidden(const Extent& x, const Extent& y, double nearest);
    bool box_is_hidden(const FacetSet::Node& node);
    float farthest_in_tile(std::size_t tile_row, std::size_t tile);

    Projection projection_;
    const ProjectionCells* cells_ = nullptr;
    int row_begin_ = 0, row_end_ = 0;
    std::ptrdiff_t stride_ = 0;
    std::vector<ItemCode> items_;   ///< [rows x stride]
    std::vector<float> depth_;      ///< the same: larger is nearer
    std::vector<float> farthest_;   ///< smallest depth of each tile; NaN: to be found
    std::vector<Entry> entries_;    ///< of the facets drawn
    std::vector<std::uint32_t> entry_of_;  ///< [facets]
    // Of the facet being drawn:
    std::vector<glm::dvec3> corners_, clipped_;  ///< along the axes
    std::vector<double> at_origin_;     ///< [rows]
    std::vector<double> left_, right_;  ///< [rows], and kernel_lanes more
    std::vector<int> first_, last_;     ///< the same
    std::vector<std::uint32_t> stack_;
};

}  // namespace naturel
