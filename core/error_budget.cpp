#include "core/error_budget.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <optional>

#include "core/parallel.h"
#include "core/polygon_form_factor.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

/// a + b - c, entry by entry, without what would be negative.
FormFactors plus_difference(const FormFactors& a, const FormFactors& b, const FormFactors& c) {
    FormFactors sum;
    sum.row_begin.push_back(0);
    std::map<std::uint32_t, double> row;
    for (std::size_t i = 0; i < a.row_count(); ++i) {
        row.clear();
        const auto add = [&](const FormFactors& f, double sign) {
            for (std::uint64_t k = f.row_begin[i]; k < f.row_begin[i + 1]; ++k) row[f.column[k]] += sign * f.value[k];
        };
        add(a, 1.0), add(b, 1.0), add(c, -1.0);
        for (const auto& [j, value] : row) {
            if (value > 0.0) sum.column.push_back(j), sum.value.push_back(value);
        }
        sum.row_begin.push_back(sum.value.size());
        sum.lost.push_back(a.lost[i]);
        sum.truncated.push_back(std::max(0.0, a.truncated[i] + b.truncated[i] - c.truncated[i]));
    }
    return sum;
}

struct Scratch {
    std::vector<glm::dvec3> left, kept;
    FormFactorRow row;
};

/// Point-to-polygon form factor in closed form; the polygon is seen from its front. Left in scratch.kept: what of it lies in front of
/// the point, as vectors from there.
double from_point(const Patch& from, std::span<const glm::dvec3> polygon, const glm::dvec3& normal, Scratch& scratch) {
    scratch.kept.clear();
    if (glm::dot(normal, from.centroid_m - polygon[0]) <= 0.0) return 0.0;
    scratch.left.clear();
    for (const glm::dvec3& vertex : polygon) scratch.left.push_back(vertex - from.centroid_m);
    keep_half_space(scratch.left, from.normal, scratch.kept);
    return scratch.kept.empty() ? 0.0 : std::max(0.0, glm::dot(from.normal, vector_solid_angle(scratch.kept))) / pi;
}

double unoccluded(const PatchGrid& grid, PatchId from, PatchId to) {
    const Patch &a = grid.patches[index(from)], &b = grid.patches[index(to)];
    return unoccluded_exchange_m2(grid.polygon_of(from), a.normal, grid.polygon_of(to), b.normal) / a.area_m2;
}

/// Two ways to the same closed form differ by no more than this, as a share.
constexpr double same_value = 1e-6;

}  // namespace

FormFactors seen_from_centroids(const FormFactors& form_factors, const PatchGrid& grid) {
    FormFactors seen = form_factors;
    ThreadScratch<Scratch> scratch;
    parallel_for(form_factors.row_count(), 8, [&](std::size_t i) {
        const auto id = make_id<PatchId>(i);
        for (std::uint64_t k = form_factors.row_begin[i]; k < form_factors.row_begin[i + 1]; ++k) {
            const auto other = make_id<PatchId>(form_factors.column[k]);
            const double of_patch = unoccluded(grid, id, other);
            if (!(of_patch > 0.0)) continue;
            seen.value[k] *= from_point(grid.patches[i], grid.polygon_of(other), grid.patches[index(other)].normal, scratch.local()) / of_patch;
        }
    });
    return seen;
}

FormFactors visible_from_centroids(const FormFactors& reference, const FormFactors& near, const PatchGrid& grid,
                                   const Visibility& visibility, Progress& progress) {
    std::vector<std::vector<std::pair<std::uint32_t, double>>> rows(reference.row_count());
    ThreadScratch<Scratch> scratch;
    parallel_stage("from centroids", rows.size(), 4, progress, [&](std::size_t i) {
        FormFactorRow& row = scratch.local().row;
        visibility.gather_row({grid.patches[i].centroid_m, grid.patches[i].normal}, row);
        std::size_t seen = 0;
        for (std::uint64_t k = reference.row_begin[i]; k < reference.row_begin[i + 1]; ++k) {
            const std::uint32_t j = reference.column[k];
            while (seen < row.patches.size() && index(row.patches[seen]) < j) ++seen;
            const bool all_of_it = std::abs(reference.value[k] - unoccluded(grid, make_id<PatchId>(i), make_id<PatchId>(j))) <=
                                   same_value * reference.value[k];
            if (all_of_it) {
                rows[i].emplace_back(j, near.value[k]);
            } else if (seen < row.patches.size() && index(row.patches[seen]) == j) {
                rows[i].emplace_back(j, row.values[seen]);
            }
        }
    });
    FormFactors visible;
    visible.row_begin.push_back(0);
    for (const auto& row : rows) {
        for (const auto& [j, value] : row) {
            if (value > 0.0) visible.column.push_back(j), visible.value.push_back(value);
        }
        visible.row_begin.push_back(visible.value.size());
    }
    visible.lost = reference.lost;
    visible.truncated = reference.truncated;
    return visible;
}

