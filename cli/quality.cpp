#include "cli/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/choices.h"

namespace naturel {
namespace {

constexpr double not_named = 0.0;  // no spacing that a scene may ask for

/// The rows of the table that matter to what a command computes.
enum class TableRows { all, form_factors };

std::string table_of(TableRows rows) {
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
    if (rows == TableRows::all) {
        row("grid outdoors, m", [](const auto& q) { return q.outdoor_grid_spacing_m; });
        row("direct light, tolerance", [](const auto& q) { return q.direct_tolerance; });
        row("radiosity, tolerance", [](const auto& q) { return q.radiosity_tolerance; });
        row("IRC at nodes", [](const auto& q) { return name_of(indirect_methods, q.node_indirect); });
        row("IRC at sensors", [](const auto& q) { return name_of(indirect_methods, q.sensor_indirect); });
    }
    row("embree: form factors", [](const auto& q) { return name_of(form_factor_methods, q.form_factors); });
    row("  pairwise: patches at most", [](const auto& q) {
        return q.most_patches_for_pairs == any_number ? std::string("any") : std::to_string(q.most_patches_for_pairs);
    });
    row("  pairwise: tolerance", [](const auto& q) { return q.pair_tolerance; });
    row("  hemisphere: rays per patch", [](const auto& q) { return q.rays_per_patch; });
    if (rows == TableRows::all) row("  and rays per point", [](const auto& q) { return q.rays_per_point; });
    row("hemicube: cells along side", [](const auto& q) { return q.cells; });
    return table + fmt::format("\nWith more patches than that reference takes hemisphere; to have that few it lays cells of up to {} m."
                               "\nOptions given here, and keys of the scene's {}, win over the table.",
                               quality_presets.back().longest_cell_for_pairs_m,
                               rows == TableRows::all ? "\"grid\" and \"direct\"" : "\"grid\"");
}

}  // namespace

std::string quality_table() {
    return table_of(TableRows::all);
}

std::string form_factor_quality_table() {
    return table_of(TableRows::form_factors);
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
    options.most_patches_for_pairs = quality.most_patches_for_pairs;
    return options;
}

void choose_grid_spacing(Scene& scene, const Building& building, const QualityPreset& quality) {
    if (scene.grid.spacing_m != not_named) return;
    double area_m2 = 0.0;
    for (const Facet& facet : building.facets)
        if (facet.environment == Environment::indoor) area_m2 += facet.area_m2;
    const auto spacing_m = [&](double patches) { return std::max(quality.grid_spacing_m, std::sqrt(area_m2 / patches)); };
    scene.grid.spacing_m = spacing_m(static_cast<double>(quality.most_patches));
    if (quality.form_factors == FormFactorMethod::pairwise) {
        // Cells that end at edges and zones make up to half as many again.
        const double few_m = spacing_m(static_cast<double>(quality.most_patches_for_pairs) / 1.5);
        if (few_m <= quality.longest_cell_for_pairs_m) scene.grid.spacing_m = few_m;
    }
}

}  // namespace naturel
