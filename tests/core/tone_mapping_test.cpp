#include "core/tone_mapping.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const Primaries srgb(PrimariesName::srgb);

Picture picture_of(std::vector<Band3> pixels) {
    return {.width = static_cast<int>(pixels.size()), .height = 1, .luminance_cd_m2 = std::move(pixels)};
}

}  // namespace

TEST_CASE("linear tone mapping divides by white and keeps what is brighter above 1", "[core][picture]") {
    const ScreenPicture screen = map_to_screen(picture_of({grey(50.0), {100.0, 20.0, 0.0}, grey(400.0)}), srgb,
                                               {.exposure = {ExposureMode::white, 200.0}}, grey(1.0));
    CHECK(screen.white_luminance_cd_m2 == 200.0);
    CHECK(glm::length(screen.linear_srgb[0] - glm::dvec3(0.25)) < 1e-14);
    CHECK(glm::length(screen.linear_srgb[1] - glm::dvec3(0.5, 0.1, 0.0)) < 1e-14);
    CHECK(glm::length(screen.linear_srgb[2] - glm::dvec3(2.0)) < 1e-14);
    CHECK(srgb8(screen.linear_srgb[2]) == std::array<std::uint8_t, 3>{255, 255, 255});
}

TEST_CASE("exposure by EV100 shows 1.2 x 2^EV as white", "[core][picture]") {
    CHECK(white_luminance_cd_m2({1.0}, {ExposureMode::ev100, 0.0}) == 1.2);
    CHECK_THAT(white_luminance_cd_m2({1.0}, {ExposureMode::ev100, 12.0}), WithinRel(4915.2, 1e-14));
}

TEST_CASE("a percentile is a pixel's luminance, and automatic exposure looks after the darker half", "[core][picture]") {
    std::vector<double> luminance(101);
    for (std::size_t k = 0; k < luminance.size(); ++k)
        luminance[k] = static_cast<double>(k);
    std::ranges::reverse(luminance);
    CHECK(white_luminance_cd_m2(luminance, {ExposureMode::percentile, 90.0}) == 90.0);
    CHECK(white_luminance_cd_m2(luminance, {ExposureMode::percentile, 100.0}) == 100.0);
    CHECK(white_luminance_cd_m2(luminance, {}) == 99.0);
    CHECK(white_luminance_cd_m2({10.0, 10.0, 10.0, 5000.0, 5000.0}, {}) == 50.0);
    CHECK(white_luminance_cd_m2({0.0, 0.0, 0.0, 7.0}, {}) == 7.0);
    CHECK(white_luminance_cd_m2({0.0, 0.0}, {}) == 1.0);
    CHECK(white_luminance_cd_m2({}, {}) == 1.0);
}

TEST_CASE("an exposure looks at what has light, and from around the rooms at the rooms alone", "[core][picture]") {
    Picture picture = picture_of({grey(0.0), grey(10.0), grey(20.0), grey(0.0), grey(900.0)});
    CHECK(pixels_for_exposure(picture) == std::vector<std::size_t>{0, 1, 2, 3, 4});
    picture.shown = {PixelContent::solid, PixelContent::indoors, PixelContent::mixed, PixelContent::mixed, PixelContent::other};
    picture.coverage = {1.0f, 1.0f, 0.5f, 0.0f, 1.0f};
    CHECK(pixels_for_exposure(picture) == std::vector<std::size_t>{1, 2, 4});
    picture.around_rooms = true;
    CHECK(pixels_for_exposure(picture) == std::vector<std::size_t>{1});
    picture.shown[1] = PixelContent::other;
    CHECK(pixels_for_exposure(picture) == std::vector<std::size_t>{1, 2, 4});
    for (const ToneMapping mapping : {ToneMapping::linear, ToneMapping::reinhard}) {
        Picture without = picture_of({grey(10.0), grey(20.0), grey(900.0)});
        CHECK(map_to_screen(picture, srgb, {.tone_mapping = mapping}, grey(1.0)).white_luminance_cd_m2 ==
              map_to_screen(without, srgb, {.tone_mapping = mapping}, grey(1.0)).white_luminance_cd_m2);
    }
}

