#pragma once
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/json_document.h"

namespace naturel {

/// One thing that a study changes: what stands at a JSON pointer of the scene, or an option of `naturel run`.
struct StudyEdit {
    enum class Kind { scene, option };
    Kind kind = Kind::scene;
    std::string target;            ///< "/sun/date"; "rays"
    nlohmann::ordered_json value;
    JsonValue target_source;       ///< where the study names the target ...
    JsonValue value_source;        ///< ... and the value
};

/// What one value of a parameter does.
struct StudySetting {
    nlohmann::ordered_json shown;  ///< in results
    std::vector<StudyEdit> edits;
};

/// Parameters that vary together. Blocks combine like the digits of a number, the last fastest.
struct StudyBlock {
    std::vector<std::string> names;                   ///< [parameter]
    std::vector<std::vector<StudySetting>> settings;  ///< [row][parameter], at least one row
};

struct StudyScene {
    std::string name;  ///< as the study writes it
    std::filesystem::path file;
    nlohmann::ordered_json base;
};

/// What is kept of each job beside its figures.
struct StudyKeep {
    bool sensors = false;  ///< light on every sensor
    bool images = false;   ///< the views of the scene
};

/// A study as its file says it: scenes and what to vary in them (docs/batch.md). Values are checked where a job's scene is read.
struct Study {
    std::unique_ptr<const JsonDocument> document;  ///< what the JsonValues above refer to
    std::filesystem::path file;
    std::string name;
    std::vector<StudyScene> scenes;
    std::vector<StudyEdit> edits;  ///< of every job
    std::vector<StudyBlock> blocks;
    StudyKeep keep;
    std::optional<double> sun_above_rad;  ///< jobs whose sun is not higher are left out
    bool record_invalid_jobs = false;     ///< an invalid scene is a failed job; else no job is computed

    /// Scenes times rows of the blocks.
    std::size_t combination_count() const;
};

/// Throws InputError with file, line and column.
Study read_study(const std::filesystem::path& file);

}  // namespace naturel
