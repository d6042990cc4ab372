#include "cli/timed_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <system_error>

#include "cli/file_reader.h"
#include "cli/guarded.h"
#include "cli/run.h"
#include "core/errors.h"
#include "core/parallel.h"
#include "core/sha256.h"

namespace naturel {
namespace {

/// A folder of results that goes when this object does.
class RunFolder {
public:
    explicit RunFolder(std::filesystem::path path) : path_(std::move(path)) { clear(); }
    RunFolder(const RunFolder&) = delete;
    RunFolder& operator=(const RunFolder&) = delete;
    ~RunFolder() { clear(); }

private:
    void clear() {
        std::error_code absent;
        std::filesystem::remove_all(path_, absent);
    }
    std::filesystem::path path_;
};

/// Tells of a signal that the process was sent, and nothing else.
class SilentProgress final : public Progress {
public:
    explicit SilentProgress(const Progress& told) : told_(told) {}
    void begin(std::string_view, std::size_t) override {}
    void advance(std::size_t) override {}
    void end() override {}
    bool interrupted() const override { return told_.interrupted(); }

private:
    const Progress& told_;
};

/// The child's whole life.
[[noreturn]] void run_and_exit(pid_t parent, const RunOptions& options, const std::filesystem::path& words, const Progress& progress) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(static_cast<int>(ExitCode::internal_fault));  // it died before that
    const int file = ::open(words.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (file < 0) ::_exit(static_cast<int>(ExitCode::internal_fault));
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    const ExitCode code = guarded([&] {
        const ThreadLimit limit(options.threads);
        SilentProgress silent(progress);
        return run(options, silent);
    });
    ::_exit(static_cast<int>(code));
}

/// Waits for a child and asks it to stop when the user wants to.
int wait_for(pid_t child, const Progress& progress, rusage& used) {
    int status = 0;
    while (::wait4(child, &status, 0, &used) < 0) {
        if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "wait4");
        if (progress.interrupted()) ::kill(child, SIGTERM);
    }
    if (progress.interrupted()) throw Interrupted();
    return status;
}

void read_timings(MeasuredRun& run, const nlohmann::json& timings) {
    for (const auto& stage : timings.at("stages")) {
        MeasuredStage measured{.stage = stage.at("stage"), .wall_s = stage.at("seconds"), .cpu_s = stage.at("cpu_seconds"),
                               .threads_that_worked = stage.at("threads_that_worked")};
        if (const auto work = stage.find("work"); work != stage.end()) {
            measured.work = work->at("count");
            measured.work_unit = work->at("unit");
        }
        run.stages.push_back(std::move(measured));
    }
    run.stages.push_back({.stage = whole_run, .wall_s = timings.at("total_seconds"), .cpu_s = timings.at("total_cpu_seconds"),
                          .threads_that_worked = timings.at("threads_that_worked")});
    run.peak_memory_bytes = timings.at("peak_memory_bytes");
}

}  // namespace

MeasuredRun timed_run(const RunOptions& options, const std::filesystem::path& folder, const Progress& progress) {
    const RunFolder results(folder);
    std::filesystem::path words = folder;
    words += ".txt";
    const RunFolder words_file(words);
    RunOptions own = options;
    own.out = folder;
    own.quiet = true;
    own.stages_apart = true;

    const std::optional<MachineTimes> before = machine_times();
    std::fflush(nullptr);  // or the child would print what is waiting here once more
    const pid_t self = ::getpid(), child = ::fork();
    if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (child == 0) run_and_exit(self, own, words, progress);
    rusage used{};
    const int status = wait_for(child, progress, used);
    const std::optional<MachineTimes> after = machine_times();

    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : static_cast<int>(ExitCode::internal_fault);
    if (code != static_cast<int>(ExitCode::done) && code != static_cast<int>(ExitCode::not_converged)) {
        std::fputs(file_content(words).c_str(), stderr);
        if (WIFSIGNALED(status)) std::fprintf(stderr, "naturel: a timed run was ended by signal %d\n", WTERMSIG(status));
        throw FailedRun{static_cast<ExitCode>(code)};
    }
    MeasuredRun run{.backend = options.backend, .threads = options.threads,
                    .converged = code == static_cast<int>(ExitCode::done)};
    const std::filesystem::path of_backend = folder / options.backend;
    read_timings(run, nlohmann::json::parse(file_content(of_backend / "timings.json")));
    const auto summary = nlohmann::json::parse(file_content(of_backend / "summary.json"));
    run.patches = summary.at("counts").at("patches");
    run.grid_spacing_m = summary.at("options").at("grid_spacing_m");
    const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec); };
    run.load = foreign_load(before, after, seconds(used.ru_utime) + seconds(used.ru_stime));
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.is_regular_file() && entry.path().filename() != "timings.json")
            run.hashes[entry.path().lexically_relative(folder).string()] = sha256_hex(file_content(entry.path()));
    return run;
}

}  // namespace naturel
