#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/building.h"
#include "core/light_zones.h"
#include "core/scene.h"

namespace naturel {

inline constexpr std::uint32_t no_sunspot = 0xffff'ffffu;

/// What is left of a cell of a face's grid: the unit of form factors and of the radiosity. Convex.
struct Patch {
    FaceId face{};
    glm::dvec3 centroid_m{};
    glm::dvec3 normal{};
    double area_m2 = 0.0;
    std::uint32_t first_corner = 0;  ///< into PatchGrid::corners
    std::uint32_t corner_count = 0;
    std::uint32_t sunspot = no_sunspot;  ///< into PatchGrid::sunspot_illuminance_lx
    bool umbra = false;                  ///< sees no aperture: nothing direct arrives
};

/// A corner of one or more patches of one face, where direct illuminance is computed. Along the edge of a sunspot there are
/// two nodes at the same place, one for each side: light jumps there.
struct Node {
    FaceId face{};
    glm::dvec3 position_m{};
    /// Where light is gathered for it: moved off the outline of the face into its patches by up to 1 mm, so that a
    /// node in a corner of the room does not sit inside the neighbouring wall.
    glm::dvec3 gather_position_m{};
    std::uint32_t sunspot = no_sunspot;  ///< of its patches
    bool umbra = false;                  ///< all of its patches are in an umbra zone
};

/// The calculation grid of a building. The same for every sky and every visibility method; it follows the sun only in where
/// its zones are.
class PatchGrid {
public:
    std::vector<Patch> patches;   ///< of indoor faces first, then apertures, then outdoor faces
    std::vector<Node> nodes;      ///< of indoor opaque faces only
    std::vector<NodeId> corners;  ///< node of each patch corner, counter-clockwise; see corners_of()
    std::vector<glm::dvec3> corner_positions_m;  ///< the same corners as points; also for patches without nodes
    std::size_t indoor_patch_count = 0;  ///< opaque indoor patches: [0, indoor_patch_count)
    std::size_t gather_patch_count = 0;  ///< with the apertures: [0, gather_patch_count) exchange light in the radiosity

    bool follows_zones = false;  ///< cut along sunspots and umbra zones: each patch and node knows its own
    std::vector<Band3> sunspot_illuminance_lx;  ///< what the sun gives to all of a sunspot

    /// Nodes of a patch of an indoor opaque face.
    std::span<const NodeId> corners_of(PatchId patch) const;
    /// Corner points of any patch, counter-clockwise seen from the air.
    std::span<const glm::dvec3> polygon_of(PatchId patch) const;

    /// The patch of a face under a point of its plane, in constant time. A point outside every patch by rounding gets
    /// the nearest one of its neighbourhood; PatchId::none when the face has no patch at all.
    PatchId patch_at(FaceId face, const glm::dvec3& point_m) const;

    /// The patch on the other side of an inner aperture; none for all others.
    PatchId behind(PatchId patch) const { return behind_.empty() ? PatchId::none : behind_[index(patch)]; }

    /// Mean-value coordinates of a point of the patch's plane over the corners of the patch: weights >= 0 that sum to 1,
    /// linear along edges. weights: [corner_count].
    void interpolation_weights(PatchId patch, const glm::dvec3& point_m, std::span<double> weights) const;

    /// The regular grid of a face before it was cut. Cells are numbered over all faces; points outside count to the outermost.
    struct FaceGrid {
        glm::dvec3 origin_m{}, du{}, dv{};  ///< s = dot(p - origin, du) in [0, nu), t likewise
        int nu = 0, nv = 0;
        std::uint32_t first_cell = 0;  ///< cell (i, j): first_cell + j nu + i
    };
    const FaceGrid& face_grid(FaceId face) const { return face_grids_[index(face)]; }
    std::size_t cell_count() const { return first_in_cell_.empty() ? 0 : first_in_cell_.size() - 1; }
    /// The patches that have a part in a cell.
    std::span<const PatchId> patches_in_cell(std::size_t cell) const {
        return {cell_patches_.data() + first_in_cell_[cell], first_in_cell_[cell + 1] - first_in_cell_[cell]};
    }

private:
    friend class PatchGridBuilder;
    std::vector<FaceGrid> face_grids_;
    std::vector<std::uint32_t> first_in_cell_;  ///< patches of cell c: cell_patches_[first_in_cell_[c] ... first_in_cell_[c + 1])
    std::vector<PatchId> cell_patches_;
    std::vector<PatchId> behind_;
};

/// Lays a regular grid on every face, with counts that follow its side lengths, cuts the cells by what is left of the face
/// and by the zones of light on it, and joins slivers with a neighbour (docs/method.md, "Grid").
/// zones: [faces] each, as find_light_zones() made them; empty vectors for a grid that knows no zones.
/// Throws InputError, before it takes any memory, where that would be more than ten million cells.
PatchGrid make_patch_grid(const Building& building, const GridOptions& options, const LightZones& zones = {});

}  // namespace naturel
