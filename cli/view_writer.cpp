#include "cli/view_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "cli/choices.h"
#include "cli/false_colour.h"
#include "cli/file_stems.h"
#include "cli/file_writer.h"
#include "cli/image_writer.h"
#include "cli/radiance_picture.h"
#include "core/parallel.h"
#include "core/sky_models.h"

namespace naturel {
namespace {

std::string numbers(std::initializer_list<double> values) {
    std::string text;
    for (const double value : values) text += fmt::format("{}{:.9g}", text.empty() ? "" : " ", value);
    return text;
}

/// What is true of every file of a view, whatever its exposure.
ImageMetadata image_metadata(const Result& result, const View& view) {
    const auto text = [](const glm::dvec3& v) { return numbers({v.x, v.y, v.z}); };
    const OutdoorLight& outdoors = result.solution.outdoors;
    ImageMetadata metadata{
        {"naturel:scene", result.scene.name},
        {"naturel:scene_sha256", result.scene.source_sha256},
        {"naturel:backend", std::string(result.visibility.name())},
        {"naturel:sky", std::string(sky_model(result.scene.sky).name)},
        {"naturel:outdoor_illuminance_lx", numbers({outdoors.horizontal_illuminance().value})},
        {"naturel:sun", outdoors.direct_normal_illuminance_lx > 0.0
                            ? fmt::format("{} lx from {}", numbers({outdoors.direct_normal_illuminance_lx}), text(outdoors.sun_direction))
                            : "none"},
        {"naturel:view", view.id},
        {"naturel:kind", std::string(name_of(view_kinds, view.kind))},
        {"naturel:from_m", text(view.from_m)},
        {"naturel:to_m", text(view.to_m)},
        {"naturel:up", text(view.up)}};
    switch (view.kind) {
        case ViewKind::parallel: metadata.emplace_back("naturel:width_m", numbers({view.width_m})); break;
        case ViewKind::panorama: metadata.emplace_back("naturel:projection", "equirectangular"); break;
        case ViewKind::fisheye:
            metadata.emplace_back("naturel:projection", name_of(fisheye_projections, view.projection));
            [[fallthrough]];
        case ViewKind::perspective:
            metadata.emplace_back("naturel:horizontal_fov_deg", numbers({degrees_from_radians(view.field_of_view_rad)}));
    }
    for (std::size_t k = 0; k < view.cut_planes.size(); ++k)
        metadata.emplace_back(fmt::format("naturel:cut_plane_{}", k + 1),
                              fmt::format("through {} normal {}", text(view.cut_planes[k].point_m), text(view.cut_planes[k].normal)));
    constexpr std::array see_through_words{Choice{SeeThrough::nothing, "nothing"}, Choice{SeeThrough::backs, "backs"}, Choice{SeeThrough::walls, "walls"}};
    metadata.emplace_back("naturel:see_through", name_of(see_through_words, view.see_through));
    metadata.emplace_back("naturel:samples", std::to_string(view.samples));
    metadata.emplace_back("naturel:quality", view.quality == PictureQuality::gather ? "gather" : "interpolated");
    if (view.quality == PictureQuality::gather) {
        // Of the rows from the points of surfaces.
        for (const auto& [name, value] : result.visibility.settings())
            if (name == "rays_per_point" || name == "pair_tolerance" || name == "resolution") metadata.emplace_back("naturel:" + name, value);
    }
    return metadata;
}

/// What a picture in false colour shows, in words.
struct Quantity {
    std::string_view words, unit, plain_unit, grey_means;
};
Quantity quantity_of(FalseColourQuantity quantity) {
    switch (quantity) {
        case FalseColourQuantity::illuminance: return {"illuminance of surfaces", "lx", "lx", "no indoor surface"};
        case FalseColourQuantity::daylight_factor: return {"daylight factor of surfaces", "%", "%", "no indoor surface"};
        default: return {"luminance", "cd/m\u00b2", "cd/m2", "nothing shown"};
    }
}

/// Values of a picture, NaN where there are none.
std::vector<double> field_of(const Result& result, const Picture& picture, FalseColourQuantity quantity) {
    const bool luminance = quantity == FalseColourQuantity::luminance;
    const std::vector<Band3>& bands = luminance                                          ? picture.luminance_cd_m2
                                      : quantity == FalseColourQuantity::illuminance ? picture.illuminance_lx
                                                                                     : picture.sky_illuminance_lx;
    double scale = 1.0;
    if (quantity == FalseColourQuantity::daylight_factor) {
        const double outdoors_lx = result.solution.outdoors.horizontal_illuminance().value;
        // Under a sky without light there is no daylight factor.
        scale = outdoors_lx > 0.0 ? 100.0 / outdoors_lx : std::numeric_limits<double>::quiet_NaN();
    }
    std::vector<double> field;
    field.reserve(bands.size());
    for (std::size_t k = 0; k < bands.size(); ++k) {
        const bool is_shown = picture.coverage.empty() || picture.coverage[k] > 0.0f;
        field.push_back(is_shown ? scale * result.primaries.luminous(bands[k]) : std::numeric_limits<double>::quiet_NaN());
    }
    return field;
}

/// The view in false colour with a legend; PNG.
/// scale_end: set to where its scale ends.
std::string false_colour_png(const Result& result, const View& view, const Picture& picture, ImageMetadata metadata, std::optional<double>& scale_end) {
    const FalseColour& wanted = result.options.picture_files.false_colour;
    const std::vector<double> field = field_of(result, picture, wanted.quantity);
    std::optional<double> maximum = wanted.maximum;
    if (!maximum) {
        // As for the automatic exposure: the window or a spot of sun would leave one colour to the rest of the room.
        std::vector<double> known;
        for (const std::size_t k : pixels_for_exposure(picture))
            if (std::isfinite(field[k])) known.push_back(field[k]);
        const double bright = white_luminance_cd_m2(std::move(known), {});
        maximum = round_maximum({&bright, 1});
    }
    scale_end = maximum;
    const Quantity quantity = quantity_of(wanted.quantity);
    metadata.emplace_back("naturel:unit", quantity.plain_unit);
    return encode_png(draw_false_colour(field, view.width, view.height,
                                        {.title = fmt::format("{}: {} in {}", view.id, quantity.words, quantity.unit),
                                         .unit = std::string(quantity.unit),
                                         .scale = wanted.scale,
                                         .maximum = maximum,
                                         .contours = wanted.contours,
                                         .parts = picture.surface,
                                         .grey_means = std::string(quantity.grey_means)}),
                      metadata);
}

std::string encode(ImageFormat format, const Result& result, const View& view, const Picture& picture, const ScreenPicture& screen,
                   ImageMetadata metadata) {
    switch (format) {
        case ImageFormat::exr:
            metadata.emplace_back("naturel:unit", "cd/m2");
            return encode_exr(picture, result.primaries, metadata);
        case ImageFormat::hdr: return encode_radiance(picture, result.primaries, view, metadata);
        case ImageFormat::png: break;
    }
    metadata.emplace_back("naturel:white_cd_m2", numbers({screen.white_luminance_cd_m2}));
    metadata.emplace_back("naturel:tone_mapping", name_of(tone_mappings, view.picture.tone_mapping));
    return encode_png(screen, picture.coverage, metadata);
}

/// Pictures of so many pixels (81 bytes each) wait for their encoding together: encoding one file takes one thread.
constexpr std::size_t encoded_together = 4'000'000;

struct DrawnView {
    const View& view;
    const std::string& stem;
    Picture picture;
    ScreenPicture screen{};
    GlareJudgement judgement{};
    std::optional<double> false_colour_maximum{};
};

/// The files of views, encoded in parallel and written in order.
void write_files(const Result& result, const std::filesystem::path& folder, std::span<DrawnView> views, std::vector<WrittenView>& written) {
    parallel_for(views.size(), 1, [&](std::size_t k) {
        views[k].screen = map_to_screen(views[k].picture, result.primaries, views[k].view.picture, result.solution.outdoors.sky_colour);
    });
    const PictureFiles& wanted = result.options.picture_files;
    const bool false_colour = wanted.false_colour.quantity != FalseColourQuantity::none;
    const std::size_t files_of_view = wanted.formats.size() + (false_colour ? 1 : 0);
    std::vector<std::string> bytes(views.size() * files_of_view);
    parallel_for(bytes.size(), 1, [&](std::size_t n) {
        DrawnView& drawn = views[n / files_of_view];
        const ImageMetadata metadata = image_metadata(result, drawn.view);
        const std::size_t file = n % files_of_view;
        bytes[n] = file < wanted.formats.size()
                       ? encode(wanted.formats[file], result, drawn.view, drawn.picture, drawn.screen, metadata)
                       : false_colour_png(result, drawn.view, drawn.picture, metadata, drawn.false_colour_maximum);
    });
    for (std::size_t k = 0; k < views.size(); ++k) {
        std::vector<std::string> files;
        for (const ImageFormat format : wanted.formats) files.push_back(fmt::format("views/{}.{}", views[k].stem, name_of(image_formats, format)));
        if (false_colour) files.push_back(fmt::format("views/false_colour/{}.png", views[k].stem));
        for (std::size_t file = 0; file < files.size(); ++file) write_file(folder / files[file], bytes[k * files_of_view + file]);
        written.push_back({views[k].view.id, std::move(files), views[k].screen.white_luminance_cd_m2, views[k].view.picture,
                           std::move(views[k].judgement), views[k].false_colour_maximum});
    }
}

}  // namespace

void prepare_view_folders(const Scene& scene, const PictureFiles& files, const std::filesystem::path& folder) {
    if (scene.views.empty()) return;
    make_writable_folder(folder / "views");
    if (files.false_colour.quantity != FalseColourQuantity::none) make_writable_folder(folder / "views" / "false_colour");
}

std::vector<WrittenView> write_views(const Result& result, const std::filesystem::path& folder,
                                     Progress& progress) {
    const std::vector<View>& views = result.scene.views;
    std::vector<std::string> ids;
    for (const View& view : views) ids.push_back(view.id);
    const std::vector<std::string> stems = file_stems(ids);
    std::vector<WrittenView> written;
    std::vector<DrawnView> drawn;
    std::size_t pixels = 0;
    const auto write_drawn = [&] {
        write_files(result, folder, drawn, written);
        drawn.clear();
        pixels = 0;
    };
    for (std::size_t k = 0; k < views.size(); ++k) {
        const std::size_t more = static_cast<std::size_t>(views[k].width) * static_cast<std::size_t>(views[k].height);
        if (pixels > 0 && pixels + more > encoded_together) write_drawn();
        drawn.push_back({.view = views[k], .stem = stems[k],
                         .picture = draw_view(result.scene, result.building, result.grid, result.visibility, result.solution, views[k], progress)});
        drawn.back().judgement = judge_glare(result, views[k], drawn.back().picture, progress);
        pixels += more;
    }
    write_drawn();
    return written;
}

std::vector<GlareJudgement> judgements_of(const std::vector<WrittenView>& views) {
    std::vector<GlareJudgement> judgements;
    for (const WrittenView& view : views) judgements.push_back(view.judgement);
    return judgements;
}

}  // namespace naturel
