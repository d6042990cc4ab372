#include "cli/file_reader.h"

#include <fstream>

#include "core/errors.h"

namespace naturel {

std::string file_content(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) throw InputError(file.string(), "there is no such file");
    // A folder has no bytes, and a device may have no end.
    if (!std::filesystem::is_regular_file(status)) throw InputError(file.string(), "this is not a file");
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    std::ifstream stream(file, std::ios::binary);
    if (error || !stream) throw InputError(file.string(), "cannot be read (check its permissions)");
    std::string bytes(size, '\0');
    stream.read(bytes.data(), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(stream.gcount()) != size) throw InputError(file.string(), "cannot be read to its end (check the disk)");
    return bytes;
}

}  // namespace naturel
