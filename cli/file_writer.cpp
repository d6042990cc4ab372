#include "cli/file_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>

#include "core/errors.h"

namespace naturel {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
    throw WriteError(file.string(),
                     fmt::format("cannot be written: {}", std::generic_category().message(error)));
}

/// Processes on several machines may write to one folder, and have the same number.
std::string name_of_part() {
    return fmt::format(".{}-{:x}{}", ::getpid(), std::chrono::system_clock::now().time_since_epoch().count(), part_ending);
}

/// What is written to a file or a folder is on the disk afterwards.
void flush(const std::filesystem::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        // It may be written but not read; or somebody has just put it in its place under another name.
        if (errno == EACCES || errno == ENOENT) return;
        fail(path, errno);
    }
    const int error = ::fsync(descriptor) == 0 ? 0 : errno;
    ::close(descriptor);
    // Not every file system can do that for everything; these are those that lose something.
    if (error == EIO || error == ENOSPC || error == EDQUOT) fail(path, error);
}

/// Where a chain of symbolic links ends, whether or not there is anything.
std::filesystem::path target_of_links(std::filesystem::path path) {
    constexpr int longest_chain = 40;  // Linux gives up there, too: ELOOP
    std::error_code error;
    for (int k = 0; k < longest_chain && std::filesystem::is_symlink(path, error); ++k)
        path = path.parent_path() / std::filesystem::read_symlink(path, error);
    return path;
}

}  // namespace

WholeFile::WholeFile(const std::filesystem::path& target) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(target, error);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
        // As it is named: the links of /proc to pipes end in no path.
        path_ = target_ = target;
        moved_ = true;
        descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
    } else {
        target_ = target_of_links(target);
        path_ = target_.string() + name_of_part();
        descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    }
    if (descriptor_ < 0) fail(target_, errno);
}

WholeFile::~WholeFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!moved_) ::unlink(path_.c_str());
}

void WholeFile::write(std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail(target_, errno);
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
}

void WholeFile::close() {
    // Network file systems report a full disk here.
    const int result = ::close(descriptor_);
    descriptor_ = -1;
    if (result != 0 && errno != EINTR) fail(target_, errno);
}

void WholeFile::remove_earlier() const {
    if (path_ != target_) ::unlink(target_.c_str());
}

void WholeFile::put_in_place() {
    if (descriptor_ >= 0) close();
    if (path_ == target_) return;
    if (::rename(path_.c_str(), target_.c_str()) != 0) fail(target_, errno);
    moved_ = true;
}

void WholeFile::put_in_place_for_good() {
    if (path_ != target_ && ::fsync(descriptor_) != 0) fail(target_, errno);
    put_in_place();
    flush(target_.has_parent_path() ? target_.parent_path() : ".");
}

void write_file_for_good(const std::filesystem::path& file, std::string_view bytes) {
    WholeFile whole(file);
    whole.write(bytes);
    whole.put_in_place_for_good();
}

void write_file(const std::filesystem::path& file, std::string_view bytes) {
    WholeFile whole(file);
    whole.write(bytes);
    whole.put_in_place();
}

void make_writable_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw WriteError(folder.string(), fmt::format("cannot be made: {}", error.message()));
    const std::filesystem::path file = folder / ("probe" + name_of_part());
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0) fail(folder, errno);
    ::unlink(file.c_str());
    const int written = ::write(descriptor, "naturel", 7) == 7 ? 0 : errno;
    ::close(descriptor);
    if (written != 0) fail(folder, written);
}

std::vector<std::filesystem::directory_entry> entries_of(const std::filesystem::path& folder, std::error_code& error) {
    std::vector<std::filesystem::directory_entry> entries;
    std::filesystem::directory_iterator at(folder, error);
    while (!error && at != std::filesystem::directory_iterator()) {
        entries.push_back(*at);
        at.increment(error);
    }
    if (error) entries.clear();
    return entries;
}

void remove_left_parts(const std::filesystem::path& folder) {
    const auto long_ago = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
    std::error_code gone;
    for (const auto& entry : entries_of(folder, gone)) {
        const auto written = entry.last_write_time(gone);
        if (!gone && written < long_ago && entry.path().extension() == part_ending && entry.is_regular_file(gone))
            std::filesystem::remove(entry.path(), gone);
    }
}

void keep_for_good(const std::filesystem::path& folder) {
    std::error_code error;
    for (const auto& entry : entries_of(folder, error)) {
        if (entry.is_directory(error))
            keep_for_good(entry.path());
        else
            flush(entry.path());
    }
    if (error) fail(folder, error.value());
    flush(folder);
    flush(folder.has_parent_path() ? folder.parent_path() : ".");
}

void print_at_once(std::FILE* stream, std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stream);
    std::fflush(stream);
}

}  // namespace naturel
