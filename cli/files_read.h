#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "core/scene_sources.h"

namespace naturel {

/// Where the files lie that a scene was read from, the scene's own first. sources: of read_scene_with_sources().
std::vector<std::filesystem::path> paths_of_sources(const std::filesystem::path& scene, std::span<const SourceFile> sources);

/// Throws InputError where a file that will be written is one of those that were read, under whatever name. option: what names the
/// files that are written, for the message.
void refuse_to_replace(std::span<const std::filesystem::path> read, std::span<const std::filesystem::path> written, const char* option = "--out");

}  // namespace naturel
