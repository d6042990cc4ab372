#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace naturel {

/// Processor time of one thread; threads are numbered in the order in which they first worked.
struct ThreadTime {
    std::size_t thread = 0;
    double cpu_s = 0.0;
};

/// One stage of a calculation and what it took.
struct StageTime {
    std::string stage;
    double wall_s = 0.0;
    double cpu_s = 0.0;                 ///< of all threads of the process
    std::vector<ThreadTime> workers{};  ///< threads that ran serial code or at least one block of a loop
};

/// Collects what the stages of a run take. Stages follow each other without gaps; each is part of a trace.
class StageClock {
public:
    /// Goes on from stages that are over, from now.
    explicit StageClock(std::vector<StageTime> stages = {}) : stages_(std::move(stages)), start_(now()) {}

    /// Ends the stage that has been going on since construction or the last call. From serial code, on one thread.
    void end_stage(std::string stage);

    /// Takes over stages that were timed by somebody else since the last call.
    void add_stages(const std::vector<StageTime>& stages);

    const std::vector<StageTime>& stages() const { return stages_; }
    std::vector<StageTime> take() && { return std::move(stages_); }

private:
    struct Moment {
        std::chrono::steady_clock::time_point time;
        double cpu_s;
        std::vector<std::uint64_t> blocks;  ///< [thread]
        std::vector<double> thread_cpu_s;   ///< [thread]
    };
    static Moment now();

    std::vector<StageTime> stages_;
    Moment start_;
};

}  // namespace naturel
