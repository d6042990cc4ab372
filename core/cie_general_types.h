#pragma once
#include <array>

namespace naturel {

/// Zenith luminance of a standard sky by R. Kittler & S. Darula 1998 (docs/method.md eqs. (Level 3) and (Level 4)).
struct ZenithLevel {
    double turbidity;  ///< luminous turbidity T_v, typical
    double a1, a2;     ///< both 0: a sky in which the sun is not seen
    double b, c, d, e;
    double diffuse_share;  ///< D_v / E_v, typical
};

/// Gradation a, b and scattering c, d, e (docs/method.md eq. (Sky 7)).
struct CieGeneralType {
    double a, b, c, d, e;
    ZenithLevel zenith;

    bool depends_on_sun() const { return c != 0.0 || e != 0.0; }
    bool shows_sun() const { return zenith.a1 != 0.0 || zenith.a2 != 0.0; }
};

/// The 15 types of ISO 15469:2004 (CIE S 011/E:2003), type 1 first. Type 16 is Moon & Spencer's sky.
inline constexpr std::array<CieGeneralType, 15> cie_general_types{{
    {4, -0.7, 0, -1, 0, {45, 0, 0, 54.63, 1, 0, 0, 0.1}},
    {4, -0.7, 2, -1.5, 0.15, {20, 0, 0, 12.35, 3.68, 0.59, 50.47, 0.18}},
    {1.1, -0.8, 0, -1, 0, {45, 0, 0, 48.3, 1, 0, 0, 0.15}},
    {1.1, -0.8, 2, -1.5, 0.15, {20, 0, 0, 12.23, 3.57, 0.57, 44.27, 0.22}},
    {0, -1, 0, -1, 0, {45, 0, 0, 42.59, 1, 0, 0, 0.2}},
    {0, -1, 2, -1.5, 0.15, {20, 0, 0, 11.84, 3.53, 0.55, 38.78, 0.38}},
    {0, -1, 5, -2.5, 0.3, {12, 0.957, 1.79, 21.72, 4.52, 0.63, 34.56, 0.42}},
    {0, -1, 10, -3, 0.45, {10, 0.83, 2.03, 29.35, 4.94, 0.7, 30.41, 0.41}},
    {-1, -0.55, 2, -1.5, 0.15, {12, 0.6, 1.5, 10.34, 3.45, 0.5, 27.47, 0.4}},
    {-1, -0.55, 5, -2.5, 0.3, {10, 0.567, 2.61, 18.41, 4.27, 0.63, 24.04, 0.36}},
    {-1, -0.55, 10, -3, 0.45, {4, 1.44, -0.75, 24.41, 4.6, 0.72, 20.76, 0.23}},
    {-1, -0.32, 10, -3, 0.45, {2.5, 1.036, 0.71, 23, 4.43, 0.74, 18.52, 0.1}},
    {-1, -0.32, 16, -3, 0.3, {4.5, 1.244, -0.84, 27.45, 4.61, 0.76, 16.59, 0.28}},
    {-1, -0.15, 16, -3, 0.3, {5, 0.881, 0.453, 25.54, 4.4, 0.79, 14.56, 0.28}},
    {-1, -0.15, 24, -2.8, 0.15, {4, 0.418, 1.95, 28.08, 4.13, 0.79, 13, 0.3}},
}};

}  // namespace naturel
