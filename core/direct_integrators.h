#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/aperture_light.h"
#include "core/scene.h"
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

/// Memory of one thread for integrate_adaptively(): a mesh of directions.
struct AdaptiveScratch {
    static constexpr std::uint32_t none = 0xffff'ffffu;

    /// A direction in which visibility was asked for.
    struct Sample {
        glm::dvec3 direction{};  ///< unit
        std::uint32_t part = 0;
        FacetId seen = FacetId::none;
        std::uint32_t source = 0;    ///< as DirectionalLight::source_along(); 0: dark
        std::uint32_t light = none;  ///< into `light`, once it was needed
    };
    /// A known place on an edge.
    struct EdgePoint {
        double share = 0.0;  ///< from 0 at a to 1 at b
        std::uint32_t sample = 0;
    };
    /// An arc between two samples, with a sample half way. It belongs to two elements, or was halved for one of them.
    struct Edge {
        static constexpr std::size_t max_points = 8;
        std::uint32_t a = 0, b = 0, middle = 0;
        std::uint32_t halves = none;  ///< first of two edges: from a to the middle, and on to b
        std::uint32_t parent = none;
        std::uint32_t changed = 0;  ///< round in which a point was last added to it or to its halves
        /// Increasing; between two points of the same source there is, as far as is known, nothing else.
        std::array<EdgePoint, max_points> points{};
        std::uint32_t point_count = 0;
        bool crowded = false;  ///< had more to tell than fits
    };
    enum class Form : std::uint8_t {
        unresolved,  ///< several sources, and where one gives way to another is not known
        whole,       ///< one source
        cut,         ///< two or three sources, apart by one or two straight edges
    };
    /// A triangle, counter-clockwise; edge k joins corner k and corner k + 1, in either direction.
    struct ApertureElement {
        std::array<std::uint32_t, 3> corners{}, edges{};
        std::uint32_t probe = none;  ///< a sample anywhere inside, which only tells whether something is there
        std::uint32_t judged = none; ///< round of its estimate
        double projected_solid_angle_sr = 0.0;
        Form form = Form::unresolved;
        double smooth_error_lx = 0.0;  ///< of quadrature: of one sign in many elements
        double edge_error_lx = 0.0;    ///< standard deviation; of either sign
        double mean_lx = 0.0;          ///< mean of the bands
        SkyAndOutdoors value;
    };
    /// Samples that tell whether a cut runs as assumed: on both sides of the middle of its one or two edges.
    struct CutCheck {
        std::uint32_t element = 0;
        std::uint32_t first_sample = 0;
        std::uint32_t count = 0;
        std::array<std::uint32_t, 4> expected{};  ///< sources
    };
    /// A convex part of the view, above or below the horizon.
    struct ViewPart {
        std::size_t aperture = 0;
        glm::dvec3 inside{};  ///< a direction well inside
        double projected_solid_angle_sr = 0.0;
        std::uint32_t source = none;  ///< of one of its elements
        bool mixed = false;           ///< others see something else
    };
    std::vector<ViewPart> parts;
    std::vector<ApertureElement> elements;
    std::vector<Edge> edges;
    std::vector<Sample> samples;
    std::vector<glm::dvec3> rays;        ///< of the samples asked for together, drawn off the outline of their part
    std::vector<FacetId> seen;           ///< [rays]
    std::vector<std::uint32_t> asked;    ///< [rays], samples
    std::vector<IncomingLight> light;
    std::vector<std::uint32_t> fresh;    ///< elements to be estimated
    std::vector<std::uint32_t> crossed;  ///< edges on which crossings are looked for
    std::vector<CutCheck> checks;
    std::vector<std::uint32_t> order;
    std::vector<glm::dvec3> polygon, clipped, half;
};

/// The article's rule: 16, 64 or 256 aperture elements, 256 sky zones close to an aperture.
SkyAndOutdoors integrate_article(const GatherPoint& point, const ApertureLight& light, const ArticleElements& elements,
                                 const Visibility& visibility, ArticleScratch& scratch);

/// Aperture elements of exact projected solid angle, divided until the estimated error is below `tolerance` of the sum.
/// How often the true one is, for smooth light and behind bars and furniture: docs/method.md, "Direct illuminance".
SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch);

/// The same for a point in the open air, over all that it sees.
SkyAndOutdoors integrate_open_air(const GatherPoint& point, const OpenAirLight& light, double tolerance,
                                  const Visibility& visibility, AdaptiveScratch& scratch);

}  // namespace naturel
