#pragma once
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace naturel::tests {

/// The number that stands at an offset.
template <class Number>
Number number_at(const std::string& bytes, std::size_t offset) {
    if (offset + sizeof(Number) > bytes.size()) throw std::runtime_error("a number beyond the bytes");
    Number number;
    std::memcpy(&number, bytes.data() + offset, sizeof number);
    return number;
}

inline std::string from_base64(const std::string& text) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        if (c == '=') break;
        bits = bits << 6 | static_cast<std::uint32_t>(letters.find(c));
        if (++count % 4 != 1) bytes += static_cast<char>(bits >> (6 - 2 * ((count - 1) % 4)) & 0xffu);
    }
    return bytes;
}

}  // namespace naturel::tests
