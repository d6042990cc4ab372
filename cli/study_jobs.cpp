#include "cli/study_jobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "cli/fingerprint.h"
#include "cli/prepared_scene.h"
#include "core/errors.h"
#include "core/parallel.h"
#include "core/scene_reader.h"
#include "core/scene_values.h"
#include "core/sky_reader.h"
#include "core/sky_table.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

/// Settings of a combination, block after block.
std::vector<const std::vector<StudySetting>*> rows_of(const Study& study, std::size_t combination) {
    std::vector<const std::vector<StudySetting>*> rows(study.blocks.size());
    for (std::size_t b = study.blocks.size(); b-- > 0;) {
        const auto& settings = study.blocks[b].settings;
        rows[b] = &settings[combination % settings.size()];
        combination /= settings.size();
    }
    return rows;
}

const StudyScene& scene_of(const Study& study, std::size_t combination) {
    return study.scenes[combination / (study.combination_count() / study.scenes.size())];
}

/// In the order in which they act.
std::vector<const StudyEdit*> edits_of(const Study& study, std::size_t combination) {
    std::vector<const StudyEdit*> edits;
    for (const StudyEdit& edit : study.edits) edits.push_back(&edit);
    for (const auto* row : rows_of(study, combination))
        for (const StudySetting& setting : *row)
            for (const StudyEdit& edit : setting.edits) edits.push_back(&edit);
    return edits;
}

/// Keys and indices of a JSON pointer (RFC 6901).
std::vector<std::string> tokens_of(const std::string& pointer) {
    std::vector<std::string> tokens;
    for (std::size_t i = 0; i < pointer.size(); ++i) {
        if (pointer[i] == '/') {
            tokens.emplace_back();
        } else if (pointer[i] == '~' && i + 1 < pointer.size() && (pointer[i + 1] == '0' || pointer[i + 1] == '1')) {
            tokens.back() += pointer[++i] == '0' ? '~' : '/';
        } else {
            tokens.back() += pointer[i];
        }
    }
    return tokens;
}

/// Puts the value where the pointer says. An object may get a new key; a list keeps its length.
void apply(const StudyEdit& edit, const StudyScene& scene, Json& root) {
    Json* at = &root;
    const std::vector<std::string> tokens = tokens_of(edit.target);
    std::string path;
    for (std::size_t k = 0; k < tokens.size(); ++k) {
        const std::string& token = tokens[k];
        const bool last = k + 1 == tokens.size();
        if (at->is_array()) {
            const bool is_number = !token.empty() && token.size() < 10 && std::ranges::all_of(token, [](char c) { return c >= '0' && c <= '9'; });
            if (!is_number || std::stoul(token) >= at->size())
                edit.target_source.refuse(fmt::format("scene {}: the list {} has no item {} (0 to {} would be right)",
                                                      in_quotes(scene.name), path, in_quotes(token),
                                                      std::max<std::size_t>(at->size(), 1) - 1));
            at = &(*at)[std::stoul(token)];
        } else if (k == 1 && tokens[0] == "materials" && at->is_object() && !at->contains(token)) {
            // The reader would take it for another material, which no face refers to.
            std::vector<std::string_view> known;
            for (const auto& [name, material] : at->items()) known.push_back(name);
            edit.target_source.refuse(fmt::format("scene {} has no material {} {}", in_quotes(scene.name), in_quotes(token),
                                                  suggestion(token, known)));
        } else if (at->is_object() && (last || at->contains(token))) {
            at = &(*at)[token];
        } else {
            edit.target_source.refuse(fmt::format("scene {} has no {} to go on from (set {} as a whole first)",
                                                  in_quotes(scene.name), path + '/' + token, path + '/' + token));
        }
        path += '/' + token;
    }
    *at = edit.value;
}

std::string option_word(const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump();
}

