#pragma once
#include <filesystem>
#include <string>

namespace naturel {

/// Bytes of a regular file. Throws InputError with path and reason.
std::string file_content(const std::filesystem::path& file);

}  // namespace naturel
