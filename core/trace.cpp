#include "core/trace.h"

#include <fmt/format.h>

#include <algorithm>

namespace naturel {
namespace {

using Clock = std::chrono::steady_clock;

/// Browsers open traces of some hundred megabytes; an event is about 90 bytes.
constexpr std::size_t most_blocks_per_thread = 1'000'000;

Clock::time_point trace_start;

/// Whole nanoseconds as microseconds, so that spans that nest still do in the text.
std::string microseconds(Clock::duration duration) {
    const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
    return fmt::format("{}.{:03}", ns / 1000, ns % 1000);
}

struct Event {
    std::string_view name;
    const char* kind;
    TimeSpan time;
};

/// Those that begin first come first, and of those that begin together the outer one.
bool comes_before(const Event& a, const Event& b) {
    return a.time.begin != b.time.begin ? a.time.begin < b.time.begin : a.time.end > b.time.end;
}

/// The innermost of the stages, in order, in which a moment lies.
std::string_view stage_at(const std::vector<Event>& stages, Clock::time_point moment) {
    auto after = std::ranges::upper_bound(stages, moment, {}, [](const Event& stage) { return stage.time.begin; });
    while (after != stages.begin())
        if ((--after)->time.end >= moment) return after->name;
    return "work";
}

}  // namespace

void Trace::start() {
    trace_start = Clock::now();
    on_ = true;
}

void Trace::add(std::string_view name, TimeSpan time) {
    if (!is_on()) return;
    time.begin = std::max(time.begin, trace_start);
    ThreadRecord::own().named_spans.push_back({std::string(name), time});
}

void Trace::add_block(ThreadRecord& record, TimeSpan time) {
    if (record.block_spans.size() < most_blocks_per_thread)
        record.block_spans.push_back(time);
    else
        ++record.blocks_left_out;
}

std::string Trace::json() {
    const std::vector<ThreadRecord*> threads = ThreadRecord::order();
    std::vector<Event> stages;
    for (const ThreadRecord* thread : threads)
        for (const NamedSpan& span : thread->named_spans) stages.push_back({span.name, "stage", span.time});
    std::ranges::stable_sort(stages, comes_before);

    std::string text = "{\"traceEvents\":[\n"
                       R"({"name":"process_name","ph":"M","pid":1,"tid":0,"args":{"name":"naturel"}})";
    std::uint64_t left_out = 0;
    for (std::size_t t = 0; t < threads.size(); ++t) {
        text += fmt::format(",\n{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{},\"args\":{{\"name\":\"thread {}\"}}}}", t, t);
        std::vector<Event> events;
        for (const NamedSpan& span : threads[t]->named_spans) events.push_back({span.name, "stage", span.time});
        for (const TimeSpan& span : threads[t]->block_spans) events.push_back({stage_at(stages, span.begin), "block", span});
        std::ranges::stable_sort(events, comes_before);
        for (const Event& event : events)
            text += fmt::format(",\n{{\"name\":\"{}\",\"cat\":\"{}\",\"ph\":\"X\",\"pid\":1,\"tid\":{},\"ts\":{},\"dur\":{}}}", event.name,
                                event.kind, t, microseconds(event.time.begin - trace_start), microseconds(event.time.end - event.time.begin));
        left_out += threads[t]->blocks_left_out;
    }
    return text + fmt::format("\n],\"displayTimeUnit\":\"ms\",\"otherData\":{{\"blocks_left_out\":\"{}\"}}}}\n", left_out);
}

}  // namespace naturel
