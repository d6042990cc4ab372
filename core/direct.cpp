#include "core/direct.h"

#include <optional>

#include "core/direct_integrators.h"
#include "core/parallel.h"

namespace naturel {

struct DirectLight::Implementation {
    struct Scratch {
        ArticleScratch article;
        AdaptiveScratch adaptive;
    };

    SkyAndOutdoors sky_and_outdoors(const GatherPoint& point) const {
        Scratch& memory = scratch.local();
        return article ? integrate_article(point, light, *article, article_rule, visibility, memory.article)
                       : integrate_adaptively(point, light, tree, tolerance, visibility, memory.adaptive);
    }

    ApertureLight light;
    FacetTree tree;
    const Visibility& visibility;
    double tolerance;
    ArticleRule article_rule;
    std::optional<ArticleElements> article;  ///< empty: adaptive
    mutable ThreadScratch<Scratch> scratch{};
};

DirectLight::DirectLight(const Scene& scene, const Building& building, const PatchGrid& grid,
                         const OutdoorLight& outdoors, const Visibility& visibility)
    : implementation_(new Implementation{
          .light = ApertureLight(scene, building, grid, outdoors),
          .tree = FacetTree(building),
          .visibility = visibility,
          .tolerance = scene.direct.tolerance,
          .article_rule = scene.direct.article,
          .article = scene.direct.method == DirectMethod::article ? std::optional<ArticleElements>(building)
                                                                  : std::nullopt,
      }) {}

DirectLight::~DirectLight() = default;

DirectIlluminance DirectLight::at(const GatherPoint& point) const {
    DirectIlluminance found = without_sun(point);
    found.sun_lx = implementation_->light.sun_lx(point, implementation_->visibility);
    return found;
}

DirectIlluminance DirectLight::without_sun(const GatherPoint& point) const {
    const SkyAndOutdoors found = implementation_->sky_and_outdoors(point);
    return {.sky_lx = found.sky_lx, .sun_lx = {}, .outdoor_lx = found.outdoor_lx, .ground_lx = found.ground_lx};
}

void DirectLight::sun_at(std::span<const glm::dvec3> positions_m, const glm::dvec3& normal,
                         std::span<Band3> sun_lx) const {
    NATUREL_EXPECT(positions_m.size() == sun_lx.size());
    for (std::size_t i = 0; i < positions_m.size(); ++i) {
        sun_lx[i] = implementation_->light.sun_lx({positions_m[i], normal}, implementation_->visibility);
    }
}

}  // namespace naturel
