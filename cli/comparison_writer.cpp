#include "cli/comparison_writer.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/csv_table.h"
#include "cli/machine_description.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

Json settings_json(const Visibility& visibility) {
    Json settings{{"backend", visibility.name()}};
    for (const auto& [name, value] : visibility.settings()) settings[name] = value;
    return settings;
}

Json json_of(const DifferenceStatistics& s) {
    const auto percent = [&](double lx) { return s.mean_reference_lx > 0.0 ? Json(100.0 * lx / s.mean_reference_lx) : Json(); };
    return {{"mean_lx", s.mean_lx},
            {"rms_lx", s.rms_lx},
            {"p95_lx", s.percentile_95_lx},
            {"worst_lx", s.worst_lx},
            {"worst_point", s.worst_point},
            {"mean_percent", percent(s.mean_lx)},
            {"rms_percent", percent(s.rms_lx)}};
}

/// By set and component.
Json sets_json(const Comparison& comparison, const LightState& a, const LightState& b) {
    Json sets = Json::object();
    for (const PointSet& set : point_sets(comparison)) {
        Json components = Json::object();
        for (std::size_t c = 0; c < ComponentsAndTotal::names.size(); ++c)
            components[std::string(ComponentsAndTotal::names[c])] = json_of(difference_statistics(comparison, a, b, c, set));
        sets[set.id] = components;
    }
    return sets;
}

/// Total illuminance at the sensors indoors, signed.
Json totals_json(const Comparison& comparison, const LightState& a, const LightState& b) {
    Json list = Json::array();
    for (std::size_t s = 0; s < a.sensors.size(); ++s)
        if (comparison.budget.sensors[s].medium == Medium::indoor_air) list.push_back((a.sensors[s] - b.sensors[s]).total());
    return list;
}

std::vector<double> row_sums(const FormFactors& f) {
    std::vector<double> sums(f.row_count());
    for (std::size_t i = 0; i < sums.size(); ++i)
        for (std::uint64_t k = f.row_begin[i]; k < f.row_begin[i + 1]; ++k) sums[i] += f.value[k];
    return sums;
}

Json row_sums_json(const FormFactors& f) {
    const std::vector<double> sums = row_sums(f);
    if (sums.empty()) return Json();
    double mean = 0.0;
    for (const double sum : sums) mean += sum / static_cast<double>(sums.size());
    return {{"mean", mean}, {"min", *std::ranges::min_element(sums)}, {"max", *std::ranges::max_element(sums)}};
}

/// A pair of patches whose form factors differ.
struct Pair {
    std::size_t from = 0, to = 0;
    double reference = 0.0, method = 0.0;
    double flux = 0.0;  ///< what the difference carries, lm: area x exitance x difference
};

/// Every pair that either of them has, row by row.
template <class Use>
void for_each_pair(const FormFactors& a, const FormFactors& b, const Use& use) {
    for (std::size_t i = 0; i < a.row_count(); ++i) {
        std::uint64_t k = a.row_begin[i], m = b.row_begin[i];
        while (k < a.row_begin[i + 1] || m < b.row_begin[i + 1]) {
            const std::uint32_t ka = k < a.row_begin[i + 1] ? a.column[k] : ~0u, kb = m < b.row_begin[i + 1] ? b.column[m] : ~0u;
            const std::uint32_t j = std::min(ka, kb);
            use(i, std::size_t{j}, ka == j ? a.value[k++] : 0.0, kb == j ? b.value[m++] : 0.0);
        }
    }
}

/// Per cent of the outdoor illuminance, and points of that.
Json daylight_factor_json(const Comparison& comparison) {
    const double outdoors_lx = comparison.budget.outdoor_horizontal_lx;
    Json sets = Json::object();
    if (!(outdoors_lx > 0.0)) return sets;
    for (const PointSet& set : point_sets(comparison)) {
        const DifferenceStatistics s = difference_statistics(comparison, comparison.budget.method(), comparison.budget.reference,
                                                             ComponentsAndTotal::from_sky_index, set);
        const auto percent = [&](double lx) { return 100.0 * lx / outdoors_lx; };
        sets[set.id] = {{"reference_mean_percent", percent(s.mean_reference_lx)},
                        {"mean_points", percent(s.mean_lx)},
                        {"rms_points", percent(s.rms_lx)},
                        {"p95_points", percent(s.percentile_95_lx)},
                        {"worst_points", percent(s.worst_lx)},
                        {"worst_point", s.worst_point}};
    }
    return sets;
}

