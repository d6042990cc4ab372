#pragma once
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cli/raster.h"
#include "core/colour.h"
#include "core/picture.h"
#include "core/tone_mapping.h"

namespace naturel {

/// Name and text of what an image file says about itself.
using ImageMetadata = std::vector<std::pair<std::string, std::string>>;

/// Begins to load the module that writes pictures, and some 250 libraries with it, which takes longer than many a calculation: in the
/// background where there are threads for it, else when it is needed. Its end waits for that: a program must not end while libraries
/// load.
class ImageWriterOpening {
public:
    /// Throws std::runtime_error where there is no such module.
    explicit ImageWriterOpening(int threads);
    ImageWriterOpening(const ImageWriterOpening&) = delete;
    ImageWriterOpening& operator=(const ImageWriterOpening&) = delete;
    ~ImageWriterOpening();

private:
    bool in_background_ = false;
};

/// Waits for the module; the functions below do so, too. Throws std::runtime_error where it cannot be loaded: ask before files are
/// written.
void require_image_writer();

/// Bytes of an OpenEXR file, 32-bit float, cd/m2: channels R, G, B are the bands, Y is the luminance. The
/// file states the chromaticities of the bands, so that other programs show the right colours. Float, not
/// half: a clear sky close to the sun exceeds the 65504 of half. Where a pixel does not show something all over, as outside the circle
/// of a fisheye, there is a channel A, and the others are multiplied by it.
std::string encode_exr(const Picture& picture, const Primaries& primaries, const ImageMetadata& metadata);

/// Bytes of a PNG file, 8-bit sRGB.
/// coverage: as Picture::coverage, transparent where nothing is shown.
std::string encode_png(const ScreenPicture& picture, std::span<const float> coverage, const ImageMetadata& metadata);

/// Bytes of a PNG file of what has been drawn.
std::string encode_png(const Raster& raster, const ImageMetadata& metadata);

}  // namespace naturel
