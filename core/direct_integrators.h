#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/aperture_light.h"
#include "core/facet_tree.h"
#include "core/scene.h"
#include "core/view_pieces.h"
#include "core/visibility.h"

namespace naturel {

/// Light of sky, ground and outdoor facets on a point: what both integrators find. The sun is not theirs.
struct SkyAndOutdoors {
    Band3 sky_lx{};
    LightBySource outdoor_lx{};  ///< of ground and outdoor facets
    LightBySource ground_lx{};   ///< of the ground alone

    void add(double projected_solid_angle_sr, const IncomingLight& light) {
        sky_lx += projected_solid_angle_sr * light.sky;
        outdoor_lx += projected_solid_angle_sr * light.outdoor;
        if (light.from_ground) ground_lx += projected_solid_angle_sr * light.outdoor;
    }
    void add(const SkyAndOutdoors& other) { add(1.0, other); }
    void add(double factor, const SkyAndOutdoors& other) {
        sky_lx += factor * other.sky_lx;
        outdoor_lx += factor * other.outdoor_lx;
        ground_lx += factor * other.ground_lx;
    }
};

/// Exterior apertures cut into the article's aperture elements, at each of its three finenesses.
class ArticleElements {
public:
    /// Elements along a side: 4, 8 and 16, so 16, 64 and 256 of them.
    static constexpr std::array<int, 3> counts_per_side{4, 8, 16};

    explicit ArticleElements(const Building& building);

    struct ApertureElement {
        glm::dvec3 centre_m{};
        double area_m2 = 0.0;
    };
    struct Division {
        std::vector<ApertureElement> elements;
        double size_m = 0.0;  ///< longest side of an element
    };
    const Division& division(std::size_t aperture, std::size_t fineness) const {
        return divisions_[aperture][fineness];
    }

private:
    std::vector<std::array<Division, 3>> divisions_;  ///< [aperture]; empty for inner ones
};

/// Memory of one thread for integrate_article().
struct ArticleScratch {
    struct Ray {
        double projected_solid_angle_sr = 0.0;
        std::size_t aperture = 0;
    };
    std::vector<Ray> rays;
    std::vector<glm::dvec3> directions;  ///< [rays]
    std::vector<FacetId> seen;           ///< [rays]
    std::vector<glm::dvec3> polygon, clipped;
};

/// Memory of one thread for integrate_adaptively().
struct AdaptiveScratch {
    /// A piece of the view in which one thing is seen: a convex polygon of directions.
    struct ViewPart {
        std::size_t aperture = 0;
        FacetId seen = FacetId::none;
        bool mixed = false;  ///< several things may be seen, and every direction is asked for
        std::uint32_t first = 0, count = 0;  ///< corners
    };
    /// A spherical triangle, counter-clockwise.
    struct ApertureElement {
        std::array<glm::dvec3, 3> corners{};
        std::uint32_t part = 0;
        double projected_solid_angle_sr = 0.0;
        double mean_lx = 0.0;          ///< mean of the bands
        double smooth_error_lx = 0.0;  ///< of quadrature: of one sign in many elements
        double edge_error_lx = 0.0;    ///< standard deviation; of either sign
        SkyAndOutdoors value{};
    };
    ViewPieces pieces;
    std::vector<FacetTree::Found> facets;
    std::vector<ViewPart> parts;
    std::vector<glm::dvec3> corners;     ///< of the parts
    std::vector<ApertureElement> elements;
    std::vector<glm::dvec3> rays;        ///< asked for together
    std::vector<FacetId> seen;           ///< [rays]
    std::vector<std::uint32_t> order;
    std::vector<glm::dvec3> polygon, quarter, clipped, half, inwards;
};

/// The article's rule: 16, 64 or 256 aperture elements, 256 sky zones close to an aperture.
SkyAndOutdoors integrate_article(const GatherPoint& point, const ApertureLight& light, const ArticleElements& elements,
                                 const ArticleRule& rule, const Visibility& visibility, ArticleScratch& scratch);

/// Cuts the view through the apertures along the outlines of the facets in `tree`, asks what is seen in each piece, and divides the
/// pieces until the estimated error of the integral is below `tolerance` of the sum. How often the true one is: docs/method.md,
/// "Direct illuminance".
SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, const FacetTree& tree, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch);

/// The same for a point in the open air, over all that it sees.
SkyAndOutdoors integrate_open_air(const GatherPoint& point, const OpenAirLight& light, const FacetTree& tree, double tolerance,
                                  const Visibility& visibility, AdaptiveScratch& scratch);

/// A ray of a quadrature: illuminance is the sum of projected solid angle times luminance.
struct ViewRay {
    glm::dvec3 direction{};
    double projected_solid_angle_sr = 0.0;
    FacetId seen = FacetId::none;
    std::size_t aperture = 0;
};

/// The longest edges of the triangles that get seven rays each, as chords of the unit sphere.
struct RaySpacing {
    double sky = 0.1;
    double surfaces = 0.1;  ///< ground and buildings
};

/// The rays to all that may shine on a point through apertures, for light that is not known yet: the integral by a rule of degree 5 on
/// the same pieces of the view as integrate_adaptively() has.
void spread_rays(const GatherPoint& point, const ApertureOutlook& apertures, const FacetTree& tree, double tolerance,
                 const Visibility& visibility, const RaySpacing& spacing, AdaptiveScratch& scratch, std::vector<ViewRay>& rays);
void spread_rays_in_open_air(const GatherPoint& point, const OpenAir& air, const FacetTree& tree, double tolerance,
                             const Visibility& visibility, const RaySpacing& spacing, AdaptiveScratch& scratch,
                             std::vector<ViewRay>& rays);

}  // namespace naturel
