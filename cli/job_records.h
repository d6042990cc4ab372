#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/progress.h"

namespace naturel {

// Finished jobs on disk: files that only grow. A record is a magic word, the length of its content, the first 16 bytes of the
// content's SHA-256 in hexadecimal, and the content. A process may be killed at any instant: what is not a whole record with a
// checksum that fits is not there.

/// Content of a record: a line of JSON, and numbers after it.
struct JobRecord {
    std::string json;             ///< one line
    std::vector<double> numbers;
};

/// Where a whole record stands.
struct RecordPlace {
    std::filesystem::path file;
    std::uint64_t offset = 0, length = 0;  ///< of its content
    std::string checksum;                  ///< that its content had
};

/// What a file of records holds.
struct RecordScan {
    std::vector<std::pair<RecordPlace, std::string>> records;  ///< place and JSON line
    std::uint64_t end = 0;          ///< of the last whole record
    std::uint64_t tail_bytes = 0;   ///< torn bytes after it
    std::uint64_t damaged_bytes = 0;  ///< between whole records
};

/// Reads and checks a file of records; one that is not there has none. Throws InputError if it cannot be read.
RecordScan scan_records(const std::filesystem::path& file);

/// Reads one record again, and believes its content if it still has the checksum in front of it. Throws InputError if not.
JobRecord read_record(const RecordPlace& place);

/// The bytes of a record.
std::string record_bytes(std::string_view json, std::span<const double> numbers);

/// A file of records that this process alone adds to.
class RecordFile {
public:
    /// Opens or makes the file, locks it and cuts off a torn tail. Throws InputError if that cannot be, or another process is at
    /// work on it.
    explicit RecordFile(const std::filesystem::path& file);
    RecordFile(const RecordFile&) = delete;
    RecordFile& operator=(const RecordFile&) = delete;
    ~RecordFile();

    /// Bytes that a process which was killed left and that were cut off.
    std::uint64_t cut_bytes() const { return cut_bytes_; }

    /// Appends whole records and waits until the disk has them. Throws InputError (disk full, ...); the file then ends with the
    /// last record that was appended before.
    void append(std::string_view records);

private:
    [[noreturn]] void fail(int error) const;

    std::filesystem::path file_;
    int descriptor_ = -1;
    std::uint64_t end_ = 0, cut_bytes_ = 0;
};

/// Holds the lock of a study's folder as long as it lives; waits for it. Who has the lock writes lists and results, so that what
/// killed processes left of such files is removed first.
class FolderLock {
public:
    /// tell: takes a word on what it waits for. Throws Interrupted where the user does not want to wait, and InputError.
    FolderLock(const std::filesystem::path& folder, const Progress& progress, const std::function<void(const std::string&)>& tell);
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;
    ~FolderLock();

private:
    int descriptor_ = -1;
};

}  // namespace naturel
