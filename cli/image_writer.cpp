#include "cli/image_writer.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <future>
#include <stdexcept>
#include <system_error>

#include "cli/images/image_file.h"
#include "core/parallel.h"

namespace naturel {
namespace {

/// Beside the program. By its whole path: sanitizers open modules in the name of their own library, whose folder it is not in.
std::filesystem::path module_file() {
    return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "naturel_images.so";
}

/// The encoder of the module, which stays loaded.
EncodeImage load_encoder() {
    void* const module = ::dlopen(module_file().c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const symbol = module == nullptr ? nullptr : ::dlsym(module, encode_image_symbol);
    if (symbol == nullptr) throw std::runtime_error(std::string("cannot load the writer of pictures: ") + ::dlerror());
    return reinterpret_cast<EncodeImage>(symbol);
}

/// What comes of loading it, once it has begun.
std::shared_future<EncodeImage> loaded_encoder(std::launch how) {
    static const std::shared_future<EncodeImage> encoder = std::async(how, load_encoder).share();
    return encoder;
}

std::string encode(ImageFile image, const ImageMetadata& metadata) {
    const EncodeImage encode_image = loaded_encoder(std::launch::deferred).get();
    ImageMetadata texts = metadata;
    // OpenImageIO would put the clock's time here, and equal runs must give equal bytes.
    texts.emplace_back("DateTime", "1970:01:01 00:00:00");
    texts.emplace_back("Software", "naturel " NATUREL_VERSION);
    image.texts.insert(image.texts.begin(), texts.begin(), texts.end());
    image.threads = thread_limit();
    std::string bytes;
    encode_image(image, bytes);
    return bytes;
}

const std::vector<std::string> rgb{"R", "G", "B"}, rgba{"R", "G", "B", "A"};

bool shows_everywhere(std::span<const float> coverage) {
    return std::ranges::all_of(coverage, [](float share) { return share >= 1.0f; });
}

}  // namespace

ImageWriterOpening::ImageWriterOpening(int threads) {
    if (!std::filesystem::exists(module_file()))
        throw std::runtime_error("cannot load the writer of pictures: there is no " + module_file().string());
    // The first loop of TBB loads libraries, too, and only one thread can do that at a time.
    parallel_for(static_cast<std::size_t>(threads), 1, [](std::size_t) {});
    if (threads <= 1) return;
    try {
        loaded_encoder(std::launch::async);
        in_background_ = true;
    } catch (const std::system_error&) {
        // No thread is to be had for it.
    }
}

ImageWriterOpening::~ImageWriterOpening() {
    if (in_background_) loaded_encoder(std::launch::async).wait();
}

void require_image_writer() {
    static_cast<void>(loaded_encoder(std::launch::deferred).get());
}

std::string encode_exr(const Picture& picture, const Primaries& primaries, const ImageMetadata& metadata) {
    std::vector<float> chromaticities;
    for (const Band3& band : {Band3{1, 0, 0}, Band3{0, 1, 0}, Band3{0, 0, 1}, Band3{1, 1, 1}}) {
        const glm::dvec3 xyY = xyY_from_xyz(primaries.xyz(band));
        chromaticities.push_back(static_cast<float>(xyY.x));
        chromaticities.push_back(static_cast<float>(xyY.y));
    }
    std::vector<float> pixels;
    const bool has_alpha = !shows_everywhere(picture.coverage);
    pixels.reserve(picture.luminance_cd_m2.size() * 5);
    for (std::size_t k = 0; k < picture.luminance_cd_m2.size(); ++k) {
        // As EXR wants it, colours are what a pixel shows times the share of it that shows anything.
        const double share = has_alpha ? static_cast<double>(picture.coverage[k]) : 1.0;
        const Band3 band = share * picture.luminance_cd_m2[k];
        for (const double value : {band.r, band.g, band.b, primaries.luminous(band)}) pixels.push_back(static_cast<float>(value));
        if (has_alpha) pixels.push_back(static_cast<float>(share));
    }
    return encode({.file_name = "picture.exr",
                   .width = picture.width,
                   .height = picture.height,
                   .channels = has_alpha ? std::vector<std::string>{"R", "G", "B", "Y", "A"} : std::vector<std::string>{"R", "G", "B", "Y"},
                   .is_float = true,
                   .pixels = pixels.data(),
                   .texts = {{"compression", "zip"}},
                   // Bands {1, 1, 1} are 1 cd/m2.
                   .numbers = {{"chromaticities", chromaticities}, {"whiteLuminance", {1.0f}}}},
                  metadata);
}

std::string encode_png(const ScreenPicture& picture, std::span<const float> coverage, const ImageMetadata& metadata) {
    const bool has_alpha = !shows_everywhere(coverage);
    std::vector<std::uint8_t> pixels;
    pixels.reserve(picture.linear_srgb.size() * 4);
    for (std::size_t k = 0; k < picture.linear_srgb.size(); ++k) {
        for (const std::uint8_t byte : srgb8(picture.linear_srgb[k])) pixels.push_back(byte);
        if (has_alpha) pixels.push_back(static_cast<std::uint8_t>(std::lround(255.0 * static_cast<double>(coverage[k]))));
    }
    return encode({.file_name = "picture.png",
                   .width = picture.width,
                   .height = picture.height,
                   .channels = has_alpha ? rgba : rgb,
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
