#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/result.h"
#include "cli/view_glare.h"

namespace naturel {

/// A picture that was written, for the summary.
struct WrittenView {
    std::string id;
    std::vector<std::string> files;      ///< in the order of PictureFiles::formats, then, if asked for, PNG in false colour
    double white_luminance_cd_m2 = 0.0;  ///< shown as white in the PNG
    PictureOptions options{};
    GlareJudgement judgement{};
    std::optional<double> false_colour_maximum{};  ///< where the scale of the picture in false colour ends
};

/// Makes the folders that write_views() writes to; nothing where the scene has no views. Throws WriteError.
void prepare_view_folders(const Scene& scene, const PictureFiles& files, const std::filesystem::path& folder);

/// Draws every view of the scene and writes its pictures below `folder`.
std::vector<WrittenView> write_views(const Result& result, const std::filesystem::path& folder, Progress& progress);

/// What was made of the glare in each of the views.
std::vector<GlareJudgement> judgements_of(const std::vector<WrittenView>& views);

}  // namespace naturel
