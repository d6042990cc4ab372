#include "cli/base64.h"

#include <cstdint>

namespace naturel {

std::string base64(std::string_view bytes) {
    constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t k = 0; k < bytes.size(); k += 3) {
        const std::size_t left = bytes.size() - k;
        const auto byte = [&](std::size_t i) {
            return i < left ? std::uint32_t{static_cast<unsigned char>(bytes[k + i])} : 0u;
        };
        const std::uint32_t group = byte(0) << 16 | byte(1) << 8 | byte(2);
        for (std::size_t i = 0; i < 4; ++i)
            text += i <= left ? letters[group >> (18 - 6 * i) & 63u] : '=';
    }
    return text;
}

}  // namespace naturel
