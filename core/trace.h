#pragma once
#include <atomic>
#include <chrono>
#include <string>
#include <string_view>

#include "core/thread_record.h"

namespace naturel {

/// Whether stages and blocks of work are written down, for a picture of which thread did what when.
class Trace {
public:
    /// Call from serial code, once.
    static void start();
    static bool is_on() { return on_.load(std::memory_order_relaxed); }

    /// Adds a stretch of serial code of the calling thread, if the trace is on.
    static void add(std::string_view name, TimeSpan time);

    /// Everything since start() in Chrome's trace format, which Perfetto opens: complete events in microseconds; a block
    /// of a loop bears the name of the stage in which it ran. Call from serial code.
    static std::string json();

private:
    friend class WorkBlock;
    static void add_block(ThreadRecord& record, TimeSpan time);
    static inline constinit std::atomic<bool> on_ = false;
};

/// A stretch of serial code with a name, as long as it lives.
class TraceSpan {
public:
    explicit TraceSpan(std::string_view name) : name_(name), begin_(std::chrono::steady_clock::now()) {}
    TraceSpan(const TraceSpan&) = delete;
    TraceSpan& operator=(const TraceSpan&) = delete;
    ~TraceSpan() { Trace::add(name_, {begin_, std::chrono::steady_clock::now()}); }

private:
    std::string_view name_;
    std::chrono::steady_clock::time_point begin_;
};

/// A block of a parallel loop, as long as it lives: counted for its thread, and part of a trace.
class WorkBlock {
public:
    WorkBlock() : record_(ThreadRecord::own()) {
        record_.count_block();
        if (Trace::is_on()) begin_ = std::chrono::steady_clock::now();
    }
    WorkBlock(const WorkBlock&) = delete;
    WorkBlock& operator=(const WorkBlock&) = delete;
    ~WorkBlock() {
        if (begin_ != std::chrono::steady_clock::time_point{}) Trace::add_block(record_, {begin_, std::chrono::steady_clock::now()});
    }

private:
    ThreadRecord& record_;
    std::chrono::steady_clock::time_point begin_{};
};

}  // namespace naturel
