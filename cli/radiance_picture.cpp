#include "cli/radiance_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/units.h"
#include "core/view.h"

namespace naturel {
namespace {

/// Radiance's colours: primaries, white of equal energy, luminance of each band and lm/W (ray/src/common/color.h: CIE_rf, CIE_gf,
/// CIE_bf, WHTEFFICACY).
constexpr std::string_view radiance_primaries = "0.6400 0.3300 0.2900 0.6000 0.1500 0.0600 0.3333 0.3333";
constexpr Band3 radiance_luminance{0.265074126, 0.670114631, 0.064811243};
constexpr double lumens_per_watt = 179.0;

using Rgbe = std::array<std::uint8_t, 4>;

/// setcolr() of Radiance: cut, not rounded; its readers add the half.
Rgbe rgbe(const Band3& colour) {
    const double most = largest(colour);
    if (!(most > 1e-32)) return {};
    int exponent = 0;
    const double scale = std::frexp(most, &exponent) * 256.0 / most;
    const auto byte = [&](double value) { return static_cast<std::uint8_t>(std::clamp(value * scale, 0.0, 255.0)); };
    return {byte(colour.r), byte(colour.g), byte(colour.b), static_cast<std::uint8_t>(std::clamp(exponent + 128, 0, 255))};
}

/// One channel of a row: runs of at least four equal bytes, else bytes as they are.
void append_run_lengths(std::string& bytes, std::span<const std::uint8_t> row) {
    constexpr std::size_t least_run = 4, most_run = 127, most_plain = 128;
    const auto run_at = [&](std::size_t k) {
        std::size_t n = 1;
        while (n < most_run && k + n < row.size() && row[k + n] == row[k]) ++n;
        return n;
    };
    for (std::size_t k = 0; k < row.size();) {
        if (const std::size_t n = run_at(k); n >= least_run) {
            bytes += static_cast<char>(128 + n);
            bytes += static_cast<char>(row[k]);
            k += n;
            continue;
        }
        std::size_t end = k;
        while (end < row.size() && end - k < most_plain && run_at(end) < least_run) ++end;
        bytes += static_cast<char>(end - k);
        bytes.append(reinterpret_cast<const char*>(&row[k]), end - k);
        k = end;
    }
}

}  // namespace

std::string radiance_view(const View& view) {
    const Camera camera = make_camera(view);
    const auto text = [](const glm::dvec3& v) { return fmt::format("{:.9g} {:.9g} {:.9g}", v.x + 0.0, v.y + 0.0, v.z + 0.0); };
    const auto words = [&](char type, double width, double height) {
        return fmt::format("-vt{} -vp {} -vd {} -vu {} -vh {:.9g} -vv {:.9g} -vs 0 -vl 0", type, text(view.from_m), text(camera.forward),
                           text(camera.up), width, height);
    };
    switch (view.kind) {
        case ViewKind::perspective:
            return words('v', degrees_from_radians(view.field_of_view_rad), degrees_from_radians(2.0 * std::atan(camera.half_height)));
        case ViewKind::parallel: return words('l', 2.0 * camera.half_width, 2.0 * camera.half_height);
        case ViewKind::fisheye: {
            // Radiance has no word for equal areas (-vth is orthographic, -vts stereographic), and its angles run to the edges of the picture.
            const double to_degrees = 2.0 * degrees_from_radians(camera.half_angle_rad);
            if (view.projection == FisheyeProjection::equidistant) return words('a', to_degrees * camera.half_width, to_degrees * camera.half_height);
            break;
        }
        case ViewKind::panorama: break;
    }
    return {};
}

std::string encode_radiance(const Picture& picture, const Primaries& primaries, const View& view, const ImageMetadata& metadata) {
    std::string bytes = "#?RADIANCE\nnaturel " NATUREL_VERSION "\n";
    for (const auto& [name, value] : metadata) bytes += fmt::format("{}= {}\n", name, value);
    bytes += fmt::format("naturel:unit= W/sr/m2, luminance in cd/m2 is {:g} times that\n", lumens_per_watt);
    if (const std::string words = radiance_view(view); !words.empty()) bytes += fmt::format("VIEW= {}\n", words);
    bytes += fmt::format("PRIMARIES= {}\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", radiance_primaries, picture.height, picture.width);

    const auto width = static_cast<std::size_t>(picture.width);
    // Shorter and longer rows have no run lengths (ray/src/common/color.c: MINELEN, MAXELEN).
    const bool plain = width < 8 || width > 32767;
    std::vector<Rgbe> pixels(width);
    std::vector<std::uint8_t> channel(width);
    for (std::size_t row = 0; row < static_cast<std::size_t>(picture.height); ++row) {
        for (std::size_t column = 0; column < width; ++column) {
            const std::size_t k = row * width + column;
            const double coverage = picture.coverage.empty() ? 1.0 : static_cast<double>(picture.coverage[k]);
            const Band3 band = coverage * picture.luminance_cd_m2[k];
            // White stays white, and luminance what it is: Radiance's weights are not those of our primaries.
            const double luminance = primaries.luminous(band);
            const double weighed = radiance_luminance.r * band.r + radiance_luminance.g * band.g + radiance_luminance.b * band.b;
            pixels[column] = rgbe(weighed > 0.0 && luminance > 0.0 ? luminance / weighed / lumens_per_watt * band : Band3{});
        }
        if (plain) {
            for (const Rgbe& pixel : pixels) bytes.append(reinterpret_cast<const char*>(pixel.data()), pixel.size());
            continue;
        }
        bytes += {'\x02', '\x02', static_cast<char>(width >> 8), static_cast<char>(width & 0xff)};
        for (std::size_t k = 0; k < 4; ++k) {
            std::ranges::transform(pixels, channel.begin(), [k](const Rgbe& pixel) { return pixel[k]; });
            append_run_lengths(bytes, channel);
        }
    }
    return bytes;
}

}  // namespace naturel
