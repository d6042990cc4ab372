#include "cli/image_writer.h"

#include <dlfcn.h>

#include <cstdint>
#include <filesystem>
#include <stdexcept>

#include "cli/images/image_file.h"

namespace naturel {
namespace {

/// The encoder of the module beside the program, which stays loaded. By its whole path: sanitizers open modules in the name of
/// their own library, whose folder it is not in.
EncodeImage load_encoder() {
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
    void* const module = ::dlopen((program.parent_path() / "naturel_images.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const symbol = module == nullptr ? nullptr : ::dlsym(module, encode_image_symbol);
    if (symbol == nullptr) throw std::runtime_error(std::string("cannot load the writer of pictures: ") + ::dlerror());
    return reinterpret_cast<EncodeImage>(symbol);
}

std::string encode(ImageFile image, const ImageMetadata& metadata) {
    static const EncodeImage encode_image = load_encoder();
    ImageMetadata texts = metadata;
    // OpenImageIO would put the clock's time here, and equal runs must give equal bytes.
    texts.emplace_back("DateTime", "1970:01:01 00:00:00");
    texts.emplace_back("Software", "naturel " NATUREL_VERSION);
    image.texts.insert(image.texts.begin(), texts.begin(), texts.end());
    std::string bytes;
    encode_image(image, bytes);
    return bytes;
}

const std::vector<std::string> rgb{"R", "G", "B"};

}  // namespace

void require_image_writer() {
    static_cast<void>(load_encoder());
}

std::string encode_exr(const Picture& picture, const Primaries& primaries, const ImageMetadata& metadata) {
    std::vector<float> chromaticities;
    for (const Band3& band : {Band3{1, 0, 0}, Band3{0, 1, 0}, Band3{0, 0, 1}, Band3{1, 1, 1}}) {
        const glm::dvec3 xyY = xyY_from_xyz(primaries.xyz(band));
        chromaticities.push_back(static_cast<float>(xyY.x));
        chromaticities.push_back(static_cast<float>(xyY.y));
    }
    std::vector<float> pixels;
    pixels.reserve(picture.luminance_cd_m2.size() * 4);
    for (const Band3& band : picture.luminance_cd_m2)
        for (const double value : {band.r, band.g, band.b, primaries.luminous(band)})
            pixels.push_back(static_cast<float>(value));
    return encode({.file_name = "picture.exr",
                   .width = picture.width,
                   .height = picture.height,
                   .channels = {"R", "G", "B", "Y"},
                   .is_float = true,
                   .pixels = pixels.data(),
                   .texts = {{"compression", "zip"}},
                   // Bands {1, 1, 1} are 1 cd/m2.
                   .numbers = {{"chromaticities", chromaticities}, {"whiteLuminance", {1.0f}}}},
                  metadata);
}

std::string encode_png(const ScreenPicture& picture, const ImageMetadata& metadata) {
    std::vector<std::uint8_t> pixels;
    pixels.reserve(picture.linear_srgb.size() * 3);
    for (const glm::dvec3& colour : picture.linear_srgb)
        for (const std::uint8_t byte : srgb8(colour))
            pixels.push_back(byte);
    return encode({.file_name = "picture.png",
                   .width = picture.width,
                   .height = picture.height,
                   .channels = rgb,
                   .pixels = pixels.data(),
                   .texts = {{"oiio:ColorSpace", "sRGB"}}},
                  metadata);
}

std::string encode_png(const Raster& raster, const ImageMetadata& metadata) {
    static_assert(sizeof(Rgb8) == 3);
    return encode({.file_name = "raster.png",
                   .width = raster.width,
                   .height = raster.height,
                   .channels = rgb,
                   .pixels = raster.pixels.data(),
                   .texts = {{"oiio:ColorSpace", "sRGB"}}},
                  metadata);
}

}  // namespace naturel
