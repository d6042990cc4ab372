#include "core/picture_reader.h"

#include <array>

namespace naturel {
namespace {

Exposure read_exposure(const JsonValue& value) {
    if (value.kind() == JsonKind::text)
        return {read_word<ExposureMode>(value, {{"auto", ExposureMode::automatic}}), 0.0};
    if (value.kind() != JsonKind::object)
        value.refuse(value.describe() +
                     " stands where an exposure belongs (\"auto\", or {...} with white_cd_m2, ev100 or percentile)");
    const SceneObject object(value, scene_keys::exposure);
    struct Way {
        std::string_view key;
        ExposureMode mode;
        Range range;
    };
    std::optional<Exposure> exposure;
    for (const auto& [key, mode, range] :
         {Way{"white_cd_m2", ExposureMode::white, exposure_range(ExposureMode::white)},
          Way{"ev100", ExposureMode::ev100, exposure_range(ExposureMode::ev100)},
          Way{"percentile", ExposureMode::percentile, exposure_range(ExposureMode::percentile)}}) {
        const auto found = object.find(key);
        if (!found) continue;
        if (exposure) object.refuse("more than one of white_cd_m2, ev100 and percentile is given (exactly one is needed)");
        exposure = Exposure{mode, read_number(*found, range)};
    }
    if (!exposure) object.refuse("none of white_cd_m2, ev100 and percentile is given (exactly one is needed)");
    return *exposure;
}

}  // namespace

Range exposure_range(ExposureMode mode) {
    switch (mode) {
        case ExposureMode::automatic: break;
        case ExposureMode::percentile: return {1.0, 100.0, "%"};
        case ExposureMode::ev100: return {-20.0, 30.0, "EV"};
        case ExposureMode::white: return {1e-6, largest_light, "cd/m2"};
    }
    return {0.0, 0.0};
}

void read_picture(const JsonValue& value, PictureOptions& options) {
    const SceneObject object(value, scene_keys::picture);
    if (const auto exposure = object.find("exposure")) options.exposure = read_exposure(*exposure);
    if (const auto mapping = object.find("tone_mapping")) {
        options.tone_mapping = read_word<ToneMapping>(
            *mapping, {{"linear", ToneMapping::linear}, {"reinhard", ToneMapping::reinhard}});
    }
    if (const auto white = object.find("white_point"))
        options.white_point = read_word<WhitePoint>(*white, {{"d65", WhitePoint::d65}, {"sky", WhitePoint::sky}});
}

}  // namespace naturel
