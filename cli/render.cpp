#include "cli/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/file_reader.h"
#include "cli/file_writer.h"
#include "cli/files_read.h"
#include "cli/image_writer.h"
#include "cli/stored_solution.h"
#include "cli/view_notes.h"
#include "cli/view_writer.h"
#include "core/errors.h"
#include "core/scene_sources.h"
#include "core/scene_values.h"
#include "core/view_reader.h"

namespace naturel {
namespace {

/// A view in the words of a scene file, or a list of such.
void append_views(const std::string& text, const std::string& where, const Scene& scene, std::vector<View>& views) {
    const JsonDocument document(text, where);
    const JsonValue root = document.root();
    const std::vector<JsonValue> items = root.kind() == JsonKind::list ? root.items() : std::vector{root};
    if (items.empty()) root.refuse("the list is empty (at least one view is needed)");
    for (const JsonValue& item : items)
        views.push_back(read_view(item, read_id(SceneObject(item, scene_keys::view).at("id")), scene));
}

std::vector<View> wanted_views(const RenderOptions& options, const Scene& scene) {
    if (options.views.empty()) {
        if (scene.views.empty())
            throw InputError(options.result.string(), "the scene of this result has no views (give one with --view)");
        return scene.views;
    }
    std::vector<View> views;
    for (const std::string& text : options.views) {
        std::error_code error;
        const auto found = std::ranges::find(scene.views, text, &View::id);
        if (found != scene.views.end()) {
            views.push_back(*found);
        } else if (text.find_first_of("{[") == text.find_first_not_of(" \t\r\n") && text.find_first_of("{[") != std::string::npos) {
            append_views(text, "--view", scene, views);
        } else if (std::filesystem::is_regular_file(text, error)) {
            refuse_to_replace(std::vector<std::filesystem::path>{text}, std::vector{options.out / glare_file_name});
            const std::string content = read_json_file(text, "view");
            // A byte order mark, a blank or a comment may come first.
            const std::size_t first = content.find_first_not_of("\xef\xbb\xbf \t\r\n");
            if (first == std::string::npos || std::string_view("{[/").find(content[first]) == std::string_view::npos)
                throw InputError(text, "this is not JSON (a view, an object in { }, or a list of views in [ ] is expected)");
            append_views(content, text, scene, views);
        } else {
            std::vector<std::string_view> known;
            for (const View& view : scene.views) known.push_back(view.id);
            throw InputError("--view", fmt::format("the scene has no view {}, and there is no such file {}", in_quotes(text),
                                                   known.empty() ? "(the scene has no views)" : suggestion(text, known)));
        }
    }
    return views;
}

/// What options of the command line replace in a view.
void replace(const RenderOptions& options, View& view) {
    options.picture.apply_to(view.picture);
    if (options.samples) view.samples = *options.samples;
    const double ratio = static_cast<double>(view.height) / view.width;
    const auto pixels = [](double count) { return std::clamp(static_cast<int>(std::lround(count)), 1, most_pixels_per_side); };
    if (options.width) view.width = *options.width, view.height = pixels(ratio * view.width);
    if (options.height) view.height = *options.height, view.width = options.width ? *options.width : pixels(view.height / ratio);
    if (1e-6 * view.width * view.height > most_megapixels)
        throw InputError(options.width ? "--width" : "--height", fmt::format("the picture of view {} would have {} x {} pixels (at most {:.0f} million)",
                                                in_quotes(view.id), view.width, view.height, most_megapixels));
}

}  // namespace

void render(const RenderOptions& options, Progress& progress) {
    StoredRun run = read_stored_solution(options.result, progress);
    auto& [scene, building, sun, zones, grid] = run.prepared;
    scene.views = wanted_views(options, scene);
    for (View& view : scene.views) replace(options, view);
    run.options.picture_files = options.picture_files;

    const std::string name = options.backend.empty() ? run.options.backend : options.backend;
    const std::vector<Backend> backends = backends_named(name);
    if (backends.size() != 1)
        throw InputError(options.result.string(),
                         fmt::format("the result is of the backend \"{}\", which this program has not (give another with --backend)", name));
    for (const std::string& note : view_notes(scene, building)) print_at_once(stderr, "warning: " + note + "\n");
    const ImageWriterOpening opening(options.threads);
    prepare_view_folders(scene, options.picture_files, options.out);
    const std::unique_ptr<Visibility> visibility = backends.front().make(building, grid, run.options.backends);
    const Primaries primaries(scene.primaries);
    const Result result{run.options, scene, building, grid, *visibility, run.solution, primaries};
    const std::vector<WrittenView> views = write_views(result, options.out, progress);
    const std::vector<GlareJudgement> judgements = judgements_of(views);
    for (const std::string& warning : glare_warnings(judgements)) print_at_once(stderr, "warning: " + warning + "\n");
    // Pictures of earlier calls stay, and so does what is known of them.
    const std::filesystem::path glare_file = options.out / glare_file_name;
    std::error_code absent;
    const std::string glare = glare_json(judgements, std::filesystem::is_regular_file(glare_file, absent) ? file_content(glare_file) : "");
    if (!glare.empty())
        write_file(glare_file, glare);
    else
        std::filesystem::remove(glare_file, absent);
    std::string account = glare_account(judgements);
    for (const WrittenView& view : views)
        for (const std::string& file : view.files) account += fmt::format("{}: written to {}\n", view.id, (options.out / file).string());
    std::fwrite(account.data(), 1, account.size(), stdout);
}

}  // namespace naturel
