#include "cli/job_records.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <system_error>
#include <thread>

#include "cli/file_writer.h"
#include "cli/little_endian.h"
#include "core/errors.h"
#include "core/sha256.h"

namespace naturel {
namespace {

constexpr std::string_view record_magic = "NATURJOB";
constexpr std::size_t checksum_bytes = 32;  // hexadecimal digits: 128 bits
constexpr std::size_t head_bytes = record_magic.size() + sizeof(std::uint64_t) + checksum_bytes;

std::string checksum(std::string_view content) {
    return sha256_hex(content).substr(0, checksum_bytes);
}

std::string words_of(int error) {
    return std::generic_category().message(error);
}

struct OpenFile {
    explicit OpenFile(const std::filesystem::path& file) : descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {}
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
    ~OpenFile() {
        if (descriptor >= 0) ::close(descriptor);
    }
    const int descriptor;
};

/// From its beginning to where it ends at this moment.
std::string bytes_of_file(int descriptor, const std::filesystem::path& file) {
    struct stat status{};
    if (::fstat(descriptor, &status) != 0) throw InputError(file.string(), fmt::format("cannot be read: {}", words_of(errno)));
    std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
    std::size_t have = 0;
    while (have < bytes.size()) {
        const ssize_t got = ::pread(descriptor, bytes.data() + have, bytes.size() - have, static_cast<off_t>(have));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw InputError(file.string(), fmt::format("cannot be read to its end: {}", words_of(errno)));
        if (got == 0) break;  // another process may just have cut off a torn end
        have += static_cast<std::size_t>(got);
    }
    bytes.resize(have);
    return bytes;
}

/// The content of a record that begins at `at`; empty if there is none, or it is not whole.
std::string_view content_at(std::string_view bytes, std::size_t at) {
    if (bytes.size() - at < head_bytes || bytes.substr(at, record_magic.size()) != record_magic) return {};
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + record_magic.size(), sizeof length);
    if (length > bytes.size() - at - head_bytes) return {};
    const std::string_view content = bytes.substr(at + head_bytes, length);
    return bytes.substr(at + head_bytes - checksum_bytes, checksum_bytes) == checksum(content) ? content : std::string_view();
}

RecordScan scan_bytes(const std::string& bytes, const std::filesystem::path& file) {
    RecordScan scan;
    std::size_t at = 0;
    while (at < bytes.size()) {
        const std::string_view content = content_at(bytes, at);
        if (content.empty()) {
            at = std::min(bytes.find(record_magic, at + 1), bytes.size());
            continue;
        }
        scan.damaged_bytes += at - scan.end;
        scan.records.push_back({{file, at + head_bytes, content.size(), bytes.substr(at + head_bytes - checksum_bytes, checksum_bytes)}, std::string(content.substr(0, content.find('\n')))});
        at += head_bytes + content.size();
        scan.end = at;
    }
    scan.tail_bytes = bytes.size() - scan.end;
    return scan;
}

}  // namespace

std::string record_bytes(std::string_view json, std::span<const double> numbers) {
    std::string content(json);
    content += '\n';
    content += bytes_of(numbers);
    std::string record(record_magic);
    append_bytes<std::uint64_t>(record, content.size());
    return record + checksum(content) + content;
}

RecordScan scan_records(const std::filesystem::path& file) {
    const OpenFile open(file);
    if (open.descriptor < 0 && errno == ENOENT) return {};
    if (open.descriptor < 0) throw InputError(file.string(), fmt::format("cannot be read: {}", words_of(errno)));
    return scan_bytes(bytes_of_file(open.descriptor, file), file);
}

