#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace naturel {

/// The name that numpy has for a type of numbers.
template <class T>
constexpr std::string_view npy_type() {
    if constexpr (std::is_same_v<T, double>) return "<f8";
    if constexpr (std::is_same_v<T, float>) return "<f4";
    if constexpr (std::is_same_v<T, std::uint32_t>) return "<u4";
    if constexpr (std::is_same_v<T, std::int32_t>) return "<i4";
    if constexpr (std::is_same_v<T, std::int64_t>) return "<i8";
}

/// Header of an NPY file, version 1.0: a Python dictionary, filled up with blanks so that data begin at a multiple of 64.
/// shape: a Python tuple.
std::string npy_header(std::string_view type, std::string_view shape);

}  // namespace naturel
