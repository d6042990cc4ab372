#pragma once
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/errors.h"

namespace naturel {

/// A file that cannot be written.
struct WriteError : InputError {
    using InputError::InputError;
};

/// How the names of files end that are still being written. A process that was killed leaves them.
constexpr std::string_view part_ending = ".part";

/// A file that is written piece by piece beside its place, and vanishes with this object unless put there. A link stays, and the file
/// that it leads to is replaced; what is no file (a pipe, a device) is written to as it is, and has all bytes up to an error.
/// Everything throws WriteError with path and reason.
class WholeFile {
public:
    explicit WholeFile(const std::filesystem::path& target);
    WholeFile(const WholeFile&) = delete;
    WholeFile& operator=(const WholeFile&) = delete;
    ~WholeFile();

    void write(std::string_view bytes);

    /// The file is complete and stays beside its place.
    void close();

    /// What stands in its place goes, unless it is no file.
    void remove_earlier() const;

    /// close(), and rename to the target.
    void put_in_place();

    /// The same; afterwards the file outlives a loss of power.
    void put_in_place_for_good();

private:
    std::filesystem::path target_, path_;  ///< equal where there is nothing to be put in place
    int descriptor_ = -1;
    bool moved_ = false;
};

/// Writes a file whole or not at all: beside its final place first, then renamed.
/// Throws WriteError with path and reason; nothing half-written remains.
void write_file(const std::filesystem::path& file, std::string_view bytes);

/// The same for what must outlive a loss of power.
void write_file_for_good(const std::filesystem::path& file, std::string_view bytes);

/// Makes a folder if need be, and proves that files can be written there.
/// Throws WriteError with path and reason.
void make_writable_folder(const std::filesystem::path& folder);

/// What is in a folder. Empty, with an error, where it cannot be read to its end.
std::vector<std::filesystem::directory_entry> entries_of(const std::filesystem::path& folder, std::error_code& error);

/// Removes what processes that were killed left of files in a folder: parts that nobody has written to for an hour.
void remove_left_parts(const std::filesystem::path& folder);

/// Afterwards a folder and everything below it outlives a loss of power. Throws WriteError with path and reason.
void keep_for_good(const std::filesystem::path& folder);

/// Writes to a stream without keeping any of it back.
void print_at_once(std::FILE* stream, std::string_view text);

}  // namespace naturel
