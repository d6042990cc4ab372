#include "core/tone_mapping.h"

#include <algorithm>
#include <cmath>

namespace naturel {
namespace {

/// Brightness of the mean of a picture on the screen, before compression: Reinhard's key of a normal scene.
constexpr double middle_grey = 0.18;

/// exp(mean(log(1e-4 + L))), docs/method.md eq. (Pictures 3).
double log_mean_luminance(const std::vector<double>& luminance_cd_m2) {
    constexpr double offset_cd_m2 = 1e-4;  // keeps the logarithm of black finite
    double sum = 0.0;
    for (const double value : luminance_cd_m2)
        sum += std::log(offset_cd_m2 + value);
    return luminance_cd_m2.empty() ? 1.0 : std::exp(sum / static_cast<double>(luminance_cd_m2.size()));
}

}  // namespace

double white_luminance_cd_m2(std::vector<double> luminance, const Exposure& exposure) {
    // A reflected-light meter puts a surface of L = 2^EV K / 100 at middle grey; with the sensor's saturation at
    // 78 / S lx s (ISO 12232) white is 1.2 x 2^EV. docs/method.md eq. (Pictures 1).
    if (exposure.mode == ExposureMode::ev100) return 1.2 * std::exp2(exposure.value);
    if (exposure.mode == ExposureMode::white) return exposure.value;
    std::ranges::sort(luminance);
    if (luminance.empty() || luminance.back() <= 0.0) return 1.0;
    const auto percentile = [&](double percent) {
        return luminance[static_cast<std::size_t>(static_cast<double>(luminance.size() - 1) * percent / 100.0)];
    };
    double white = 0.0;
    if (exposure.mode == ExposureMode::percentile) {
        white = percentile(exposure.value);
    } else {
        // A fifth of white is middle grey on an sRGB screen.
        white = std::min(percentile(99.0), 5.0 * luminance[luminance.size() / 2]);
    }
    return white > 0.0 ? white : luminance.back();
}

std::vector<std::size_t> pixels_for_exposure(const Picture& picture) {
    std::vector<std::size_t> shown, indoors;
    for (std::size_t k = 0; k < picture.luminance_cd_m2.size(); ++k) {
        const PixelContent what = picture.shown.empty() ? PixelContent::other : picture.shown[k];
        // What a picture does not show, as around a fisheye, has no say in how bright the rest becomes.
        if (what == PixelContent::solid || (!picture.coverage.empty() && !(picture.coverage[k] > 0.0f))) continue;
        shown.push_back(k);
        if (what == PixelContent::indoors) indoors.push_back(k);
    }
    return picture.around_rooms && !indoors.empty() ? indoors : shown;
}

ScreenPicture map_to_screen(const Picture& picture, const Primaries& primaries, const PictureOptions& options,
                            const Band3& sky_colour) {
    std::vector<double> luminance, shown;
    luminance.reserve(picture.luminance_cd_m2.size());
    for (const Band3& band : picture.luminance_cd_m2)
        luminance.push_back(primaries.luminous(band));
    for (const std::size_t k : pixels_for_exposure(picture)) shown.push_back(luminance[k]);

    const bool reinhard = options.tone_mapping == ToneMapping::reinhard;
    const bool by_log_mean = reinhard && options.exposure.mode == ExposureMode::automatic;
    ScreenPicture screen{.width = picture.width, .height = picture.height};
    screen.white_luminance_cd_m2 = by_log_mean ? log_mean_luminance(shown) / middle_grey
                                               : white_luminance_cd_m2(shown, options.exposure);
    const double brightest = luminance.empty() ? 0.0 : std::ranges::max(luminance) / screen.white_luminance_cd_m2;

    const bool adapted = options.white_point == WhitePoint::sky;
    const glm::dmat3 adaptation = adapted ? chromatic_adaptation(primaries.xyz(sky_colour), primaries.xyz(grey(1.0)))
                                          : glm::dmat3(1.0);
    screen.linear_srgb.reserve(picture.luminance_cd_m2.size());
    for (std::size_t k = 0; k < luminance.size(); ++k) {
        double scale = 1.0 / screen.white_luminance_cd_m2;
        if (reinhard && brightest > 0.0) {
            // docs/method.md eq. (Pictures 4): what is brightest becomes white.
            const double l = luminance[k] * scale;
            scale *= (1.0 + l / (brightest * brightest)) / (1.0 + l);
        }
        Band3 band = scale * picture.luminance_cd_m2[k];
        if (adapted) band = primaries.from_xyz(adaptation * primaries.xyz(band));
        screen.linear_srgb.push_back(linear_srgb(primaries, band));
    }
    return screen;
}

std::array<std::uint8_t, 3> srgb8(const glm::dvec3& linear) {
    const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(255.0 * srgb_curve(value))); };
    return {byte(linear.x), byte(linear.y), byte(linear.z)};
}

}  // namespace naturel
