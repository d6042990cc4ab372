#pragma once

namespace naturel {

/// CIE 1931 chromaticity.
struct Chromaticity {
    double x = 0.0, y = 0.0;

    friend constexpr bool operator==(const Chromaticity&, const Chromaticity&) = default;
};

/// CIE standard illuminant D65, 2 degree observer, to the four digits that every definition of primaries uses.
inline constexpr Chromaticity d65_chromaticity{0.3127, 0.3290};

}  // namespace naturel
