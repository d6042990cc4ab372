#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "core/json_document.h"
#include "core/scene_values.h"

namespace naturel {

/// A value of a study as the library holds it; whole numbers stay whole.
nlohmann::ordered_json json_of(const JsonValue& value);

/// One of the values that a parameter takes, and where the study says so.
struct StudyValue {
    nlohmann::ordered_json json;
    JsonValue source;
};

/// What the keys "values", "range", "dates" or "times" of a parameter stand for; exactly one must be there. Throws InputError.
std::vector<StudyValue> read_study_values(const SceneObject& parameter);

}  // namespace naturel
