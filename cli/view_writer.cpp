#include "cli/view_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "cli/choices.h"
#include "cli/false_colour.h"
#include "cli/file_writer.h"
#include "cli/image_writer.h"

namespace naturel {
namespace {

/// A file name for each view: its id without what could leave the folder or upset a shell or another file
/// system. Different ids get different names, also where upper and lower case are the same.
std::vector<std::string> view_file_stems(const std::vector<View>& views) {
    std::vector<std::string> stems;
    std::set<std::string> taken;
    for (const View& view : views) {
        std::string stem = view.id;
        for (char& c : stem) {
            const auto byte = static_cast<unsigned char>(c);
            const bool harmless = byte >= 0x80 || std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.';
            if (!harmless) c = '_';
        }
        if (stem.empty() || stem.front() == '.' || stem.front() == '-') stem.insert(0, "_");
        // 255 bytes is the usual limit of a name; endings and numbers are added. A UTF-8 character is not
        // cut.
        if (stem.size() > 200) {
            std::size_t end = 200;
            while ((static_cast<unsigned char>(stem[end]) & 0xc0) == 0x80)
                --end;
            stem.resize(end);
        }
        const auto in_lower_case = [](std::string text) {
            std::ranges::transform(text, text.begin(), [](unsigned char c) {
                return c < 0x80 ? static_cast<char>(std::tolower(c)) : c;
            });
            return text;
        };
        std::string unique = stem;
        for (int n = 2; !taken.insert(in_lower_case(unique)).second; ++n)
            unique = fmt::format("{}_{}", stem, n);
        stems.push_back(unique);
    }
    return stems;
}

ImageMetadata image_metadata(const Result& result, const View& view) {
    const auto text = [](const glm::dvec3& v) { return fmt::format("{:.9g} {:.9g} {:.9g}", v.x, v.y, v.z); };
    ImageMetadata metadata{
        {"naturel:scene", result.scene.name},
        {"naturel:scene_sha256", result.scene.source_sha256},
        {"naturel:backend", std::string(result.visibility.name())},
        {"naturel:view", view.id},
        {"naturel:from_m", text(view.from_m)},
        {"naturel:to_m", text(view.to_m)},
        {"naturel:up", text(view.up)}};
    if (view.kind == ViewKind::parallel)
        metadata.emplace_back("naturel:width_m", fmt::format("{:.9g}", view.width_m));
    else
        metadata.emplace_back("naturel:horizontal_fov_deg", fmt::format("{:.9g}", degrees_from_radians(view.field_of_view_rad)));
    return metadata;
}

/// The view in false colour with a legend; PNG.
std::string false_colour_png(const Result& result, const View& view, const Picture& picture, ImageMetadata metadata) {
    const FalseColour& wanted = result.options.false_colour;
    const bool luminance = wanted.quantity == FalseColourQuantity::luminance;
    std::vector<double> field, known;
    for (const Band3& band : luminance ? picture.luminance_cd_m2 : picture.illuminance_lx) {
        field.push_back(result.primaries.luminous(band));
        if (std::isfinite(field.back())) known.push_back(field.back());
    }
    std::optional<double> maximum = wanted.maximum;
    if (!maximum) {
        // As for the automatic exposure: the window or a spot of sun would leave one colour to the rest of the room.
        const double bright = white_luminance_cd_m2(std::move(known), {});
        maximum = round_maximum({&bright, 1});
    }
    const std::string unit = luminance ? "cd/m²" : "lx";
    metadata.emplace_back("naturel:unit", luminance ? "cd/m2" : "lx");
    return encode_png(draw_false_colour(field, view.width, view.height,
                                        {.title = fmt::format("{}: {} in {}", view.id,
                                                              luminance ? "luminance" : "illuminance of surfaces", unit),
                                         .unit = unit,
                                         .scale = wanted.scale,
                                         .maximum = maximum,
                                         .contours = wanted.contours}),
                      metadata);
}

}  // namespace

void prepare_view_folders(const Scene& scene, const FalseColour& false_colour, const std::filesystem::path& folder) {
    if (scene.views.empty()) return;
    require_image_writer();
    make_writable_folder(folder / "views");
    if (false_colour.quantity != FalseColourQuantity::none) make_writable_folder(folder / "views" / "false_colour");
}

std::vector<WrittenView> write_views(const Result& result, const std::filesystem::path& folder,
                                     Progress& progress) {
    std::vector<WrittenView> written;
    const std::vector<std::string> stems = view_file_stems(result.scene.views);
    for (std::size_t k = 0; k < stems.size(); ++k) {
        const View& view = result.scene.views[k];
        const Picture picture = draw_view(result.scene, result.building, result.grid, result.visibility,
                                          result.solution, view, progress);
        const ScreenPicture screen = map_to_screen(picture, result.primaries, view.picture,
                                                   result.solution.outdoors.sky_colour);
        ImageMetadata metadata = image_metadata(result, view);
        std::vector<std::string> files{"views/" + stems[k] + ".exr", "views/" + stems[k] + ".png"};
        if (result.options.false_colour.quantity != FalseColourQuantity::none) {
            files.push_back("views/false_colour/" + stems[k] + ".png");
            write_file(folder / files.back(), false_colour_png(result, view, picture, metadata));
        }
        metadata.emplace_back("naturel:unit", "cd/m2");
        write_file(folder / "views" / (stems[k] + ".exr"), encode_exr(picture, result.primaries, metadata));
        metadata.back() = {"naturel:white_cd_m2", fmt::format("{:.9g}", screen.white_luminance_cd_m2)};
        metadata.emplace_back("naturel:tone_mapping",
                              std::string(name_of(tone_mappings, view.picture.tone_mapping)));
        write_file(folder / "views" / (stems[k] + ".png"),
                   encode_png(screen, metadata));
        written.push_back({view.id, std::move(files), screen.white_luminance_cd_m2, view.picture});
    }
    return written;
}

}  // namespace naturel
