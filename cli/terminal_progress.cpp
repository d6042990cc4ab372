#include "cli/terminal_progress.h"

#include <fmt/format.h>

#include <cstdio>

namespace naturel {
namespace {

constexpr std::chrono::milliseconds redraw_interval{100};

}  // namespace

void TerminalProgress::begin(std::string_view stage, std::size_t total) {
    if (!visible_) return;
    erase();
    stage_ = stage;
    total_ = total;
    done_ = 0;
    start_ = Clock::now();
    draw(start_);
}

void TerminalProgress::advance(std::size_t steps) {
    if (!visible_) return;
    done_.fetch_add(steps, std::memory_order_relaxed);
    const Clock::time_point now = Clock::now();
    if (now.time_since_epoch().count() < next_draw_.load(std::memory_order_relaxed)) return;
    const std::unique_lock lock(drawing_, std::try_to_lock);
    if (lock) draw(now);
}

void TerminalProgress::draw(Clock::time_point now) {
    next_draw_ = (now + redraw_interval).time_since_epoch().count();
    std::string line = fmt::format("\r{}", stage_);
    const std::size_t done = done_;
    if (total_ > 0) {
        const double share = static_cast<double>(done) / static_cast<double>(total_);
        line += fmt::format(" {:3.0f} %", 100.0 * share);
        const double elapsed_s = std::chrono::duration<double>(now - start_).count();
        // The first second says little about the rest.
        if (elapsed_s > 1.0 && done > 0 && done < total_)
            line += fmt::format(", {:.0f} s left", elapsed_s * (1.0 / share - 1.0));
    }
    line += "\x1b[K";  // clears the rest of the line
    std::fwrite(line.data(), 1, line.size(), stderr);
    std::fflush(stderr);
    drawn_ = true;
}

void TerminalProgress::erase() {
    if (!drawn_) return;
    std::fputs("\r\x1b[K", stderr);
    std::fflush(stderr);
    drawn_ = false;
}

}  // namespace naturel
