#include "cli/job_shards.h"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string_view>
#include <tuple>

namespace naturel {

std::vector<std::size_t> jobs_of_shard(const StudyJobs& jobs, const std::vector<GroupCost>& costs, const Shard& shard) {
    std::vector<std::size_t> row;
    std::set<std::string_view> keys;  // of jobs that are equal, one is computed
    for (std::size_t number = 0; number < jobs.jobs.size(); ++number)
        if (keys.insert(jobs.jobs[number].key).second) row.push_back(number);
    std::ranges::stable_sort(row, {}, [&](std::size_t number) {
        const StudyJob& job = jobs.jobs[number];
        return std::tuple(!job.invalid.empty(), job.row_set, job.group, job.set);
    });
    // In whole microseconds: every machine must come to the same cuts. The sum over a study stays below 2^64.
    const auto in_microseconds = [](double seconds) { return static_cast<std::uint64_t>(std::min(1e6 * seconds, 1e12)) + 1; };
    std::vector<std::uint64_t> begins;  // [row] cost of all before
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < row.size(); ++k) {
        const StudyJob& job = jobs.jobs[row[k]];
        const StudyJob* before = k > 0 ? &jobs.jobs[row[k - 1]] : nullptr;
        begins.push_back(sum);
        if (!job.invalid.empty()) continue;
        const GroupCost& cost = costs[job.group];
        sum += in_microseconds(cost.job_seconds);
        if (before == nullptr || before->row_set != job.row_set) sum += in_microseconds(cost.form_factor_seconds);
        if (before == nullptr || before->group != job.group) sum += in_microseconds(cost.first_seconds);
        if (before == nullptr || before->set != job.set) sum += in_microseconds(cost.set_seconds);
    }
    const auto cut = [&](std::size_t number) {
        if (number == shard.count) return row.end();
        const std::uint64_t aim = sum / shard.count * number + sum % shard.count * number / shard.count;
        return row.begin() + (std::ranges::lower_bound(begins, aim) - begins.begin());
    };
    return {cut(shard.number - 1), cut(shard.number)};
}

}  // namespace naturel
