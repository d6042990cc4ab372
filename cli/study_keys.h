#pragma once
#include <array>

#include "core/scene_keys.h"

namespace naturel {

/// The keys of one kind of object in a study, as scene_keys are those of a scene; docs/study.schema.json lists the same ones.
namespace study_keys {

inline constexpr SceneObjectKeys study{
    "study",
    {"naturel_study", "scenes"},
    {"$schema", "name", "description", "set", "options", "vary", "keep", "sun_above_deg", "invalid_jobs"}};
inline constexpr SceneObjectKeys parameter{
    "parameter", {}, {"name", "path", "option", "values", "range", "dates", "times"}};
inline constexpr SceneObjectKeys zip{"zip", {"zip"}, {}};
inline constexpr SceneObjectKeys list{"list", {"name", "list"}, {}};
inline constexpr SceneObjectKeys list_entry{"list_entry", {"label"}, {"set", "options"}};
inline constexpr SceneObjectKeys range{"range", {"first", "last"}, {"step", "count"}};
inline constexpr SceneObjectKeys dates{"dates", {"first", "last"}, {"step_days", "step_months"}};
inline constexpr SceneObjectKeys times{"times", {"first", "last"}, {"step_min"}};

inline constexpr std::array all{study, parameter, zip, list, list_entry, range, dates, times};

}  // namespace study_keys
}  // namespace naturel
