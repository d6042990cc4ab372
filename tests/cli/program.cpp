#include "tests/cli/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace naturel::tests {

TemporaryFolder::TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "naturel_test_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

namespace {

/// The largest resident set that a process has had; 0 when it has just ended.
double peak_memory_bytes(pid_t process) {
    std::ifstream status(fmt::format("/proc/{}/status", process));
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:")) return 1024.0 * std::stod(line.substr(6));  // kB
    return 0.0;
}

}  // namespace

RunningProgram::RunningProgram(const std::vector<std::string>& arguments, const std::filesystem::path& program) {
    std::vector<char*> argv{const_cast<char*>("naturel")};
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);

    const std::string output = (folder_ / "stdout").string(), errors = (folder_ / "stderr").string();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT, 0600);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT, 0600);
    const int error = ::posix_spawn(&process_, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::runtime_error("cannot start " + program.string());
}

void RunningProgram::send(int signal) const {
    ::kill(process_, signal);
}

Outcome RunningProgram::wait() {
    // What wait4() says of memory counts this process, too, if it was larger when it started the other one.
    double peak_bytes = 0.0;
    siginfo_t ended{};
    while (::waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOWAIT | WNOHANG) == 0 && ended.si_pid == 0) {
        peak_bytes = std::max(peak_bytes, peak_memory_bytes(process_));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    return {.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
            .output = content_of(folder_ / "stdout"),
            .errors = content_of(folder_ / "stderr"),
            .peak_memory_bytes = peak_bytes};
}

Outcome run_naturel(const std::vector<std::string>& arguments, const std::filesystem::path& program) {
    return RunningProgram(arguments, program).wait();
}

std::string content_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw std::runtime_error("cannot read " + file.string());
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void write(const std::filesystem::path& file, std::string_view text) {
    std::ofstream stream(file, std::ios::binary);
    if (!stream.write(text.data(), static_cast<std::streamsize>(text.size())).flush())
        throw std::runtime_error("cannot write " + file.string());
}

std::map<std::string, std::string> files_below(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    if (!std::filesystem::exists(folder)) return files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (!entry.is_directory())
            files.emplace(entry.path().lexically_relative(folder).string(), content_of(entry.path()));
    return files;
}

std::vector<std::string> backend_names() {
#ifdef NATUREL_HAS_EMBREE
    return {"hemicube", "embree"};
#else
    return {"hemicube"};
#endif
}

const std::string_view small_room = R"({
  "naturel": 1, "name": "small room",
  "materials": {
    "facade": {"reflectance": 0.3}, "wall": {"reflectance": 0.5}, "floor": {"rgb": [0.4, 0.2, 0.1]},
    "glass": {"glazing": {"normal_transmittance": 0.88}}
  },
  "ground": {"z": 0, "reflectance": 0.2},
  "polyhedra": [
    {"id": "building", "kind": "parallelepiped", "effect": "fill",
     "vertices": [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 3]], "material": "facade"},
    {"id": "room", "kind": "parallelepiped", "effect": "carve",
     "vertices": [[0.5, 0.5, 0.2], [3.5, 0.5, 0.2], [0.5, 3.5, 0.2], [0.5, 0.5, 2.7]],
     "material": "wall", "faces": {"bottom": "floor"}},
    {"id": "window", "kind": "parallelepiped", "effect": "carve",
     "vertices": [[1, -0.5, 1], [3, -0.5, 1], [1, 1, 1], [1, -0.5, 2.5]], "material": "wall", "glazing": "glass"}
  ],
  "sky": {"model": "moon_spencer", "horizontal_illuminance_lx": 10000},
  "sun": {"altitude_deg": 40, "azimuth_deg": 180, "direct_normal_illuminance_lx": 50000},
  "grid": {"spacing_m": 1},
  "sensors": [
    {"id": "work plane", "grid": {"z": 0.85, "spacing_m": 1, "margin_m": 0.4}},
    {"id": "eye, \"left\"", "points": [[2, 3, 1.2, 0, -1, 0]]}
  ],
  "views": [
    {"id": "to: window", "kind": "perspective", "from": [2, 3, 1.5], "to": [2, 0, 1.5], "fov_deg": 70,
     "width": 32, "height": 24},
    {"id": "to? Window", "kind": "perspective", "from": [2, 1, 1.5], "to": [2, 3, 1], "fov_deg": 70,
     "width": 32, "height": 24}
  ]
})";

}  // namespace naturel::tests
