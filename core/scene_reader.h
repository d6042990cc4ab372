#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "core/scene.h"

namespace naturel {

/// Accuracy where a scene does not ask for one.
struct SceneDefaults {
    GridOptions grid{};
    DirectOptions direct{};
};

/// Reads a scene file (JSON with // comments, docs/scene_format.md).
/// Everything is checked here: syntax, keys (unknown ones are refused with the nearest known one), types, ranges,
/// names, degenerate or non-planar geometry. Nothing past the reader re-checks it.
/// Throws InputError "file:line:column: /json/path: what is wrong (what would be right)".
/// defaults: of keys that the file does not name.
Scene read_scene(const std::filesystem::path& file, const SceneDefaults& defaults = {});

/// The same for text in memory; file_name appears in messages.
Scene read_scene_text(std::string_view text, const std::string& file_name, const SceneDefaults& defaults = {});

}  // namespace naturel
