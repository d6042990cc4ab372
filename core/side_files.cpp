#include "core/side_files.h"

#include <fmt/format.h>

#include <fstream>

#include "core/scene_values.h"
#include "core/sha256.h"

namespace naturel {

SideFiles::SideFiles(std::filesystem::path folder, std::span<const SourceFile> known) : folder_(std::move(folder)) {
    for (const SourceFile& file : known) files_.emplace(file.name, Text{file.name, file.text});
}

const SideFiles::Text& SideFiles::read(const JsonValue& name) {
    const std::string& text = read_text(name);
    if (const auto found = files_.find(text); found != files_.end()) return found->second;

    const std::filesystem::path path = folder_ / text;
    std::error_code error;
    if (text.empty() || text.find('\0') != std::string::npos || !std::filesystem::exists(path, error)) {
        name.refuse(fmt::format("there is no file {} (names are relative to the folder of the scene)", in_quotes(text)));
    }
    if (!std::filesystem::is_regular_file(path, error)) {
        name.refuse(fmt::format("{} is not a plain file (a CSV file is needed)", in_quotes(text)));
    }
    if (std::filesystem::file_size(path, error) > JsonDocument::max_bytes || error) {
        name.refuse(fmt::format("{} is too long (at most {} MB)", in_quotes(text), JsonDocument::max_bytes >> 20));
    }
    std::ifstream stream(path, std::ios::binary);
    Text file{path.string(), {std::istreambuf_iterator<char>(stream), {}}};
    if (!stream) name.refuse(fmt::format("{} cannot be read (check its permissions)", in_quotes(text)));
    return files_.emplace(text, std::move(file)).first->second;
}

std::vector<SourceFile> SideFiles::sources() const {
    std::vector<SourceFile> list;
    for (const auto& [name, file] : files_) list.push_back({name, file.text});
    return list;
}

std::string SideFiles::sha256_with(std::string_view scene_text) const {
    std::string digest = sha256_hex(scene_text);
    if (files_.empty()) return digest;
    for (const auto& [name, file] : files_)
        digest += sha256_hex(file.text);
    return sha256_hex(digest);
}

}  // namespace naturel