Json form_factors_json(const Comparison& comparison) {
    const BudgetFormFactors& f = comparison.form_factors;
    const std::vector<double>& exitance = comparison.budget.reference.patch_exitance_lm_m2;
    double squares = 0.0, weights = 0.0, weighted = 0.0, signed_sum = 0.0;
    std::size_t pairs = 0;
    std::vector<Pair> worst;
    const auto larger = [](const Pair& a, const Pair& b) { return std::abs(a.flux) > std::abs(b.flux); };
    constexpr std::size_t listed = 20;
    for_each_pair(f.reference, f.method, [&](std::size_t i, std::size_t j, double reference, double method) {
        const double difference = method - reference, weight = comparison.grid.patches[i].area_m2 * exitance[j];
        squares += difference * difference;
        weights += weight * reference;
        weighted += weight * std::abs(difference);
        signed_sum += weight * difference;
        ++pairs;
        const Pair pair{i, j, reference, method, weight * difference};
        if (worst.size() < listed || larger(pair, worst.front())) {
            worst.push_back(pair);
            std::ranges::push_heap(worst, larger);
            if (worst.size() > listed) std::ranges::pop_heap(worst, larger), worst.pop_back();
        }
    });
    std::ranges::sort(worst, larger);
    Json list = Json::array();
    for (const Pair& pair : worst) {
        const Patch &from = comparison.grid.patches[pair.from], &to = comparison.grid.patches[pair.to];
        const auto place = [](const glm::dvec3& p) { return Json{p.x, p.y, p.z}; };
        list.push_back({{"from", pair.from},
                        {"to", pair.to},
                        {"from_face", comparison.building.faces[index(from.face)].name},
                        {"to_face", comparison.building.faces[index(to.face)].name},
                        {"from_m", place(from.centroid_m)},
                        {"to_m", place(to.centroid_m)},
                        {"reference", pair.reference},
                        {"method", pair.method},
                        {"flux_lm", pair.flux}});
    }
    const double scale = weights > 0.0 ? 1.0 / weights : 0.0;
    return {{"row_sums",
             {{"reference", row_sums_json(f.reference)}, {"again", row_sums_json(f.again)}, {"method", row_sums_json(f.method)}}},
            {"reciprocity_gap",
             {{"reference", f.reference.quality.reciprocity_gap},
              {"again", f.again.quality.reciprocity_gap},
              {"method", f.method.quality.reciprocity_gap}}},
            {"pairs", pairs},
            {"rms", std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, pairs)))},
            {"weighted_size", weighted * scale},
            {"weighted_mean", signed_sum * scale},
            {"worst_pairs", list}};
}

Json exitance_json(const Comparison& comparison) {
    const std::vector<double>&a = comparison.budget.reference.patch_exitance_lm_m2,
                     &b = comparison.budget.method().patch_exitance_lm_m2;
    double area = 0.0, flux = 0.0, mean = 0.0, squares = 0.0, worst = 0.0;
    for (std::size_t p = 0; p < a.size(); ++p) {
        const double area_m2 = comparison.grid.patches[p].area_m2;
        area += area_m2;
        flux += area_m2 * a[p];
        mean += area_m2 * (b[p] - a[p]);
        squares += area_m2 * (b[p] - a[p]) * (b[p] - a[p]);
        if (std::abs(b[p] - a[p]) > std::abs(worst)) worst = b[p] - a[p];
    }
    if (!(flux > 0.0)) return Json();
    return {{"mean_percent", 100.0 * mean / flux},
            {"rms_percent", 100.0 * std::sqrt(squares / area) * area / flux},
            {"worst_percent", 100.0 * worst * area / flux}};
}

Json sweeps_json(const Comparison& comparison) {
    Json list = Json::array();
    for (const Sweep& sweep : comparison.sweeps) {
        Json points = Json::array();
        for (const SweepPoint& point : sweep.points)
            points.push_back({{"label", point.label},
                              {"value", point.value},
                              {"rms_percent", point.rms_percent},
                              {"p95_percent", point.percentile_95_percent},
                              {"seconds", point.seconds},
                              {"seconds_low", point.seconds_low},
                              {"seconds_high", point.seconds_high},
                              {"pareto", point.pareto}});
        Json one{{"parameter", sweep.parameter}, {"unit", sweep.unit}, {"points", points}};
        if (sweep.has_slope) {
            one["slope"] = sweep.slope;
            one["slope_low"] = sweep.slope_low;
            one["slope_high"] = sweep.slope_high;
        }
        list.push_back(one);
    }
    return list;
}