std::map<std::string, std::string> option_words(const std::vector<const StudyEdit*>& edits) {
    std::map<std::string, std::string> words;
    for (const StudyEdit* edit : edits)
        if (edit->kind == StudyEdit::Kind::option) words[edit->target] = option_word(edit->value);
    return words;
}

const RunOptions& options_of(const Study& study, const std::vector<const StudyEdit*>& edits, RunOptionSets& options) {
    try {
        return options.of(option_words(edits));
    } catch (const InputError& error) {
        // The last edit whose option the message names.
        const std::string text = error.what();
        for (auto edit = edits.rbegin(); edit != edits.rend(); ++edit) {
            std::string name = "--" + (*edit)->target;
            std::ranges::replace(name, '_', '-');
            if ((*edit)->kind == StudyEdit::Kind::option && text.starts_with(name + ":")) (*edit)->value_source.refuse(text);
        }
        study.document->root().refuse(text);
    }
}

/// "/sun/date" of "name:1:23: /sun/date: text".
std::string path_in(std::string_view message) {
    const std::size_t begin = message.find(": /");
    if (begin == std::string_view::npos) return {};
    const std::size_t end = message.find(": ", begin + 2);
    return std::string(message.substr(begin + 2, end - begin - 2));
}

std::size_t common_length(const std::string& a, const std::string& b) {
    const std::size_t n = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
    return n == a.size() || n == b.size() ? n : a.rfind('/', n);
}

/// A varied scene is a text that nobody sees: blames the edit nearest to what is wrong, or the scene file if it has the same fault.
[[noreturn]] void refuse_scene(const StudyScene& scene, const Study& study, const std::vector<const StudyEdit*>& edits, const std::string& message) {
    const std::string path = path_in(message);
    const std::string fault = message.substr(std::min(message.find(": /"), message.size()));
    try {
        read_scene(scene.file);
    } catch (const InputError& error) {
        if (std::string_view(error.what()).ends_with(fault)) throw;
    }
    const StudyEdit* blamed = nullptr;
    for (const StudyEdit* edit : edits)
        if (edit->kind == StudyEdit::Kind::scene &&
            (blamed == nullptr || common_length(edit->target, path) >= common_length(blamed->target, path)))
            blamed = edit;
    const JsonValue source = blamed != nullptr ? blamed->value_source : study.document->root();
    source.refuse(fmt::format("scene {} with {}{}", in_quotes(scene.name),
                              blamed != nullptr ? fmt::format("{} = {}", blamed->target, fmt::format("{:.60}", blamed->value.dump())) : "no change", fault));
}

/// Whether the sun of a scene stands too low for the study.
bool sun_is_low(const Study& study, const Json& scene) {
    if (!study.sun_above_rad || !scene.contains("sun")) return false;
    Json light{{"sky", {{"model", "uniform"}, {"horizontal_illuminance_lx", 1}}}};
    for (const char* key : {"site", "sun"})
        if (scene.contains(key)) light[key] = scene[key];
    // The sun's place is all that matters here; what is wrong with it the reader of the scene will say.
    if (light["sun"].is_object()) light["sun"].erase("direct_normal_illuminance_lx");
    try {
        const SkyAndSun read = read_sky_and_sun_text(light.dump(), "sun");
        return read.sun && read.sun->altitude_rad <= *study.sun_above_rad;
    } catch (const InputError&) {
        return false;
    }
}

Json varied_scene(const StudyScene& scene, const std::vector<const StudyEdit*>& edits) {
    Json root = scene.base;
    for (const StudyEdit* edit : edits)
        if (edit->kind == StudyEdit::Kind::scene) apply(*edit, scene, root);
    return root;
}

JobInput read_varied(const Study& study, const StudyScene& scene, const std::vector<const StudyEdit*>& edits, const Json& varied,
                     RunOptionSets& options) {
    JobInput input;
    input.options = &options_of(study, edits, options);
    try {
        input.scene = read_scene_text(varied.dump(), scene.file.string(), scene_defaults(input.options->quality));
    } catch (const InputError& error) {
        refuse_scene(scene, study, edits, error.what());
    }
    replace_by_options(input.scene, *input.options);
    return input;
}

