#include "cli/shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include "core/errors.h"

namespace naturel {
namespace {

constexpr std::size_t most_shards = 100000;

std::optional<std::size_t> number_of(std::string_view text) {
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

std::optional<std::size_t> variable(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::nullopt : number_of(value);
}

}  // namespace

std::string Shard::name() const {
    return fmt::format("shard_{}_of_{}", number, count);
}

std::optional<Shard> shard_of_text(const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == std::string::npos) return std::nullopt;
    const auto number = number_of(text.substr(0, slash)), count = number_of(text.substr(slash + 1));
    if (!number || !count || *number < 1 || *number > *count || *count > most_shards) return std::nullopt;
    return Shard{*number, *count};
}

std::optional<Shard> shard_of_slurm() {
    const auto task = variable("SLURM_ARRAY_TASK_ID"), count = variable("SLURM_ARRAY_TASK_COUNT");
    if (!task || !count) return std::nullopt;
    const std::size_t first = variable("SLURM_ARRAY_TASK_MIN").value_or(1), step = std::max<std::size_t>(1, variable("SLURM_ARRAY_TASK_STEP").value_or(1));
    const Shard shard{(*task - first) / step + 1, *count};
    if (*task < first || (*task - first) % step != 0 || shard.number > shard.count)
        throw InputError("SLURM_ARRAY_TASK_ID", fmt::format("task {} of an array of {} that begins at {} and goes in steps of {} is no shard (give --shard)",
                                                            *task, *count, first, step));
    return shard;
}

}  // namespace naturel
