#include "core/stage_clock.h"

#include <ctime>

#include "core/trace.h"

namespace naturel {

StageClock::Moment StageClock::now() {
    timespec cpu{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
    Moment moment{.time = std::chrono::steady_clock::now(),
                  .cpu_s = static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec),
                  .blocks = {},
                  .thread_cpu_s = {}};
    ThreadRecord::own();
    for (const ThreadRecord* thread : ThreadRecord::order()) {
        moment.blocks.push_back(thread->blocks());
        moment.thread_cpu_s.push_back(thread->cpu_s());
    }
    return moment;
}

void StageClock::end_stage(std::string stage) {
    Moment end = now();
    Trace::add(stage, {start_.time, end.time});
    StageTime taken{.stage = std::move(stage),
                    .wall_s = std::chrono::duration<double>(end.time - start_.time).count(),
                    .cpu_s = end.cpu_s - start_.cpu_s};
    const ThreadRecord* const own = &ThreadRecord::own();
    const std::vector<ThreadRecord*> threads = ThreadRecord::order();
    for (std::size_t t = 0; t < end.blocks.size(); ++t) {
        const bool is_new = t >= start_.blocks.size();
        const std::uint64_t blocks = end.blocks[t] - (is_new ? 0 : start_.blocks[t]);
        if (blocks > 0 || threads[t] == own)
            taken.workers.push_back({t, end.thread_cpu_s[t] - (is_new ? 0.0 : start_.thread_cpu_s[t])});
    }
    stages_.push_back(std::move(taken));
    start_ = std::move(end);
}

void StageClock::add_stages(const std::vector<StageTime>& stages) {
    stages_.insert(stages_.end(), stages.begin(), stages.end());
    start_ = now();
}

}  // namespace naturel
