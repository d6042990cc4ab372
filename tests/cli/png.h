#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace naturel::tests {

/// Pixels of a picture of 8 bits a channel, rows from the top.
struct PngPicture {
    std::size_t width = 0, height = 0, channels = 0;
    std::vector<unsigned char> bytes{};  ///< [height x width x channels]

    std::array<unsigned char, 3> rgb(std::size_t column, std::size_t row) const {
        const std::size_t at = (row * width + column) * channels;
        return {bytes.at(at), bytes.at(at + 1), bytes.at(at + 2)};
    }
};

/// Reads a file of RGB or RGBA, not interlaced (ISO/IEC 15948). Throws std::runtime_error where it is not that. Checksums are not asked.
PngPicture read_png(const std::string& file);

}  // namespace naturel::tests
