// The only user of OpenImageIO. A module of its own: with OpenImageIO come some 250 libraries, and loading them takes longer
// than a small room does. The program loads it when there are pictures to write.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "cli/images/image_file.h"

extern "C" void naturel_encode_image(const naturel::ImageFile& image, std::string& bytes) {
    const OIIO::TypeDesc format = image.is_float ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
    OIIO::ImageSpec spec(image.width, image.height, static_cast<int>(image.channels.size()), format);
    spec.channelnames = image.channels;
    const auto alpha = std::find(image.channels.begin(), image.channels.end(), "A");
    spec.alpha_channel = alpha == image.channels.end() ? -1 : static_cast<int>(alpha - image.channels.begin());
    // EXR takes colours that are multiplied by alpha, PNG those that are not: both as they come.
    if (!image.is_float) spec.attribute("oiio:UnassociatedAlpha", 1);
    for (const auto& [name, text] : image.texts)
        spec.attribute(name, text);
    for (const auto& [name, numbers] : image.numbers) {
        if (numbers.size() == 1)
            spec.attribute(name, numbers.front());
        else
            spec.attribute(name, OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, static_cast<int>(numbers.size())), numbers.data());
    }
    // Once: files are encoded at the same time. The threads of OpenEXR are its own, and a caller waits for them; -1: it has none.
    [[maybe_unused]] static const bool limited =
        OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", image.threads > 1 ? image.threads : -1);
    std::vector<unsigned char> encoded;
    OIIO::Filesystem::IOVecOutput memory(encoded);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(image.file_name, &memory);
    if (!output) throw std::runtime_error(OIIO::geterror());
    if (!output->open(image.file_name, spec) || !output->write_image(format, image.pixels) || !output->close())
        throw std::runtime_error(output->geterror());
    bytes.assign(encoded.begin(), encoded.end());
}
