#include "cli/study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>

#include "cli/study_keys.h"
#include "cli/study_values.h"
#include "core/scene_reader.h"
#include "core/scene_values.h"
#include "core/units.h"

namespace naturel {
namespace {

constexpr double most_jobs = 1e6;

/// Options of `naturel run` that a study may set: those that results depend on.
constexpr std::array<std::string_view, 27> run_options{
    "backend", "quality", "grid_spacing", "direct", "tolerance", "irc", "node_irc", "form_factor_repair", "radiosity_tolerance",
    "max_iterations", "seed", "form_factors", "pair_tolerance", "rays", "rays_per_point", "target_error", "most_rays", "cells", "projection",
    "half_side_over_height", "spacing", "rim", "viewpoints", "fixed_rotation", "exposure", "tone_mapping", "white_point"};

/// Columns of results that are there whatever the parameters are called.
constexpr std::array<std::string_view, 7> taken_names{"job", "scene", "group", "key", "row", "status", "error"};

StudyEdit scene_edit(const JsonValue& pointer, StudyValue value) {
    const std::string& text = read_text(pointer);
    if (!text.starts_with('/') || text.size() < 2)
        pointer.refuse(fmt::format("{} is no path into the scene (\"/sun/date\" would be one)", in_quotes(text)));
    return {StudyEdit::Kind::scene, text, std::move(value.json), pointer, value.source};
}

StudyEdit option_edit(const JsonValue& name, StudyValue value) {
    const std::string& text = read_text(name);
    if (std::ranges::find(run_options, text) == run_options.end())
        name.refuse(fmt::format("unknown option {} {}", in_quotes(text), suggestion(text, run_options)));
    if (value.json.is_structured())
        value.source.refuse(fmt::format("{} stands where the value of an option belongs (a number or a word)", value.source.describe()));
    return {StudyEdit::Kind::option, text, std::move(value.json), name, value.source};
}

/// Members of "set" (by JSON pointer) and "options" (by name).
std::vector<StudyEdit> read_edits(const SceneObject& object) {
    std::vector<StudyEdit> edits;
    if (const auto set = object.find("set"))
        for (const auto& [key, value] : read_table(*set, "paths into the scene")) edits.push_back(scene_edit(key, {json_of(value), value}));
    if (const auto options = object.find("options"))
        for (const auto& [key, value] : read_table(*options, "options")) edits.push_back(option_edit(key, {json_of(value), value}));
    return edits;
}

struct Parameter {
    std::string name;
    std::vector<StudySetting> settings;
};

Parameter read_parameter(const JsonValue& value) {
    const SceneObject object(value, study_keys::parameter);
    const auto path = object.find("path"), option = object.find("option");
    if (path.has_value() == option.has_value())
        object.refuse(fmt::format("{} of \"path\" and \"option\" {} given (exactly one is needed: what shall vary)",
                                  path ? "both" : "neither", path ? "are" : "is"));
    std::vector<JsonValue> targets{path ? *path : *option};
    if (path && path->kind() == JsonKind::list) {
        targets = path->items();
        if (targets.empty()) path->refuse("the list is empty (at least one path is needed)");
    }
    Parameter parameter;
    for (const StudyValue& each : read_study_values(object)) {
        StudySetting setting{each.json, {}};
        for (const JsonValue& target : targets)
            setting.edits.push_back(path ? scene_edit(target, each) : option_edit(target, each));
        parameter.settings.push_back(std::move(setting));
    }
    const std::string& target = targets.front().text();
    parameter.name = target.substr(target.rfind('/') + 1);
    if (const auto name = object.find("name")) parameter.name = read_name(*name);
    return parameter;
}

StudyBlock read_list_block(const JsonValue& value) {
    const SceneObject object(value, study_keys::list);
    StudyBlock block{{read_name(object.at("name"))}, {}};
    std::set<std::string> labels;
    for (const JsonValue& item : read_list(object.at("list"), "entries")) {
        const SceneObject entry(item, study_keys::list_entry);
        const JsonValue label = entry.at("label");
        if (!labels.insert(read_name(label)).second)
            label.refuse(fmt::format("the label {} is already taken (choose another)", in_quotes(label.text())));
        block.settings.push_back({{label.text(), read_edits(entry)}});
    }
    if (block.settings.empty()) object.at("list").refuse("the list is empty (at least one entry is needed)");
    return block;
}

StudyBlock read_zip_block(const JsonValue& value) {
    const SceneObject object(value, study_keys::zip);
    StudyBlock block;
    for (const JsonValue& item : read_list(object.at("zip"), "parameters")) {
        Parameter parameter = read_parameter(item);
        if (block.names.empty()) block.settings.resize(parameter.settings.size());
        if (parameter.settings.size() != block.settings.size())
            item.refuse(fmt::format("{} has {} values, the first of the zip {} (they must be as many)", in_quotes(parameter.name),
                                    parameter.settings.size(), block.settings.size()));
        block.names.push_back(std::move(parameter.name));
        for (std::size_t k = 0; k < block.settings.size(); ++k) block.settings[k].push_back(std::move(parameter.settings[k]));
    }
    if (block.names.empty()) object.at("zip").refuse("the list is empty (at least one parameter is needed)");
    return block;
}

StudyBlock read_block(const JsonValue& value) {
    if (value.kind() == JsonKind::object) {
        for (const JsonMember& member : value.members()) {
            if (member.key.text() == "zip") return read_zip_block(value);
            if (member.key.text() == "list") return read_list_block(value);
        }
    }
    Parameter parameter = read_parameter(value);
    StudyBlock block{{std::move(parameter.name)}, {}};
    for (StudySetting& setting : parameter.settings) block.settings.push_back({std::move(setting)});
    return block;
}

void refuse_name_twice(const JsonValue& at, const StudyBlock& block, std::set<std::string>& names) {
    for (const std::string& name : block.names) {
        if (std::ranges::find(taken_names, name) != taken_names.end())
            at.refuse(fmt::format("{} is a column of every result (give this parameter another \"name\")", in_quotes(name)));
        if (!names.insert(name).second)
            at.refuse(fmt::format("there is another parameter {} (give this one another \"name\")", in_quotes(name)));
    }
}

StudyScene read_study_scene(const JsonValue& name, const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / read_text(name);
    std::error_code absent;
    if (name.text().empty() || !std::filesystem::exists(file, absent))
        name.refuse(fmt::format("there is no scene {} (names are relative to the folder of the study)", in_quotes(name.text())));
    const JsonDocument document(read_json_file(file, "scene"), file.string());
    return {name.text(), file, json_of(document.root())};
}

StudyKeep read_keep(const JsonValue& value) {
    enum class Word { summary, sensors, images };
    StudyKeep keep;
    for (const JsonValue& item : read_list(value, "summary, sensors and images")) {
        switch (read_word<Word>(item, {{"summary", Word::summary}, {"sensors", Word::sensors}, {"images", Word::images}})) {
            case Word::summary:
                break;
            case Word::sensors:
                keep.sensors = true;
                break;
            case Word::images:
                keep.images = true;
        }
    }
    return keep;
}

}  // namespace

std::size_t Study::combination_count() const {
    std::size_t count = scenes.size();
    for (const StudyBlock& block : blocks) count *= block.settings.size();
    return count;
}

Study read_study(const std::filesystem::path& file) {
    Study study;
    study.file = file;
    study.document = std::make_unique<const JsonDocument>(read_json_file(file, "study"), file.string(), "study");
    const SceneObject root(study.document->root(), study_keys::study);
    const JsonValue version = root.at("naturel_study");
    if (version.kind() != JsonKind::number || version.number() != 1.0)
        version.refuse(fmt::format("{} is not a known version of the study format (1 would be right)", version.describe()));
    study.name = file.stem().string();
    if (const auto name = root.find("name")) study.name = read_name(*name);
    for (const std::string_view key : {"description", "$schema"})
        if (const auto text = root.find(key)) read_text(*text);

    const JsonValue scenes = root.at("scenes");
    std::vector<JsonValue> scene_names{scenes};
    if (scenes.kind() == JsonKind::list) scene_names = scenes.items();
    if (scene_names.empty()) scenes.refuse("the list is empty (at least one scene is needed)");
    for (const JsonValue& name : scene_names) study.scenes.push_back(read_study_scene(name, file.parent_path()));

    study.edits = read_edits(root);
    std::set<std::string> names;
    double jobs = static_cast<double>(study.scenes.size());
    for (const JsonValue& value : read_list(root, "vary", "parameters")) {
        study.blocks.push_back(read_block(value));
        refuse_name_twice(value, study.blocks.back(), names);
        jobs *= static_cast<double>(study.blocks.back().settings.size());
        if (jobs > most_jobs)
            value.refuse(fmt::format("up to here there are {:.3g} jobs (at most {:.0f})", jobs, most_jobs));
    }
    if (const auto keep = root.find("keep")) study.keep = read_keep(*keep);
    if (const auto altitude = root.find("sun_above_deg"))
        study.sun_above_rad = radians_from_degrees(read_number(*altitude, {-90.0, 90.0, "degrees"}));
    if (const auto word = root.find("invalid_jobs"))
        study.record_invalid_jobs = read_word<bool>(*word, {{"refuse", false}, {"record", true}});
    return study;
}

}  // namespace naturel
