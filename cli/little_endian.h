#pragma once
#include <bit>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace naturel {

static_assert(std::endian::native == std::endian::little, "files hold numbers as memory does: little endian");

/// The bytes of a number, appended.
template <class Number>
void append_bytes(std::string& bytes, Number number) {
    static_assert(std::is_arithmetic_v<Number>);
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// The bytes of an array of plain values.
template <class T>
std::string_view bytes_of(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

}  // namespace naturel
