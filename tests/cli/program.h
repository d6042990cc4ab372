#pragma once
#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace naturel::tests {

/// A folder that vanishes with this object.
class TemporaryFolder {
public:
    TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder();

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

private:
    std::filesystem::path path_;
};

/// How the program ended and what it said.
struct Outcome {
    int exit_code = -1;  ///< 128 + signal number when a signal ended it
    std::string output;  ///< stdout
    std::string errors;  ///< stderr
    double peak_memory_bytes = 0.0;  ///< looked at every millisecond
};

/// The program at work.
class RunningProgram {
public:
    /// Starts `naturel` with arguments. Its input is empty, its output is kept in files.
    explicit RunningProgram(const std::vector<std::string>& arguments, const std::filesystem::path& program = NATUREL_PROGRAM);

    void send(int signal) const;
    Outcome wait();

private:
    TemporaryFolder folder_;
    pid_t process_ = -1;
};

/// Runs `naturel`, or a copy of it, with arguments to its end.
Outcome run_naturel(const std::vector<std::string>& arguments, const std::filesystem::path& program = NATUREL_PROGRAM);

std::string content_of(const std::filesystem::path& file);
void write(const std::filesystem::path& file, std::string_view text);

/// Content of every file below a folder, by relative path.
std::map<std::string, std::string> files_below(const std::filesystem::path& folder);

/// Both names of backends where both are built in, else the only one.
std::vector<std::string> backend_names();

/// A room with one window, small enough to be computed in a moment.
extern const std::string_view small_room;

}  // namespace naturel::tests