std::string points_csv(const Comparison& comparison) {
    const ErrorBudget& budget = comparison.budget;
    CsvTable table("point,set,x_m,y_m,z_m,state,component,illuminance_lx,difference_lx,reference_error_lx");
    for (std::size_t s = 0; s < budget.sensors.size(); ++s) {
        const Sensor& sensor = budget.sensors[s];
        if (sensor.medium != Medium::indoor_air) continue;
        const ComponentsAndTotal error = budget.again.sensors[s] - budget.reference.sensors[s];
        const auto add = [&](std::string_view state, const LightState& now, const LightState& then) {
            const ComponentsAndTotal difference = now.sensors[s] - then.sensors[s];
            for (std::size_t c = 0; c < ComponentsAndTotal::names.size(); ++c)
                table.cell(std::string_view(sensor.id))
                    .cell(std::string_view(comparison.scene.sensors[sensor.set].id))
                    .cell(sensor.point.position_m)
                    .cell(state)
                    .cell(ComponentsAndTotal::names[c])
                    .cell(now.sensors[s].lx[c])
                    .cell(difference.lx[c])
                    .cell(error.lx[c])
                    .end_row();
        };
        add("reference", budget.reference, budget.reference);
        for (std::size_t k = 0; k < budget.ingredients.size(); ++k)
            add(budget.ingredients[k].name, budget.ingredients[k].in_sequence, state_before(budget, k));
    }
    return std::move(table).take();
}

std::string ingredients_csv(const Comparison& comparison) {
    const ErrorBudget& budget = comparison.budget;
    CsvTable table("ingredient,group,how,set,component,points,mean_lx,rms_lx,p95_lx,worst_lx,worst_point,mean_reference_lx,resolved");
    for (const PointSet& set : point_sets(comparison)) {
        const auto add = [&](std::string_view name, std::string_view group, std::string_view how, const LightState& a,
                             const LightState& b, std::string_view resolved) {
            for (std::size_t c = 0; c < ComponentsAndTotal::names.size(); ++c) {
                const DifferenceStatistics d = difference_statistics(comparison, a, b, c, set);
                table.cell(name).cell(group).cell(how).cell(std::string_view(set.id)).cell(ComponentsAndTotal::names[c]).cell(d.points);
                table.cell(d.mean_lx).cell(d.rms_lx).cell(d.percentile_95_lx).cell(d.worst_lx);
                table.cell(std::string_view(d.worst_point)).cell(d.mean_reference_lx).cell(resolved).end_row();
            }
        };
        for (std::size_t k = 0; k < budget.ingredients.size(); ++k) {
            const Ingredient& ingredient = budget.ingredients[k];
            const std::string_view resolved = is_resolved(comparison, k, set) ? "yes" : "no";
            add(ingredient.name, ingredient.group, "in sequence", ingredient.in_sequence, state_before(budget, k), resolved);
            add(ingredient.name, ingredient.group, "alone", ingredient.alone, budget.reference, resolved);
        }
        add("total", "", "in sequence", budget.method(), budget.reference, "");
        add("reference error", "", "", budget.again, budget.reference, "");
    }
    return std::move(table).take();
}

std::string compared_patches_csv(const Comparison& comparison) {
    const BudgetFormFactors& f = comparison.form_factors;
    CsvTable table("patch,face,x_m,y_m,z_m,area_m2,row_sum_reference,row_sum_again,row_sum_method,exitance_reference_lm_m2,exitance_method_lm_m2");
    const std::vector<double> reference = row_sums(f.reference), again = row_sums(f.again), method = row_sums(f.method);
    for (std::size_t p = 0; p < reference.size(); ++p) {
        const Patch& patch = comparison.grid.patches[p];
        table.cell(p).cell(std::string_view(comparison.building.faces[index(patch.face)].name)).cell(patch.centroid_m).cell(patch.area_m2);
        table.cell(reference[p]).cell(again[p]).cell(method[p]);
        table.cell(comparison.budget.reference.patch_exitance_lm_m2[p]).cell(comparison.budget.method().patch_exitance_lm_m2[p]).end_row();
    }
    return std::move(table).take();
}

std::string sweeps_csv(const Comparison& comparison) {
    CsvTable table("parameter,label,value,rms_percent,p95_percent,seconds,seconds_low,seconds_high,pareto");
    for (const Sweep& sweep : comparison.sweeps)
        for (const SweepPoint& point : sweep.points)
            table.cell(std::string_view(sweep.parameter))
                .cell(std::string_view(point.label))
                .cell(point.value)
                .cell(point.rms_percent)
                .cell(point.percentile_95_percent)
                .cell(point.seconds)
                .cell(point.seconds_low)
                .cell(point.seconds_high)
                .cell(std::string_view(point.pareto ? "yes" : "no"))
                .end_row();
    return std::move(table).take();
}

}  // namespace

