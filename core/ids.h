#pragma once
#include <cstddef>
#include <cstdint>

namespace naturel {

// Scene objects refer to each other by position in their vector; each kind has its own type, so that a patch
// number cannot be used where a facet number is meant.
enum class PatchId : std::uint32_t { none = 0xffff'ffffu };
enum class NodeId : std::uint32_t {};
enum class FaceId : std::uint32_t {};
enum class FacetId : std::uint32_t { none = 0xffff'ffffu };
enum class ApertureId : std::uint32_t {};
enum class MaterialId : std::uint32_t {};
enum class GlazingId : std::uint32_t {};

template <class Id>
constexpr std::size_t index(Id id) {
    return static_cast<std::size_t>(id);
}

template <class Id>
constexpr Id make_id(std::size_t position) {
    return static_cast<Id>(position);
}

}  // namespace naturel
