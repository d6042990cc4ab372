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
    double simplified_probability = 0.0;  ///< DGPs, at most 1
    double probability = 0.0;             ///< DGP with the sources of the picture
    std::vector<GlareSource> sources{};

    /// Within what the formulas were fitted to; `simplified` also wants no sun at the eye.
    bool valid() const;
    bool simplified_valid() const;
};

/// What a run makes of the glare in one view.
struct GlareJudgement {
    std::string view;
    std::optional<ViewGlare> glare{};  ///< of a fisheye of 180 degrees whose eye is in a room or outdoors
    std::string not_judged{};          ///< why there is none of another fisheye
};
GlareJudgement judge_glare(const Result& result, const View& view, const Picture& picture, Progress& progress);

inline constexpr const char* glare_file_name = "glare.json";

/// Text of that file. earlier: its text, if there is one: views of other ids stay, and where one of `judgements` has no glare, none of its
/// id is left. Empty where no view is left.
std::string glare_json(const std::vector<GlareJudgement>& judgements, const std::string& earlier = {});

/// A line for every fisheye, for people.
std::string glare_account(const std::vector<GlareJudgement>& judgements);

/// Sentences about eyes whose picture does not show the light that they get.
std::vector<std::string> glare_warnings(const std::vector<GlareJudgement>& judgements);

}  // namespace naturel
