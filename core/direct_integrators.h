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
    Band3 sky_lx;
    LightBySource outdoor_lx;

    void add(double projected_solid_angle_sr, const IncomingLight& light) {
        sky_lx += projected_solid_angle_sr * light.sky;
        outdoor_lx += projected_solid_angle_sr * light.outdoor;
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

    /// An arc between two samples, with a sample half way.
    struct Edge {
        std::uint32_t a = 0, b = 0, middle = 0;
        std::uint32_t halves = none;  ///< first of two edges: from a to the middle, and on to b
        /// Where along the edge, from 0 to 1, what a sees gives way to what b sees; low = high when it is more involved.
        double low = 0.0, high = 1.0;
    };
    /// A triangle, counter-clockwise; edge k joins corner k and corner k + 1, in either direction. Neighbours share edges,
    /// and so samples.
    struct ApertureElement {
        std::array<std::uint32_t, 3> corners{}, edges{};
        std::uint32_t probe = none;  ///< a sample anywhere inside, which only tells whether something is there
        double projected_solid_angle_sr = 0.0;
        std::array<double, 6> weights_sr{};  ///< of the samples at the corners and at the middles of the edges
        glm::dvec3 cut_normal{};             ///< of the plane of the edge that cuts off corner `odd`, towards it; or 0
        std::uint32_t odd = 0;
        double illuminance_lx = 0.0;  ///< mean of the bands
        double error_lx = 0.0;
    };
    /// A convex part of an aperture as far as it is in front of the point, above or below its horizon.
    struct AperturePart {
        std::size_t aperture = 0;
        glm::dvec3 inside{};  ///< a direction well inside
    };
    std::vector<AperturePart> parts;
    std::vector<ApertureElement> elements;
    std::vector<Edge> edges;
    std::vector<glm::dvec3> directions;  ///< of the samples; unit
    std::vector<std::uint32_t> part_of;  ///< [samples]
    std::vector<glm::dvec3> rays;        ///< [samples], directions drawn off the outline of the part; unit
    std::vector<FacetId> seen;           ///< [samples]
    std::vector<IncomingLight> light;    ///< [samples]
    std::vector<std::uint32_t> fresh;     ///< elements to be estimated
    std::vector<std::uint32_t> crossed;   ///< edges on which a crossing is looked for
    std::vector<std::uint32_t> order;
    std::vector<glm::dvec3> polygon, clipped, half;
};

/// The article's rule: 16, 64 or 256 aperture elements, 256 sky zones close to an aperture.
SkyAndOutdoors integrate_article(const GatherPoint& point, const ApertureLight& light, const ArticleElements& elements,
                                 const Visibility& visibility, ArticleScratch& scratch);

/// Aperture elements of exact projected solid angle, divided until the estimated relative error is below `tolerance`.
SkyAndOutdoors integrate_adaptively(const GatherPoint& point, const ApertureLight& light, double tolerance,
                                    const Visibility& visibility, AdaptiveScratch& scratch);

}  // namespace naturel
