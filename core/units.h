#pragma once
#include <compare>
#include <numbers>

namespace naturel {

inline constexpr double pi = std::numbers::pi;

/// A number with its unit in the type: adding a luminance to an illuminance does not compile.
template <class Unit>
struct Quantity {
    double value{};

    friend constexpr auto operator<=>(Quantity, Quantity) = default;
    friend constexpr Quantity operator+(Quantity a, Quantity b) { return {a.value + b.value}; }
    friend constexpr Quantity operator*(double k, Quantity q) { return {k * q.value}; }
};

using Illuminance = Quantity<struct Lux>;                  // lx, arriving
using Luminance = Quantity<struct CandelaPerSquareMetre>;  // cd/m2

/// Degrees exist in files and options only; the reader turns them into radians with this.
constexpr double radians_from_degrees(double degrees) { return degrees * (pi / 180.0); }
constexpr double degrees_from_radians(double radians) { return radians * (180.0 / pi); }

}  // namespace naturel
