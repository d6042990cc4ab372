#pragma once
#include <array>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "core/building.h"
#include "core/facet_tree.h"
#include "core/glazing.h"
#include "core/ground_light.h"
#include "core/light_by_source.h"
#include "core/patch_grid.h"
#include "core/progress.h"
#include "core/sky.h"
#include "core/visibility.h"

namespace naturel {

/// Everything that shines outdoors.
struct OutdoorLight {
    Sky sky;
    glm::dvec3 sun_direction{0, 0, 1};        ///< unit, towards the sun
    double direct_normal_illuminance_lx = 0;  ///< 0 when there is no sun or it is below the horizon
    Band3 sky_colour = grey(1.0);             ///< bands of sky light of luminance 1
    Band3 sun_colour = grey(1.0);             ///< the same of the sun
    LightBySource ground_luminance_cd_m2{};   ///< of open ground
    std::vector<LightBySource> patch_luminance_cd_m2{};  ///< [patch], means; filled for outdoor patches only

    std::vector<LightBySource> corner_luminance_cd_m2{};  ///< the same at their corners, [grid.corner_positions_m]

    /// Luminance of the ground near buildings, at the nodes of a lattice; empty where nothing shades the ground.
    GroundLattice ground_lattice{};
    std::vector<LightBySource> lattice_luminance_cd_m2{};

    Illuminance horizontal_illuminance() const { return sky.horizontal_illuminance(); }  ///< the sun excluded
};

/// Illuminance of a point in the open air (a corner of an outdoor patch or an outdoor sensor).
struct OutdoorIlluminance {
    Band3 sky_lx{}, sun_lx{};
    LightBySource reflected_lx{};  ///< by ground and buildings
    LightBySource ground_lx{};     ///< by the ground alone
};

/// Lights ground and outdoor facets (docs/method.md, "Outdoors"): the ground by sky and sun, unobstructed or with the shadows
/// of the buildings; the outdoor faces by sky, sun and ground as far as other buildings do not hide them; then as often as
/// the scene asks for, each by the light the others reflect.
OutdoorLight light_outdoors(const Scene& scene, const Building& building, const PatchGrid& grid,
                            const Visibility& visibility, Progress& progress);

/// The places where outdoor light is known: where corners of patches of one face meet, and the lattice on the ground. Geometry alone.
struct OutdoorSurfaces {
    struct Node {
        FaceId face{};
        GatherPoint point{};
        std::size_t corner = 0;  ///< one of its corners
    };
    static constexpr std::size_t no_node = ~std::size_t{0};

    std::vector<Node> nodes;
    std::vector<std::size_t> node_of_corner;  ///< [grid.corner_positions_m]; no_node: not of an outdoor patch
    GroundLattice lattice;                    ///< empty when the scene's ground knows no shadows
};
OutdoorSurfaces find_outdoor_surfaces(const Scene& scene, const Building& building, const PatchGrid& grid);

/// The sky, the sun and the open ground of a scene; nothing else is lit yet.
OutdoorLight outdoor_sources(const Scene& scene);

/// Finds out what sky and reflections give to nodes of the surfaces: of the lattice, or of faces. The sun is not asked for.
struct OutdoorGather {
    std::function<OutdoorIlluminance(const OutdoorLight&, std::size_t node)> at_lattice, at_face;
};
/// Lights the surfaces. light: of outdoor_sources().
void light_surfaces(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                    const OutdoorSurfaces& surfaces, const OutdoorGather& gather, Progress& progress, OutdoorLight& light);

/// What an observer sees in a direction in which first_seen() said `seen`. Indoor facets, apertures and the backs of outdoor
/// facets are dark.
enum class OutdoorSource { dark, sky, ground, building };
OutdoorSource outdoor_source(const Building& building, const glm::dvec3& direction, FacetId seen);

/// Where on ground or buildings a ray ends, and between which values light is interpolated there.
struct OutdoorPlace {
    static constexpr std::size_t most_corners = 16;  ///< of a patch whose corners are told apart

    OutdoorSource source = OutdoorSource::dark;
    bool open_ground = false;             ///< ground whose luminance is that of all open ground
    GroundLattice::Place on_lattice{};    ///< of other ground
    PatchId patch = PatchId::none;        ///< of a building; none: nothing shines there
    std::array<double, most_corners> corner_weights{};  ///< none for a patch of more corners, which has its mean everywhere
};
/// lattice: empty when all ground is open.
OutdoorPlace find_outdoor_place(const Building& building, const PatchGrid& grid, const GroundLattice& lattice,
                                const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen);

/// Luminance of what is seen, cd/m2. from_m: the observer.
LightBySource outdoor_luminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                const glm::dvec3& from_m, const glm::dvec3& direction, FacetId seen);

/// The sun on such a point, lx.
Band3 sun_in_open_air(const OutdoorLight& light, const Visibility& visibility, const GatherPoint& point);

/// tolerance: relative error aimed at of what sky and reflections give together.
OutdoorIlluminance outdoor_illuminance(const OutdoorLight& light, const Building& building, const PatchGrid& grid,
                                       const FacetTree& tree, const Visibility& visibility, const GatherPoint& point,
                                       double tolerance = 1e-3);

}  // namespace naturel
