#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/scene_reader.h"

namespace naturel {

/// A file that a scene was read from.
struct SourceFile {
    std::string name{};  ///< as the scene names it; of the scene itself its file name, without a folder
    std::string text{};
};

/// read_scene(), and the texts of all files it has read: the scene's own, then those that it names.
Scene read_scene_with_sources(const std::filesystem::path& file, const SceneDefaults& defaults, std::vector<SourceFile>& sources);

/// A scene that was read before, from its texts.
Scene read_scene_sources(std::span<const SourceFile> sources, const SceneDefaults& defaults = {});

}  // namespace naturel
