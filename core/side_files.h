#pragma once
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/json_document.h"
#include "core/scene_sources.h"

namespace naturel {

/// The files that a scene names, read from beside it.
class SideFiles {
public:
    /// folder: of the scene file.
    explicit SideFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// Files whose texts are known already.
    SideFiles(std::filesystem::path folder, std::span<const SourceFile> known);

    struct Text {
        std::string file_name;  ///< for messages
        std::string text;
    };

    /// The file that `name`, a text of the scene, names: absolute or relative to the scene. Read once. Refuses at `name`
    /// what cannot be read or is longer than a scene may be.
    const Text& read(const JsonValue& name);

    /// Identifies a scene together with all files it has read: the SHA-256 of its text if it has read none.
    std::string sha256_with(std::string_view scene_text) const;

    /// All files that have been read, by the names that the scene gives them.
    std::vector<SourceFile> sources() const;

private:
    std::filesystem::path folder_;
    std::map<std::string, Text> files_;  // by the name in the scene: sha256_with() needs an order
};

}  // namespace naturel