FormFactors caught_by_square(const FormFactors& form_factors, const Building& building, const PatchGrid& grid,
                             double half_side_over_height) {
    FormFactors caught = form_factors;
    ThreadScratch<Scratch> all_scratch;
    parallel_for(form_factors.row_count(), 8, [&](std::size_t i) {
        Scratch& scratch = all_scratch.local();
        const Patch& from = grid.patches[i];
        const glm::dvec3 u = glm::normalize(building.faces[index(from.face)].frame.u_m), v = glm::cross(from.normal, u);
        const std::array<glm::dvec3, 4> sides{half_side_over_height * from.normal - u, half_side_over_height * from.normal + u,
                                              half_side_over_height * from.normal - v, half_side_over_height * from.normal + v};
        for (std::uint64_t k = form_factors.row_begin[i]; k < form_factors.row_begin[i + 1]; ++k) {
            const auto other = make_id<PatchId>(form_factors.column[k]);
            const double whole = from_point(from, grid.polygon_of(other), grid.patches[index(other)].normal, scratch);
            if (!(whole > 0.0)) continue;
            for (const glm::dvec3& side : sides) {
                std::swap(scratch.left, scratch.kept);
                keep_half_space(scratch.left, side, scratch.kept);
                if (scratch.kept.empty()) break;
            }
            const double part = scratch.kept.empty() ? 0.0 : std::max(0.0, glm::dot(from.normal, vector_solid_angle(scratch.kept))) / pi;
            const double lost = caught.value[k] * std::clamp(1.0 - part / whole, 0.0, 1.0);
            caught.value[k] -= lost;
            caught.truncated[i] += lost;
        }
    });
    return caught;
}

