#pragma once
#include <atomic>
#include <chrono>
#include <mutex>
#include <string>

#include "core/progress.h"

namespace naturel {

/// Shows the current stage on stderr (share done, time left), in one line that is redrawn at most 10 times a
/// second.
class TerminalProgress final : public Progress {
public:
    /// visible: false draws nothing. stop: becomes true when the user wants the program to stop.
    TerminalProgress(bool visible, const std::atomic<bool>& stop) : visible_(visible), stop_(stop) {}
    ~TerminalProgress() override { erase(); }

    void begin(std::string_view stage, std::size_t total) override;
    void advance(std::size_t steps) override;
    void end() override { erase(); }
    bool interrupted() const override { return stop_.load(std::memory_order_relaxed); }

private:
    using Clock = std::chrono::steady_clock;

    void draw(Clock::time_point now);
    void erase();

    const bool visible_;
    const std::atomic<bool>& stop_;
    std::mutex drawing_;
    std::string stage_;
    std::size_t total_ = 0;
    Clock::time_point start_{};
    std::atomic<std::size_t> done_ = 0;
    std::atomic<Clock::rep> next_draw_ = 0;  ///< ticks since the clock's epoch
    bool drawn_ = false;
};

}  // namespace naturel
