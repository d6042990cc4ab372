#pragma once
#include <string>
#include <utility>
#include <vector>

namespace naturel {

/// An image as the encoder takes it.
struct ImageFile {
    const char* file_name = nullptr;  ///< its ending chooses the format; no such file is touched
    int width = 0, height = 0;
    std::vector<std::string> channels{};
    bool is_float = false;         ///< else 8 bits
    const void* pixels = nullptr;  ///< [height x width x channels], rows from the top
    std::vector<std::pair<std::string, std::string>> texts{};
    std::vector<std::pair<std::string, std::vector<float>>> numbers{};
    int threads = 1;  ///< that may compress it; the same for all images of a process
};

/// Name and type of what naturel_images.so exports. bytes: those of the file. Throws std::runtime_error.
inline constexpr const char* encode_image_symbol = "naturel_encode_image";
using EncodeImage = void (*)(const ImageFile& image, std::string& bytes);

}  // namespace naturel
