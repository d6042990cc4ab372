#pragma once

namespace naturel {

/// A spectrum reduced to three bands (long, middle and short waves: "red", "green", "blue").
/// What a band means is fixed by the primaries of the scene (core/colour.h). A light of D65 colour and illuminance
/// E is {E, E, E}; the photometric value of any Band3 is Primaries::luminous(band).
struct Band3 {
    double r{}, g{}, b{};

    friend constexpr bool operator==(const Band3&, const Band3&) = default;
    constexpr Band3& operator+=(const Band3& o) { return r += o.r, g += o.g, b += o.b, *this; }
    friend constexpr Band3 operator+(Band3 a, const Band3& o) { return a += o; }
    friend constexpr Band3 operator-(const Band3& a, const Band3& o) { return {a.r - o.r, a.g - o.g, a.b - o.b}; }
    friend constexpr Band3 operator*(const Band3& a, const Band3& o) { return {a.r * o.r, a.g * o.g, a.b * o.b}; }
    friend constexpr Band3 operator*(double k, const Band3& a) { return {k * a.r, k * a.g, k * a.b}; }
};

constexpr Band3 grey(double value) { return {value, value, value}; }
constexpr double largest(const Band3& a) {
    const double m = a.r > a.g ? a.r : a.g;
    return m > a.b ? m : a.b;
}

}  // namespace naturel
