#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "core/scene.h"

namespace naturel {

class SceneObject;

/// What a scene says about the light outdoors: its keys "site", "sky" and "sun".
struct OutdoorDescription {
    SkyDescription sky{};
    std::optional<SunDescription> sun{};
    double north_rad = 0.0;
};

/// root: an object with the key "sky", and perhaps "site" and "sun". folder: where a table's file is looked for.
/// Throws InputError.
OutdoorDescription read_outdoors(const SceneObject& root, const std::filesystem::path& folder);

/// The same for a JSON text that has these three keys alone; name: in messages. Files are looked for in the current folder.
OutdoorDescription read_outdoors_text(const std::string& text, const std::string& name);

}  // namespace naturel
