#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

namespace naturel {

/// A stretch of time on one thread.
struct TimeSpan {
    std::chrono::steady_clock::time_point begin, end;
};
struct NamedSpan {
    std::string name;
    TimeSpan time;
};

/// What a thread has done since it first worked. One per thread, made at its first call of own() and kept when the thread
/// ends. The number of a record is its place in order(), 0 for the first thread.
class ThreadRecord {
public:
    static ThreadRecord& own() { return own_ != nullptr ? *own_ : make_own(); }

    /// Of every thread so far, in the order in which they appeared.
    static std::vector<ThreadRecord*> order();

    void count_block() { blocks_.store(blocks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed); }
    /// Blocks of parallel loops.
    std::uint64_t blocks() const { return blocks_.load(std::memory_order_relaxed); }

    /// Processor time of the thread, from any thread.
    double cpu_s() const;

    // What a trace is made of. Written by the thread itself while a trace is on; read when no loop is at work.
    std::vector<TimeSpan> block_spans;
    std::vector<NamedSpan> named_spans;
    std::uint64_t blocks_left_out = 0;

private:
    static ThreadRecord& make_own();
    static void end(void* own);

    static inline thread_local constinit ThreadRecord* own_ = nullptr;
    std::atomic<std::uint64_t> blocks_ = 0;
    clockid_t clock_{};
    bool ended_ = false;
    double cpu_at_end_s_ = 0.0;
};

}  // namespace naturel
