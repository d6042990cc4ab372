#include "cli/files_read.h"

#include <fmt/format.h>

#include "core/errors.h"

namespace naturel {

std::vector<std::filesystem::path> paths_of_sources(const std::filesystem::path& scene, std::span<const SourceFile> sources) {
    std::vector<std::filesystem::path> paths{scene};
    for (const SourceFile& source : sources.subspan(1)) paths.push_back(scene.parent_path() / source.name);
    return paths;
}

void refuse_to_replace(std::span<const std::filesystem::path> read, std::span<const std::filesystem::path> written, const char* option) {
    for (const std::filesystem::path& file : written)
        for (const std::filesystem::path& source : read) {
            std::error_code absent;
            if (!std::filesystem::equivalent(file, source, absent) || absent) continue;
            throw InputError(source.string(), fmt::format("is read, and {} would be written over it (give another {})", file.string(), option));
        }
}

}  // namespace naturel
