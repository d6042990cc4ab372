#include "cli/view_glare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/json_text.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

/// Wienold's classes of office work.
std::string_view class_of(double probability) {
    if (probability < 0.35) return "imperceptible";
    if (probability < 0.40) return "perceptible";
    return probability < 0.45 ? "disturbing" : "intolerable";
}

}  // namespace

bool ViewGlare::valid() const {
    return illuminance_lx >= least_for_glare_probability.value && probability >= least_glare_probability &&
           probability <= largest_glare_probability;
}

bool ViewGlare::simplified_valid() const {
    return sun_lx <= 0.0 && illuminance_lx >= least_for_glare_probability.value && simplified_probability >= least_glare_probability &&
           simplified_probability <= largest_glare_probability;
}

GlareJudgement judge_glare(const Result& result, const View& view, const Picture& picture, Progress& progress) {
    if (view.kind != ViewKind::fisheye) return {view.id};
    const auto not_judged = [&](std::string why) { return GlareJudgement{view.id, {}, std::move(why)}; };
    if (view.field_of_view_rad < pi - 1e-6)
        return not_judged(fmt::format("the fisheye shows {:.4g} degrees (an eye sees 180)", degrees_from_radians(view.field_of_view_rad)));
    if (view.width != view.height) return not_judged(fmt::format("the picture has {} x {} pixels (it must be as wide as high)", view.width, view.height));
    if (!view.cut_planes.empty()) return not_judged("the view is cut open");
    if (view.see_through != SeeThrough::nothing) return not_judged("the view sees through surfaces");
    const Camera camera = make_camera(view);
    // The eye is a sensor that looks along the view.
    Scene scene = result.scene;
    scene.sensors = {{.id = "eye", .grid = {}, .points = {{view.from_m, camera.forward}}}};
    const std::vector<Sensor> eye = place_sensors(scene, result.building);
    if (eye.front().medium == Medium::solid) return not_judged("the eye is inside a solid");
    const PointIlluminance light =
        light_on_sensors(scene, result.building, result.grid, result.visibility, result.solution.outdoors, result.solution.radiosity,
                         result.options.daylight, eye, progress)
            .front();

    std::vector<double> luminance_cd_m2;
    luminance_cd_m2.reserve(picture.luminance_cd_m2.size());
    for (std::size_t k = 0; k < picture.luminance_cd_m2.size(); ++k) {
        const double coverage = picture.coverage.empty() ? 1.0 : static_cast<double>(picture.coverage[k]);
        luminance_cd_m2.push_back(coverage * result.primaries.luminous(picture.luminance_cd_m2[k]));
    }
    ViewGlare glare{.view = view.id,
                    .illuminance_lx = result.primaries.luminous(light.total_lx()),
                    .picture_illuminance_lx = illuminance_of_picture(luminance_cd_m2, camera).value,
                    .sun_lx = result.primaries.luminous(light.direct.sun_lx)};
    glare.sources = find_glare_sources(luminance_cd_m2, camera, glare_threshold, glare_peak);
    glare.simplified_probability = simplified_glare_probability({glare.illuminance_lx});
    glare.probability = glare_probability({glare.illuminance_lx}, glare.sources);
    return {view.id, glare, {}};
}

std::string glare_json(const std::vector<GlareJudgement>& judgements, const std::string& earlier) {
    Json list = Json::array();
    const Json before = Json::parse(earlier, nullptr, false);
    if (before.is_object() && before.contains("views") && before["views"].is_array()) {
        for (const Json& view : before["views"]) {
            const auto is_same = [&](const GlareJudgement& judgement) { return view.is_object() && view.contains("view") && view["view"] == judgement.view; };
            if (std::ranges::none_of(judgements, is_same)) list.push_back(view);
        }
    }
    for (const GlareJudgement& judgement : judgements) {
        if (!judgement.glare) continue;
        const ViewGlare& view = *judgement.glare;
        Json sources = Json::array();
        for (const GlareSource& source : view.sources)
            sources.push_back({{"direction", {source.direction.x, source.direction.y, source.direction.z}},
                               {"solid_angle_sr", source.solid_angle_sr},
                               {"luminance_cd_m2", source.luminance_cd_m2},
                               {"position_index", source.position_index}});
        list.push_back({{"view", view.view},
                        {"vertical_illuminance_lx", view.illuminance_lx},
                        {"vertical_illuminance_of_picture_lx", view.picture_illuminance_lx},
                        {"direct_sun_lx", view.sun_lx},
                        {"dgps", view.simplified_probability},
                        {"dgps_valid", view.simplified_valid()},
                        {"dgp", view.probability},
                        {"dgp_valid", view.valid()},
                        {"dgp_class", class_of(view.probability)},
                        {"sources", sources}});
    }
    if (list.empty()) return {};
    return json_text({{"naturel", NATUREL_VERSION},
                      {"threshold_cd_m2", glare_threshold.value},
                      {"peak_cd_m2", glare_peak.value},
                      {"views", list}});
}

std::string glare_account(const std::vector<GlareJudgement>& judgements) {
    std::string text;
    for (const GlareJudgement& judgement : judgements) {
        if (!judgement.not_judged.empty()) text += fmt::format("  {}: glare not judged: {}\n", judgement.view, judgement.not_judged);
        if (!judgement.glare) continue;
        const ViewGlare& view = *judgement.glare;
        text += fmt::format("  {}: {:.0f} lx at the eye ({:.0f} lx by its picture); DGPs {:.2f}{}, DGP {:.2f} {}{}\n", view.view,
                            view.illuminance_lx, view.picture_illuminance_lx, view.simplified_probability,
                            view.sun_lx > 0.0 ? " (not valid: sun at the eye)" : view.simplified_valid() ? "" : " (outside its range)",
                            view.probability, class_of(view.probability), view.valid() ? "" : " (outside its range)");
    }
    return text;
}

std::vector<std::string> glare_warnings(const std::vector<GlareJudgement>& judgements) {
    // Coarse pixels and nodes a metre apart stay below 5 %.
    constexpr double most_difference = 0.1;
    std::vector<std::string> warnings;
    for (const GlareJudgement& judgement : judgements) {
        if (!judgement.glare) continue;
        const ViewGlare& view = *judgement.glare;
        const double larger_lx = std::max(view.illuminance_lx, view.picture_illuminance_lx);
        if (std::abs(view.illuminance_lx - view.picture_illuminance_lx) <= most_difference * larger_lx) continue;
        warnings.push_back(fmt::format("view \"{}\": a sensor at the eye has {:.4g} lx, its picture {:.4g} lx: glare is not reliable "
                                       "(is the eye close to a surface, the picture or the grid coarse?)",
                                       view.view, view.illuminance_lx, view.picture_illuminance_lx));
    }
    return warnings;
}

}  // namespace naturel