void add_words(Fingerprint& print, const std::map<std::string, std::string>& words) {
    print.add(words.size());
    for (const auto& [name, value] : words) print.add(std::string_view(name)).add(std::string_view(value));
}

void add_rings(Fingerprint& print, const std::vector<glm::dvec3>& outline_m, const std::vector<std::vector<glm::dvec3>>& holes_m) {
    const auto add_ring = [&](const std::vector<glm::dvec3>& ring) {
        print.add(ring.size());
        for (const glm::dvec3& vertex : ring) print.add(vertex);
    };
    add_ring(outline_m);
    print.add(holes_m.size());
    for (const auto& hole : holes_m) add_ring(hole);
}

/// Everything in a scene that its assembly depends on, and options of its grid.
void add_geometry(Fingerprint& print, const Scene& scene) {
    const auto number_of = [](const auto& id) { return id ? static_cast<std::int64_t>(index(*id)) : -1; };
    print.add(scene.materials.size()).add(scene.glazings.size());
    print.add(scene.ground.z_m).add(scene.ground.shadows);
    print.add(scene.polyhedra.size());
    for (const Polyhedron& p : scene.polyhedra) {
        print.add(std::string_view(p.id)).add(p.kind).add(p.effect).add(index(p.material)).add(number_of(p.glazing));
        for (const glm::dvec3& vertex : p.vertices_m) print.add(vertex);
        for (const FaceFinish& face : p.faces) print.add(number_of(face.material)).add(number_of(face.glazing));
    }
    print.add(scene.polygons.size());
    for (const SurfacePolygon& p : scene.polygons) {
        print.add(std::string_view(p.id)).add(index(p.material)).add(p.side).add(p.two_sided);
        add_rings(print, p.vertices_m, p.holes_m);
    }
    print.add(scene.apertures.size());
    for (const AperturePolygon& a : scene.apertures) {
        print.add(std::string_view(a.id)).add(index(a.glazing));
        add_rings(print, a.vertices_m, a.holes_m);
    }
    const GridOptions& grid = scene.grid;
    print.add(grid.spacing_m).add(grid.outdoor_spacing_m).add(grid.zones).add(grid.sliver_area).add(grid.sliver_aspect);
    print.add(grid.refine.levels).add(grid.refine.contrast);
}

/// Of everything in a scene that its assembly, grid, visibility and sensors depend on: what SkySeries asks to be equal.
std::string geometry_key(const Scene& scene, const std::map<std::string, std::string>& words) {
    Fingerprint print;
    add_words(print, words);
    add_geometry(print, scene);
    print.add(scene.direct.method).add(scene.direct.tolerance);
    print.add(scene.primaries.name);
    for (const Chromaticity& c : scene.primaries.custom) print.add(c.x).add(c.y);
    print.add(scene.sensors.size());
    for (const SensorSet& set : scene.sensors) {
        print.add(std::string_view(set.id)).add(set.grid.has_value());
        if (set.grid) print.add(set.grid->z_m).add(set.grid->spacing_m).add(set.grid->margin_m);
        print.add(set.points.size());
        for (const SensorPoint& point : set.points) print.add(point.position_m).add(point.normal);
    }
    return print.digest();
}

/// Options that the numbers of a job without pictures do not depend on.
constexpr std::array<std::string_view, 4> options_of_pictures_and_nodes{"exposure", "tone_mapping", "white_point", "node_irc"};
constexpr std::array<std::string_view, 7> options_of_hemicube{"cells", "projection", "half_side_over_height", "spacing", "rim", "viewpoints",
                                                              "fixed_rotation"};
constexpr std::array<std::string_view, 6> options_of_embree{"form_factors", "pair_tolerance", "rays", "rays_per_point", "target_error", "most_rays"};
/// Those that form factors do depend on, beside those of their backend.
constexpr std::array<std::string_view, 4> options_of_form_factors{"backend", "quality", "grid_spacing", "seed"};

