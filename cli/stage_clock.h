#pragma once
#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace naturel {

/// One stage of a calculation and how long it took.
struct StageTime {
    std::string stage;
    double seconds = 0.0;
};

/// Collects how long the stages of a run take.
class StageClock {
public:
    StageClock() = default;
    /// Goes on from stages that are over, from now.
    explicit StageClock(std::vector<StageTime> stages) : stages_(std::move(stages)) {}

    /// Ends the stage that has been going on since construction or the last call.
    void end_stage(std::string stage) {
        const auto now = std::chrono::steady_clock::now();
        stages_.push_back({std::move(stage), std::chrono::duration<double>(now - start_).count()});
        start_ = now;
    }
    /// Takes over stages that were timed by somebody else since the last call.
    void add_stages(const std::vector<std::pair<std::string, double>>& stages) {
        for (const auto& [stage, seconds] : stages)
            stages_.push_back({stage, seconds});
        start_ = std::chrono::steady_clock::now();
    }
    const std::vector<StageTime>& stages() const { return stages_; }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::vector<StageTime> stages_;
};

}  // namespace naturel
