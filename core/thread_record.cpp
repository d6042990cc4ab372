#include "core/thread_record.h"

#include <pthread.h>

#include <deque>
#include <mutex>
#include <stdexcept>

namespace naturel {
namespace {

double seconds_of(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Registry {
    std::mutex access;
    std::deque<ThreadRecord> records;  // whose places do not change
};

/// Never destroyed: threads of TBB may end after static objects have gone.
Registry& registry() {
    static auto& all = *new Registry;
    return all;
}

}  // namespace

/// Keeps the last reading: the clock of a thread ends with it.
void ThreadRecord::end(void* own) {
    auto& record = *static_cast<ThreadRecord*>(own);
    const std::lock_guard lock(registry().access);
    record.cpu_at_end_s_ = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    record.ended_ = true;
}

ThreadRecord& ThreadRecord::make_own() {
    {
        const std::lock_guard lock(registry().access);
        own_ = &registry().records.emplace_back();
        pthread_getcpuclockid(pthread_self(), &own_->clock_);
    }
    // Not a thread_local object: its destructor is registered under the lock of the loader, and libraries may just be loading.
    static const pthread_key_t key = [] {
        pthread_key_t made{};
        if (pthread_key_create(&made, end) != 0) throw std::runtime_error("no key for what threads leave behind");
        return made;
    }();
    pthread_setspecific(key, own_);
    return *own_;
}

std::vector<ThreadRecord*> ThreadRecord::order() {
    const std::lock_guard lock(registry().access);
    std::vector<ThreadRecord*> all;
    for (ThreadRecord& record : registry().records) all.push_back(&record);
    return all;
}

double ThreadRecord::cpu_s() const {
    const std::lock_guard lock(registry().access);
    return ended_ ? cpu_at_end_s_ : seconds_of(clock_);
}

}  // namespace naturel
