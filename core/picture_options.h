#pragma once
#include <cstdint>

namespace naturel {

/// What luminance a picture shows as white.
enum class ExposureMode : std::uint8_t {
    automatic,   ///< the 99th percentile of the pixels that count, or five times their median where that is less
    percentile,  ///< this percentile of the pixels that count (pixels_for_exposure())
    ev100,       ///< a camera set to this exposure value at ISO 100
    white,       ///< this luminance, cd/m2
};

struct Exposure {
    ExposureMode mode = ExposureMode::automatic;
    double value = 0.0;  ///< per cent, EV or cd/m2; without meaning for `automatic`
};

enum class ToneMapping : std::uint8_t {
    linear,    ///< luminance over white, cut at 1
    reinhard,  ///< Reinhard et al. 2002, global
};

/// What looks white in a picture.
enum class WhitePoint : std::uint8_t {
    d65,  ///< light of the colour of D65, whatever the sky
    sky,  ///< light of the colour of the sky, as to an eye that has adapted to it
};

/// How luminance becomes the colours of a screen (core/tone_mapping.h).
struct PictureOptions {
    Exposure exposure{};
    ToneMapping tone_mapping = ToneMapping::linear;
    WhitePoint white_point = WhitePoint::d65;
};

}  // namespace naturel
