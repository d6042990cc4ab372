#include "core/stage_clock.h"

#include <algorithm>
#include <ctime>
#include <thread>

#include "core/trace.h"
#include "tests/catch.h"

using namespace naturel;

namespace {

double cpu_of_this_thread_s() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void burn_cpu(double seconds) {
    const double end = cpu_of_this_thread_s() + seconds;
    while (cpu_of_this_thread_s() < end) {
    }
}

}  // namespace

TEST_CASE("a stage counts the threads that worked and their processor time", "[core][timing]") {
    constexpr double busy_s = 0.02;
    StageClock clock;
    std::thread idle([] {});  // does no block of work
    std::thread one([] {
        const WorkBlock block;
        burn_cpu(busy_s);
    });
    std::thread two([] {
        for (int k = 0; k < 2; ++k) {
            const WorkBlock block;
            burn_cpu(busy_s);
        }
    });
    idle.join();
    one.join();
    two.join();
    clock.end_stage("busy");
    burn_cpu(busy_s);
    clock.end_stage("alone");

    const StageTime& busy = clock.stages().at(0);
    CHECK(busy.stage == "busy");
    REQUIRE(busy.workers.size() == 3);  // and this thread, which waited
    // Threads that burn their time have at least so much; how much more depends on who looks at the clock when.
    const double most = std::max(busy.workers[1].cpu_s, busy.workers[2].cpu_s), least = std::min(busy.workers[1].cpu_s, busy.workers[2].cpu_s);
    CHECK(least >= busy_s);
    CHECK(most >= 2.0 * busy_s);
    CHECK(busy.cpu_s >= 3.0 * busy_s);
    CHECK(busy.cpu_s >= least + most);

    const StageTime& alone = clock.stages().at(1);
    REQUIRE(alone.workers.size() == 1);
    CHECK(alone.workers[0].cpu_s >= busy_s);
    CHECK(alone.wall_s >= busy_s);
    // Threads that have ended keep their account, and give nothing to later stages.
    CHECK(alone.workers[0].thread != busy.workers[2].thread);
}

TEST_CASE("stages follow each other without gaps", "[core][timing]") {
    const auto start = std::chrono::steady_clock::now();
    StageClock clock;
    burn_cpu(0.002);
    clock.end_stage("first");
    burn_cpu(0.002);
    StageClock later(clock.stages());
    burn_cpu(0.002);
    later.end_stage("second");
    const double all_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    REQUIRE(later.stages().size() == 2);
    CHECK(later.stages()[0].wall_s + later.stages()[1].wall_s <= all_s);
    clock.add_stages(later.stages());
    CHECK(clock.stages().size() == 3);
}
