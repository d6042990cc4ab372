#pragma once
#include <cstddef>
#include <optional>
#include <string>

namespace naturel {

/// One of several processes that share a study.
struct Shard {
    std::size_t number = 1, count = 1;  ///< number from 1

    std::string name() const;  ///< "shard_2_of_4"
};

/// "2/4"; empty if the text is none.
std::optional<Shard> shard_of_text(const std::string& text);

/// From the variables of a job array of Slurm; empty outside of one. Throws InputError if they make no sense.
std::optional<Shard> shard_of_slurm();

}  // namespace naturel