JobRecord read_record(const RecordPlace& place) {
    std::ifstream stream(place.file, std::ios::binary);
    std::string head(head_bytes, '\0'), content(place.length, '\0');
    stream.seekg(static_cast<std::streamoff>(place.offset - head_bytes));
    stream.read(head.data(), static_cast<std::streamsize>(head.size())).read(content.data(), static_cast<std::streamsize>(content.size()));
    if (!stream || head.substr(head_bytes - checksum_bytes) != place.checksum)
        throw InputError(place.file.string(), "has changed while it was read (is the disk well?)");
    const std::size_t line = content.find('\n');
    JobRecord record{content.substr(0, line), std::vector<double>((content.size() - line - 1) / sizeof(double))};
    if (!record.numbers.empty()) std::memcpy(record.numbers.data(), content.data() + line + 1, record.numbers.size() * sizeof(double));
    return record;
}

RecordFile::RecordFile(const std::filesystem::path& file) : file_(file) {
    descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor_ < 0) throw InputError(file.string(), fmt::format("cannot be opened for writing: {}", words_of(errno)));
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
        const int error = errno;
        ::close(descriptor_);
        throw InputError(file.string(), error == EWOULDBLOCK ? "another naturel is at work on these jobs (wait for it, or choose another folder)"
                                                             : fmt::format("cannot be locked: {}", words_of(error)));
    }
    const RecordScan scan = scan_bytes(bytes_of_file(descriptor_, file), file);
    end_ = scan.end;
    cut_bytes_ = scan.tail_bytes;
    if (cut_bytes_ > 0 && ::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) {
        const int error = errno;
        ::close(descriptor_);
        throw InputError(file.string(), fmt::format("cannot be cut to its last whole record: {}", words_of(error)));
    }
}

RecordFile::~RecordFile() {
    ::close(descriptor_);  // and with it goes the lock
}

void RecordFile::fail(int error) const {
    // What was written of these records is worth nothing; if it cannot be cut off, the next reader will see that.
    [[maybe_unused]] const int ignored = ::ftruncate(descriptor_, static_cast<off_t>(end_));
    throw InputError(file_.string(), fmt::format("cannot be written: {} (finished jobs are safe: make room and give the same command again)",
                                                 words_of(error)));
}

void RecordFile::append(std::string_view records) {
    std::uint64_t at = end_;
    while (!records.empty()) {
        const ssize_t written = ::pwrite(descriptor_, records.data(), records.size(), static_cast<off_t>(at));
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail(errno);
        at += static_cast<std::uint64_t>(written);
        records.remove_prefix(static_cast<std::size_t>(written));
    }
    // Network file systems report a full disk here.
    if (::fdatasync(descriptor_) != 0) fail(errno);
    end_ = at;
}

FolderLock::FolderLock(const std::filesystem::path& folder, const Progress& progress, const std::function<void(const std::string&)>& tell) {
    const std::filesystem::path file = folder / "lock";
    descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor_ < 0) throw InputError(file.string(), fmt::format("cannot be locked: {}", words_of(errno)));
    // Asking again and again, as a signal just before a call that waits would be waited for, too.
    for (int asked = 0; ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0; ++asked) {
        const int error = errno;
        if (error == EINTR) continue;
        if (error == EWOULDBLOCK && !progress.interrupted()) {
            if (asked == 20) tell(fmt::format("waiting for another naturel that writes lists or results in {}", folder.string()));
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
            continue;
        }
        ::close(descriptor_);
        if (error == EWOULDBLOCK) throw Interrupted();
        throw InputError(file.string(), fmt::format("cannot be locked: {}", words_of(error)));
    }
    // No files of anybody else: the folder may be one of downloads.
    std::error_code gone;
    for (const auto& entry : entries_of(folder, gone)) {
        const std::string name = entry.path().filename().string();
        const bool is_ours = name.starts_with("jobs.jsonl.") || name.starts_with("results.csv.") || name.starts_with("results.jsonl.") ||
                             name.starts_with("sensors_");
        if (is_ours && name.ends_with(part_ending) && entry.is_regular_file(gone)) std::filesystem::remove(entry.path(), gone);
    }
}

FolderLock::~FolderLock() {
    ::close(descriptor_);
}

}  // namespace naturel