TEST_CASE("Reinhard shows the brightest as white and the log mean near middle grey", "[core][picture]") {
    std::vector<Band3> pixels;
    for (int k = 0; k <= 100; ++k)
        pixels.push_back(grey(std::pow(10.0, 0.04 * k)));  // 1 to 10000 cd/m2, log mean 100
    const ScreenPicture screen =
        map_to_screen(picture_of(pixels), srgb, {.tone_mapping = ToneMapping::reinhard}, grey(1.0));
    CHECK_THAT(screen.linear_srgb.back().y, WithinAbs(1.0, 1e-12));
    CHECK_THAT(screen.linear_srgb[50].y, WithinRel(0.18 / 1.18, 1e-3));  // + l / lw^2: 5.6e-4 of it
    for (std::size_t k = 1; k < pixels.size(); ++k)
        CHECK(screen.linear_srgb[k].y > screen.linear_srgb[k - 1].y);
    // Colour stays: all bands get the same factor.
    const ScreenPicture coloured = map_to_screen(picture_of({{40.0, 20.0, 10.0}, grey(500.0)}), srgb,
                                                 {.tone_mapping = ToneMapping::reinhard}, grey(1.0));
    CHECK_THAT(coloured.linear_srgb[0].x / coloured.linear_srgb[0].y, WithinRel(2.0, 1e-12));
    CHECK_THAT(coloured.linear_srgb[0].y / coloured.linear_srgb[0].z, WithinRel(2.0, 1e-12));
}

TEST_CASE("a black picture stays black whatever the options", "[core][picture]") {
    for (const ToneMapping mapping : {ToneMapping::linear, ToneMapping::reinhard}) {
        const ScreenPicture screen =
            map_to_screen(picture_of({grey(0.0), grey(0.0)}), srgb, {.tone_mapping = mapping}, grey(1.0));
        for (const glm::dvec3& colour : screen.linear_srgb)
            CHECK(colour == glm::dvec3(0.0));
    }
}

TEST_CASE("adapted to the sky, a white surface under a blue sky is white", "[core][picture][colour]") {
    const LightColour sky = light_colour(srgb, daylight_chromaticity(12000.0));
    const Picture picture = picture_of({100.0 * sky.band, 20.0 * sky.band});
    const PictureOptions plain{.exposure = {ExposureMode::white, 100.0}};
    PictureOptions adapted = plain;
    adapted.white_point = WhitePoint::sky;
    CHECK(map_to_screen(picture, srgb, plain, sky.band).linear_srgb[0].z > 1.3);  // bluish
    const ScreenPicture white = map_to_screen(picture, srgb, adapted, sky.band);
    CHECK(glm::length(white.linear_srgb[0] - glm::dvec3(1.0)) < 1e-12);
    CHECK(glm::length(white.linear_srgb[1] - glm::dvec3(0.2)) < 1e-12);
}

TEST_CASE("the colour of a light has luminance 1 and its own chromaticity", "[core][colour]") {
    for (const double cct_k : {4000.0, 5500.0, 6500.0, 25000.0}) {
        const Chromaticity xy = daylight_chromaticity(cct_k);
        const LightColour light = light_colour(srgb, xy);
        CHECK(light.desaturation.saturation_kept == 1.0);
        CHECK_THAT(srgb.luminous(light.band), WithinAbs(1.0, 1e-14));
        const glm::dvec3 xyY = xyY_from_xyz(srgb.xyz(light.band));
        CHECK(std::hypot(xyY.x - xy.x, xyY.y - xy.y) < 1e-9);
    }
    CHECK(light_colour(srgb, d65_chromaticity).band == grey(1.0));
    const LightColour laser = light_colour(srgb, {0.15, 0.80});
    CHECK(laser.desaturation.saturation_kept < 1.0);
    CHECK(laser.desaturation.chromaticity_shift > 0.1);
    CHECK_THAT(srgb.luminous(laser.band), WithinAbs(1.0, 1e-14));
}
