#include "cli/npy.h"

#include <fmt/format.h>

#include "cli/little_endian.h"

namespace naturel {

std::string npy_header(std::string_view type, std::string_view shape) {
    std::string dictionary = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", type, shape);
    constexpr std::size_t before = 10;  // magic, version and length
    dictionary.append(63 - (before + dictionary.size()) % 64, ' ');
    dictionary += '\n';
    std::string header("\x93NUMPY\x01\x00", 8);
    append_bytes(header, static_cast<std::uint16_t>(dictionary.size()));
    return header + dictionary;
}

}  // namespace naturel