ErrorBudget compute_error_budget(const Scene& scene, const Building& building, const PatchGrid& grid,
                                 const BudgetVisibilities& ways, const BudgetOptions& options, BudgetFormFactors& form_factors,
                                 Progress& progress) {
    MethodCombinations all(scene, building, grid, options.radiosity, progress);
    const FormFactorOptions as_they_are{.repair = FormFactorRepair::none};
    const auto rows_of = [&](const Visibility& visibility) { return compute_form_factors(visibility, grid, as_they_are, progress); };
    form_factors.reference = rows_of(ways.reference);
    form_factors.again = rows_of(ways.again);
    form_factors.method = rows_of(ways.projection);
    const FormFactors& reference = form_factors.reference;

    const DirectOptions fine{.method = DirectMethod::adaptive, .tolerance = options.reference_tolerance};
    const MethodCombinations::Direct direct = all.direct(ways.reference, fine);
    const MethodCombinations::Gathering gathering = all.gathering(ways.reference);
    constexpr FormFactorRepair unrepaired = FormFactorRepair::none;

    ErrorBudget budget;
    budget.sensors = all.sensors();
    budget.outdoor_horizontal_lx = direct.grid.outdoors.horizontal_illuminance().value;
    budget.reference_solution = all.solution(reference, direct, gathering, IndirectMethod::gather, unrepaired);
    budget.reference = all.state(*budget.reference_solution);
    {
        DirectOptions coarser = fine;
        coarser.tolerance *= 4.0;
        budget.again = all.state(form_factors.again, all.direct(ways.again, coarser), all.gathering(ways.again),
                                 IndirectMethod::gather, unrepaired);
    }

    // The combination so far.
    FormFactors rows = reference;
    std::optional<MethodCombinations::Direct> own_direct;
    std::optional<MethodCombinations::Gathering> own_gathering;
    IndirectMethod indirect = IndirectMethod::gather;
    FormFactorRepair repair = unrepaired;
    const auto add = [&](std::string name, std::string group, std::string replaces, LightState alone) {
        budget.method_solution = all.solution(rows, own_direct ? *own_direct : direct, own_gathering ? *own_gathering : gathering,
                                              indirect, repair);
        budget.ingredients.push_back({std::move(name), std::move(group), std::move(replaces), all.state(*budget.method_solution),
                                      std::move(alone)});
    };
    const auto alone_rows = [&](const FormFactors& f) { return all.state(f, direct, gathering, IndirectMethod::gather, unrepaired); };

    const FormFactors near = seen_from_centroids(reference, grid);
    rows = near;
    add("proximity", "form factors", "a patch seen from its centroid instead of from all over it, where nothing is in the way",
        alone_rows(near));
    const FormFactors visible = visible_from_centroids(reference, near, grid, ways.reference, progress);
    rows = visible;
    add("partial visibility", "form factors", "what the centroid sees instead of the share of the patch that sees it",
        alone_rows(plus_difference(reference, visible, near)));
    const FormFactors caught = options.half_side_over_height ? caught_by_square(visible, building, grid, *options.half_side_over_height)
                                                             : visible;
    if (options.half_side_over_height) {
        rows = caught;
        add("truncation", "form factors", "what the square catches instead of the hemisphere",
            alone_rows(caught_by_square(reference, building, grid, *options.half_side_over_height)));
    }
    rows = form_factors.method;
    add("cells", "form factors", "cells instead of exact directions", alone_rows(plus_difference(reference, form_factors.method, caught)));
    if (options.repair != FormFactorRepair::none) {
        rows = compute_form_factors(ways.projection, grid, {.repair = options.repair}, progress);
        const FormFactors repaired = rows;
        repair = options.repair;
        add("repair", "form factors", "rows repaired instead of as they are", alone_rows(plus_difference(reference, repaired, form_factors.method)));
    }

    if (options.direct.method == DirectMethod::article) {
        const auto article = [&](bool count_by_solid_angle, bool near_zones) {
            DirectOptions rule = options.direct;
            rule.article = {.count_by_solid_angle = count_by_solid_angle, .near_zones = near_zones};
            return rule;
        };
        const auto alone_direct = [&](const MethodCombinations::Direct& d) {
            return all.state(reference, d, gathering, IndirectMethod::gather, unrepaired);
        };
        own_direct = all.direct(ways.reference, article(false, false));
        const LightState centres = alone_direct(*own_direct);
        add("element centres", "direct light", "256 aperture elements, each with its value at its centre, instead of exact integrals", centres);
        // The rules for how many elements, and for zones close to an aperture, have no meaning but with elements.
        const auto beside_centres = [&](const LightState& with) {
            LightState state = budget.reference;
            const auto shift = [](std::vector<ComponentsAndTotal>& values, const std::vector<ComponentsAndTotal>& a, const std::vector<ComponentsAndTotal>& b) {
                for (std::size_t k = 0; k < values.size(); ++k) {
                    for (std::size_t c = 0; c < values[k].lx.size(); ++c) values[k].lx[c] += a[k].lx[c] - b[k].lx[c];
                }
            };
            shift(state.sensors, with.sensors, centres.sensors);
            shift(state.nodes, with.nodes, centres.nodes);
            for (std::size_t p = 0; p < state.patch_exitance_lm_m2.size(); ++p)
                state.patch_exitance_lm_m2[p] += with.patch_exitance_lm_m2[p] - centres.patch_exitance_lm_m2[p];
            return state;
        };
        own_direct = all.direct(ways.reference, article(true, false));
        add("element count", "direct light", "16, 64 or 256 aperture elements by solid angle instead of always 256",
            beside_centres(alone_direct(*own_direct)));
        own_direct = all.direct(ways.reference, article(true, true));
        add("near-aperture zones", "direct light", "256 zones of sky close to an aperture instead of elements",
            beside_centres(alone_direct(all.direct(ways.reference, article(false, true)))));
        own_direct = all.direct(ways.projection, article(true, true));
        add("aperture visibility", "direct light", "cells instead of rays towards aperture elements",
            alone_direct(all.direct(ways.projection, fine)));
    } else {
        own_direct = all.direct(ways.reference, options.direct);
        add("direct tolerance", "direct light", "the tolerance of the method instead of that of the reference",
            all.state(reference, *own_direct, gathering, IndirectMethod::gather, unrepaired));
        own_direct = all.direct(ways.projection, options.direct);
        add("aperture visibility", "direct light", "cells instead of rays towards the apertures",
            all.state(reference, all.direct(ways.projection, fine), gathering, IndirectMethod::gather, unrepaired));
    }

    own_gathering = all.gathering(ways.projection);
    add("gathering", "result", "what the cells over a point show instead of rays from it",
        all.state(reference, direct, *own_gathering, IndirectMethod::gather, unrepaired));
    if (options.indirect == IndirectMethod::patch) {
        indirect = IndirectMethod::patch;
        add("IRC per patch", "result", "at corners the mean of the patches that meet there, instead of gathered light",
            all.state(reference, direct, gathering, IndirectMethod::patch, unrepaired));
    }
    return budget;
}

}  // namespace naturel
