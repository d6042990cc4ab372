#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <type_traits>

#include "cli/little_endian.h"
#include "core/sha256.h"

namespace naturel {

/// Collects what something depends on; equal digests mean equal contents, added in equal order.
class Fingerprint {
public:
    Fingerprint& add(double number) {
        append_bytes(bytes_, number + 0.0);  // -0 and 0 are the same
        return *this;
    }
    template <class T>
        requires std::is_integral_v<T> || std::is_enum_v<T>
    Fingerprint& add(T number) {
        append_bytes(bytes_, static_cast<std::int64_t>(number));
        return *this;
    }
    Fingerprint& add(std::string_view text) {
        add(text.size());
        bytes_ += text;
        return *this;
    }
    Fingerprint& add(const glm::dvec3& vector) { return add(vector.x).add(vector.y).add(vector.z); }

    /// 64 hexadecimal digits.
    std::string digest() const { return sha256_hex(bytes_); }

private:
    std::string bytes_;
};

}  // namespace naturel
