#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/file_writer.h"

namespace naturel {

/// Writes files into a ZIP archive as they are, without compression (PKWARE APPNOTE 6.3.3). No time stamps: equal contents give
/// equal archives. Sizes from 4 GB take the ZIP64 form.
class ZipWriter {
public:
    explicit ZipWriter(WholeFile& file) : file_(file) {}

    /// The content is the parts one after the other.
    void add(std::string_view name, std::span<const std::string_view> parts);

    /// Writes the directory: the archive is complete.
    void finish();

private:
    struct Entry {
        std::string name;
        std::uint32_t crc = 0;
        std::uint64_t size = 0, offset = 0;
    };
    void write(std::string_view bytes);

    WholeFile& file_;
    std::vector<Entry> entries_;
    std::uint64_t offset_ = 0;
};

}  // namespace naturel
