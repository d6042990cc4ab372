#pragma once
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <cstddef>

#include "core/errors.h"
#include "core/progress.h"
#include "core/trace.h"

namespace naturel {

/// Limits the threads of the whole process as long as it lives. The only one: make it in main().
class ThreadLimit {
public:
    explicit ThreadLimit(int threads)
        : control_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)) {}

private:
    tbb::global_control control_;
};

/// How many threads the process may use at a time.
inline int thread_limit() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

/// Calls work(i) for every i in [0, count). A call writes only what belongs to its i, so that results do not depend on
/// the number of threads; sums inside a call run in index order.
template <class Work>
void parallel_for(std::size_t count, std::size_t grain, const Work& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain), [&](const auto& range) {
        const WorkBlock block;
        for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
    });
}

/// The same as a stage of `progress`. Throws Interrupted (from serial code) when the user wants to stop.
template <class Work>
void parallel_stage(std::string_view stage, std::size_t count, std::size_t grain, Progress& progress,
                    const Work& work) {
    const TraceSpan span(stage);
    progress.begin(stage, count);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain), [&](const auto& range) {
        const WorkBlock block;
        for (std::size_t i = range.begin(); i != range.end() && !progress.interrupted(); ++i) work(i);
        progress.advance(range.size());
    });
    progress.end();
    if (progress.interrupted()) throw Interrupted();
}

/// Sum of term(i) for i in [0, count), with the same bits for any number of threads: the shape of the reduction tree
/// depends on count alone. T needs T{} and operator+.
template <class T, class Term>
T deterministic_sum(std::size_t count, const Term& term) {
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<std::size_t>(0, count, 256), T{},
        [&](const auto& range, T sum) {
            const WorkBlock block;
            for (std::size_t i = range.begin(); i != range.end(); ++i) sum = sum + term(i);
            return sum;
        },
        [](const T& a, const T& b) { return a + b; }, tbb::simple_partitioner());
}

/// Scratch memory of one thread. Never carries a result from one task to the next.
template <class T>
using ThreadScratch = tbb::enumerable_thread_specific<T>;

}  // namespace naturel