/// Without options of backends that are not asked.
std::map<std::string, std::string> words_of_backend(std::map<std::string, std::string> words, const std::string& backend) {
    const auto erase = [&](const auto& names) {
        for (const std::string_view name : names) words.erase(std::string(name));
    };
    if (backend != "hemicube") erase(options_of_hemicube);
    if (backend != "embree") erase(options_of_embree);
    return words;
}

/// Jobs that differ in nothing else share a group.
std::string group_key_of(const JobInput& input, const std::map<std::string, std::string>& words) {
    std::map<std::string, std::string> own = words_of_backend(words, input.options->backend);
    for (const std::string_view name : options_of_pictures_and_nodes) own.erase(std::string(name));
    return geometry_key(input.scene, own);
}

/// Of what form factors depend on, as far as can be told without a grid. Equal keys with unlike form factors only cost time.
/// with_sun: the grid is cut along the sunspots of the job.
std::string rows_key(const JobInput& input, const std::map<std::string, std::string>& words, bool with_sun) {
    Fingerprint print;
    std::map<std::string, std::string> own = words_of_backend(words, input.options->backend);
    std::erase_if(own, [](const auto& word) {
        const auto is_among = [&](const auto& names) { return std::ranges::find(names, word.first) != names.end(); };
        return !is_among(options_of_form_factors) && !is_among(options_of_hemicube) && !is_among(options_of_embree);
    });
    add_words(print, own);
    add_geometry(print, input.scene);
    if (with_sun && input.scene.grid.zones && input.scene.sun) print.add(input.scene.sun->altitude_rad).add(input.scene.sun->azimuth_rad);
    return print.digest();
}

/// Of what a group works out once for all jobs that share it.
std::string set_key(const std::string& group_key, const Scene& scene) {
    Fingerprint print;
    const auto add = [&](const Band3& x) { print.add(x.r).add(x.g).add(x.b); };
    print.add(std::string_view(group_key));
    for (const Material& material : scene.materials) add(material.reflectance), add(material.exitance_lm_m2);
    for (const Glazing& glazing : scene.glazings) {
        add(glazing.normal_transmittance), add(glazing.inner_reflectance);
        print.add(glazing.panes).add(glazing.angular_law).add(glazing.refractive_index).add(glazing.maintenance).add(glazing.frame);
        print.add(glazing.angular_table.size());
        for (const AngularSample& sample : glazing.angular_table) print.add(sample.incidence_rad), add(sample.transmittance);
    }
    // Skies that are formulas are asked for in the same directions.
    if (scene.sky.table) print.add(scene.sky.table->count()).add(scene.sky.table->is_interpolated()).add(scene.sky.north_rad);
    return print.digest();
}

/// What find_jobs() learns of a combination.
struct Found {
    bool left_out = false;
    std::string key, rows_key, group_key, set_key, invalid;
    std::shared_ptr<const Scene> scene;
};

Found look_at(const Study& study, std::size_t combination, RunOptionSets& options) {
    const StudyScene& scene = scene_of(study, combination);
    const std::vector<const StudyEdit*> edits = edits_of(study, combination);
    const Json varied = varied_scene(scene, edits);
    Found found;
    if (sun_is_low(study, varied)) {
        found.left_out = true;
        return found;
    }
    const std::map<std::string, std::string> words = option_words(edits);
    Fingerprint print;
    print.add(std::string_view(NATUREL_VERSION)).add(study.keep.sensors).add(study.keep.images);
    add_words(print, words);
    try {
        JobInput input = read_varied(study, scene, edits, varied, options);
        found.key = print.add(std::string_view(input.scene.source_sha256)).digest();
        // A job with pictures is a group of its own. The key of a group is never that of a job: both have records.
        found.group_key = study.keep.images ? Fingerprint().add(std::string_view(found.key)).digest() : group_key_of(input, words);
        found.rows_key = rows_key(input, words, study.keep.images);
        found.set_key = set_key(found.group_key, input.scene);
        found.scene = std::make_shared<const Scene>(std::move(input.scene));
    } catch (const InputError& error) {
        found.invalid = error.what();
        found.key = print.add(std::string_view(varied.dump())).digest();
    }
    return found;
}

}  // namespace

