#pragma once
#include <optional>
#include <string>
#include <vector>

#include "cli/result.h"
#include "core/glare.h"
#include "core/picture.h"

namespace naturel {

/// How much the daylight dazzles an eye that looks along a view.
struct ViewGlare {
    std::string view;
    double illuminance_lx = 0.0;          ///< at the eye, across the view: computed as for a sensor
    double picture_illuminance_lx = 0.0;  ///< the same from the pixels: how well the picture shows what the eye gets
    double sun_lx = 0.0;                  ///< its part straight from the sun
    double simplified_probability = 0.0;  ///< DGPs
    double probability = 0.0;             ///< DGP with the sources of the picture
    std::vector<GlareSource> sources{};

    /// Within what the formulas were fitted to; `simplified` also wants no sun at the eye.
    bool valid() const;
    bool simplified_valid() const;
};

/// Of a fisheye of 180 degrees whose eye is in a room or outdoors; nothing for other views and for eyes in solid matter.
std::optional<ViewGlare> judge_glare(const Result& result, const View& view, const Picture& picture, Progress& progress);

inline constexpr const char* glare_file_name = "glare.json";

/// Text of that file.
std::string glare_json(const std::vector<ViewGlare>& views);

/// A line for every view, for people.
std::string glare_account(const std::vector<ViewGlare>& views);

}  // namespace naturel
