#include "cli/view_glare.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

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

std::optional<ViewGlare> judge_glare(const Result& result, const View& view, const Picture& picture, Progress& progress) {
    if (view.kind != ViewKind::fisheye || view.field_of_view_rad < pi - 1e-6 || !view.cut_planes.empty() ||
        view.see_through != SeeThrough::nothing || view.width != view.height)
        return {};
    const Camera camera = make_camera(view);
    // The eye is a sensor that looks along the view.
    Scene scene = result.scene;
    scene.sensors = {{.id = "eye", .grid = {}, .points = {{view.from_m, camera.forward}}}};
    const std::vector<Sensor> eye = place_sensors(scene, result.building);
    if (eye.front().medium == Medium::solid) return {};
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
    return glare;
}

std::string glare_json(const std::vector<ViewGlare>& views) {
    Json list = Json::array();
    for (const ViewGlare& view : views) {
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
    return json_text({{"naturel", NATUREL_VERSION},
                      {"threshold_cd_m2", glare_threshold.value},
                      {"peak_cd_m2", glare_peak.value},
                      {"views", list}});
}

std::string glare_account(const std::vector<ViewGlare>& views) {
    std::string text;
    for (const ViewGlare& view : views)
        text += fmt::format("  {}: {:.0f} lx at the eye ({:.0f} lx by its picture); DGPs {:.2f}{}, DGP {:.2f} {}{}\n", view.view,
                            view.illuminance_lx, view.picture_illuminance_lx, view.simplified_probability,
                            view.sun_lx > 0.0 ? " (not valid: sun at the eye)" : view.simplified_valid() ? "" : " (outside its range)",
                            view.probability, class_of(view.probability), view.valid() ? "" : " (outside its range)");
    return text;
}

}  // namespace naturel
