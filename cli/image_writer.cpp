#include "cli/image_writer.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <stdexcept>

namespace naturel {
namespace {

OIIO::ImageSpec make_spec(int width, int height, int channels, OIIO::TypeDesc format,
                          const ImageMetadata& metadata) {
    OIIO::ImageSpec spec(width, height, channels, format);
    for (const auto& [name, text] : metadata)
        spec.attribute(name, text);
    // OpenImageIO would put the clock's time here, and equal runs must give equal bytes.
    spec.attribute("DateTime", "1970:01:01 00:00:00");
    spec.attribute("Software", "naturel " NATUREL_VERSION);
    return spec;
}

/// file_name: its ending chooses the format; no such file is touched.
std::string encode(const char* file_name, const OIIO::ImageSpec& spec, OIIO::TypeDesc format,
                   const void* pixels) {
    // One thread: the number of threads of the process belongs to TBB.
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", 1);
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(file_name, &memory);
    if (!output) throw std::runtime_error(OIIO::geterror());
    if (!output->open(file_name, spec) || !output->write_image(format, pixels) || !output->close())
        throw std::runtime_error(output->geterror());
    return std::string(bytes.begin(), bytes.end());
}

}  // namespace

std::string encode_exr(const Picture& picture, const Primaries& primaries, const ImageMetadata& metadata) {
    OIIO::ImageSpec spec = make_spec(picture.width, picture.height, 4, OIIO::TypeDesc::FLOAT, metadata);
    spec.channelnames = {"R", "G", "B", "Y"};
    spec.alpha_channel = -1;
    spec.attribute("compression", "zip");
    std::vector<float> chromaticities;
    for (const Band3& band : {Band3{1, 0, 0}, Band3{0, 1, 0}, Band3{0, 0, 1}, Band3{1, 1, 1}}) {
        const glm::dvec3 xyY = xyY_from_xyz(primaries.xyz(band));
        chromaticities.push_back(static_cast<float>(xyY.x));
        chromaticities.push_back(static_cast<float>(xyY.y));
    }
    spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), chromaticities.data());
    spec.attribute("whiteLuminance", 1.0f);  // bands {1, 1, 1} are 1 cd/m2

    std::vector<float> pixels;
    pixels.reserve(picture.luminance_cd_m2.size() * 4);
    for (const Band3& band : picture.luminance_cd_m2)
        for (const double value : {band.r, band.g, band.b, primaries.luminous(band)})
            pixels.push_back(static_cast<float>(value));
    return encode("picture.exr", spec, OIIO::TypeDesc::FLOAT, pixels.data());
}

std::string encode_png(const ScreenPicture& picture, const ImageMetadata& metadata) {
    OIIO::ImageSpec spec = make_spec(picture.width, picture.height, 3, OIIO::TypeDesc::UINT8, metadata);
    spec.attribute("oiio:ColorSpace", "sRGB");
    std::vector<std::uint8_t> pixels;
    pixels.reserve(picture.linear_srgb.size() * 3);
    for (const glm::dvec3& colour : picture.linear_srgb)
        for (const std::uint8_t byte : srgb8(colour))
            pixels.push_back(byte);
    return encode("picture.png", spec, OIIO::TypeDesc::UINT8, pixels.data());
}

std::string encode_png(const Raster& raster, const ImageMetadata& metadata) {
    OIIO::ImageSpec spec = make_spec(raster.width, raster.height, 3, OIIO::TypeDesc::UINT8, metadata);
    spec.attribute("oiio:ColorSpace", "sRGB");
    static_assert(sizeof(Rgb8) == 3);
    return encode("raster.png", spec, OIIO::TypeDesc::UINT8, raster.pixels.data());
}

}  // namespace naturel