Json comparison_json(const Comparison& comparison) {
    const ErrorBudget& budget = comparison.budget;
    Json points = Json::array(), sets = Json::array(), ingredients = Json::array(), pictures = Json::array();
    for (std::size_t s = 0; s < budget.sensors.size(); ++s) {
        const Sensor& sensor = budget.sensors[s];
        if (sensor.medium != Medium::indoor_air) continue;
        const glm::dvec3 &p = sensor.point.position_m, &n = sensor.point.normal;
        points.push_back({{"id", sensor.id},
                          {"set", comparison.scene.sensors[sensor.set].id},
                          {"x", p.x}, {"y", p.y}, {"z", p.z}, {"nx", n.x}, {"ny", n.y}, {"nz", n.z},
                          {"reference", budget.reference.sensors[s].lx},
                          {"method", budget.method().sensors[s].lx},
                          {"again", budget.again.sensors[s].lx}});
    }
    for (const PointSet& set : point_sets(comparison))
        sets.push_back({{"id", set.id},
                        {"nodes", set.nodes},
                        {"points", difference_statistics(comparison, budget.method(), budget.reference, ComponentsAndTotal::total_index, set).points}});
    for (std::size_t k = 0; k < budget.ingredients.size(); ++k) {
        const Ingredient& ingredient = budget.ingredients[k];
        bool resolved = false;
        Json resolved_sets = Json::object();
        for (const PointSet& set : point_sets(comparison)) {
            resolved_sets[set.id] = is_resolved(comparison, k, set);
            resolved = resolved || resolved_sets[set.id].get<bool>();
        }
        ingredients.push_back({{"name", ingredient.name},
                               {"group", ingredient.group},
                               {"replaces", ingredient.replaces},
                               {"resolved", resolved},
                               {"resolved_sets", resolved_sets},
                               {"sets", sets_json(comparison, ingredient.in_sequence, state_before(budget, k))},
                               {"alone_sets", sets_json(comparison, ingredient.alone, budget.reference)},
                               {"total_lx", totals_json(comparison, ingredient.in_sequence, state_before(budget, k))},
                               {"alone_total_lx", totals_json(comparison, ingredient.alone, budget.reference)}});
    }
    for (const PictureDifference& picture : comparison.pictures)
        pictures.push_back({{"view", picture.view}, {"mean", picture.mean}, {"p95", picture.percentile_95}, {"worst", picture.worst}});
    Json method = settings_json(comparison.visibilities.projection);
    for (const auto& [name, value] : comparison.options.words()) method[name] = value;
    Json reference = settings_json(comparison.visibilities.reference);
    reference["direct"] = "adaptive";
    reference["direct_tolerance"] = comparison.options.reference_tolerance;
    Json again = settings_json(comparison.visibilities.again);
    again["direct"] = "adaptive";
    again["direct_tolerance"] = 4.0 * comparison.options.reference_tolerance;
    const MachineDescription machine = describe_machine();
    return {{"naturel", NATUREL_VERSION},
            {"scene",
             {{"name", comparison.scene.name},
              {"file", comparison.options.scene.filename().string()},
              {"sha256", comparison.scene.source_sha256}}},
            {"machine",
             {{"cpu", machine.cpu.empty() ? "unknown" : machine.cpu}, {"cores", machine.processors}, {"threads", comparison.options.threads}}},
            {"grid", {{"spacing_m", comparison.scene.grid.spacing_m}, {"patches", comparison.grid.patches.size()}, {"nodes", comparison.grid.nodes.size()}}},
            {"settings", {{"method", method}, {"reference", reference}, {"again", again}}},
            {"outdoor_horizontal_illuminance_lx", budget.outdoor_horizontal_lx},
            {"components", ComponentsAndTotal::names},
            {"sets", sets},
            {"points", points},
            {"ingredients", ingredients},
            {"total", {{"sets", sets_json(comparison, budget.method(), budget.reference)}}},
            {"reference_error", {{"sets", sets_json(comparison, budget.again, budget.reference)}}},
            {"daylight_factor", {{"sets", daylight_factor_json(comparison)}}},
            {"form_factors", form_factors_json(comparison)},
            {"exitance", exitance_json(comparison)},
            {"sweeps", sweeps_json(comparison)},
            {"pictures", pictures}};
}

std::vector<std::pair<std::string, std::string>> comparison_tables(const Comparison& comparison) {
    return {{"points.csv", points_csv(comparison)},
            {"ingredients.csv", ingredients_csv(comparison)},
            {"patches.csv", compared_patches_csv(comparison)},
            {"sweeps.csv", sweeps_csv(comparison)}};
}

}  // namespace naturel
