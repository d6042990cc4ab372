#pragma once
#include <filesystem>
#include <string_view>

namespace naturel {

/// Writes a file whole or not at all: beside its final place first, then renamed.
/// Throws InputError with path and reason; nothing half-written remains.
void write_file(const std::filesystem::path& file, std::string_view bytes);

/// Makes a folder if need be, and proves that files can be written there.
/// Throws InputError with path and reason.
void make_writable_folder(const std::filesystem::path& folder);

}  // namespace naturel
