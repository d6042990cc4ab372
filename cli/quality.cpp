#include "cli/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/choices.h"

namespace naturel {
namespace {

constexpr double not_named = 0.0;  // no spacing that a scene may ask for

}  // namespace

std::string quality_table() {
    std::string table = fmt::format("{:30}", "Quality");
    const auto row = [&](std::string_view label, const auto& cell) {
        table += fmt::format("\n  {:28}", label);
        for (const QualityPreset& quality : quality_presets)
            table += fmt::format("{:>11}", cell(quality));
    };
    for (const QualityPreset& quality : quality_presets)
        table += fmt::format("{:>11}", quality.name);
    row("grid indoors, m", [](const auto& q) { return q.grid_spacing_m; });
    row("  but patches at most about", [](const auto& q) { return q.most_patches; });
    row("grid outdoors, m", [](const auto& q) { return q.outdoor_grid_spacing_m; });
    row("direct light, tolerance", [](const auto& q) { return q.direct_tolerance; });
    row("radiosity, tolerance", [](const auto& q) { return q.radiosity_tolerance; });
    row("IRC at nodes", [](const auto& q) { return name_of(indirect_methods, q.node_indirect); });
    row("IRC at sensors", [](const auto& q) { return name_of(indirect_methods, q.sensor_indirect); });
    row("embree: form factors", [](const auto& q) { return name_of(form_factor_methods, q.form_factors); });
    row("  pairwise: tolerance", [](const auto& q) { return q.pair_tolerance; });
    row("  hemisphere: rays per patch", [](const auto& q) { return q.rays_per_patch; });
    row("  and rays per point", [](const auto& q) { return q.rays_per_point; });
    row("hemicube: cells along side", [](const auto& q) { return q.cells; });
    return table +
           "\nOptions given here, and keys of the scene's \"grid\" and \"direct\", win over the table.";
}

SceneDefaults scene_defaults(const QualityPreset& quality) {
    SceneDefaults defaults;
    defaults.grid.spacing_m = not_named;
    defaults.grid.outdoor_spacing_m = quality.outdoor_grid_spacing_m;
    defaults.direct.tolerance = quality.direct_tolerance;
    return defaults;
}

BackendOptions backend_options(const QualityPreset& quality) {
    BackendOptions options;
    options.embree.form_factors = quality.form_factors;
    options.embree.pair_tolerance = quality.pair_tolerance;
    options.embree.rays_per_patch = quality.rays_per_patch;
    options.embree.rays_per_point = quality.rays_per_point;
    options.hemicube.resolution = quality.cells;
    return options;
}

void choose_grid_spacing(Scene& scene, const Building& building, const QualityPreset& quality) {
    if (scene.grid.spacing_m != not_named) return;
    double area_m2 = 0.0;
    for (const Facet& facet : building.facets)
        if (facet.environment == Environment::indoor) area_m2 += facet.area_m2;
    scene.grid.spacing_m =
        std::max(quality.grid_spacing_m, std::sqrt(area_m2 / static_cast<double>(quality.most_patches)));
}

}  // namespace naturel