const RunOptions& RunOptionSets::of(const std::map<std::string, std::string>& words) {
    const std::scoped_lock lock(mutex_);
    const auto found = sets_.find(words);
    return found != sets_.end() ? found->second : sets_.emplace(words, parse_run_options(words)).first->second;
}

Json parameters_of(const Study& study, std::size_t combination) {
    Json parameters{{"scene", scene_of(study, combination).name}};
    const auto rows = rows_of(study, combination);
    for (std::size_t b = 0; b < rows.size(); ++b)
        for (std::size_t k = 0; k < rows[b]->size(); ++k) parameters[study.blocks[b].names[k]] = (*rows[b])[k].shown;
    return parameters;
}

JobInput input_of(const Study& study, const StudyJob& job, RunOptionSets& options) {
    const StudyScene& scene = scene_of(study, job.combination);
    const std::vector<const StudyEdit*> edits = edits_of(study, job.combination);
    if (job.scene != nullptr) return {*job.scene, &options_of(study, edits, options)};
    return read_varied(study, scene, edits, varied_scene(scene, edits), options);
}

StudyJobs find_jobs(const Study& study, RunOptionSets& options, Progress& progress) {
    // In parts, so that a fault in every job ends soon.
    constexpr std::size_t part = 1024;
    // A scene takes a few times the memory of its parts with coordinates.
    constexpr std::size_t most_kept_parts = 400000;
    std::size_t kept_parts = 0;
    StudyJobs all;
    std::map<std::string, std::size_t> rows, groups, sets;
    const std::size_t count = study.combination_count();
    for (std::size_t first = 0; first < count; first += part) {
        std::vector<Found> found(std::min(part, count - first));
        parallel_stage("reading jobs", found.size(), 8, progress, [&](std::size_t k) {
            // Exceptions leave from serial code.
            try {
                found[k] = look_at(study, first + k, options);
            } catch (const InputError& error) {
                found[k].invalid = error.what();
                found[k].key.clear();
            }
        });
        for (std::size_t k = 0; k < found.size(); ++k) {
            Found& job = found[k];
            if (job.left_out) {
                ++all.left_out;
                continue;
            }
            // A path that leads nowhere is a fault of the study, not of one job.
            if (!job.invalid.empty() && (job.key.empty() || !study.record_invalid_jobs)) throw InputError("", job.invalid);
            std::size_t row_set = 0, group = 0, set = 0;
            if (job.invalid.empty()) {
                row_set = rows.emplace(job.rows_key, rows.size()).first->second;
                set = sets.emplace(job.set_key, sets.size()).first->second;
                const auto [place, is_new] = groups.emplace(job.group_key, groups.size());
                if (is_new) all.group_keys.push_back(job.group_key);
                group = place->second;
            }
            if (job.scene != nullptr) kept_parts += 20 + job.scene->polyhedra.size() + job.scene->polygons.size() + job.scene->apertures.size();
            if (kept_parts > most_kept_parts) job.scene.reset();
            all.jobs.push_back({first + k, std::move(job.key), row_set, group, set, std::move(job.invalid), std::move(job.scene)});
        }
    }
    all.row_sets = rows.size();
    all.sets = sets.size();
    if (all.jobs.empty())
        study.document->root().refuse(fmt::format("no job is left: the sun is never above {:.4g} degrees (\"sun_above_deg\" leaves out {} jobs)",
                                                  degrees_from_radians(study.sun_above_rad.value_or(0.0)), all.left_out));
    return all;
}

}  // namespace naturel
