#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/ids.h"
#include "core/visibility.h"
#include "embree_backend/sampling.h"

namespace naturel {

/// How often the rays of a row met each patch, by sub-sample. Empty between two rows; its memory is used again.
class HitCounts {
public:
    /// Of a building with so many patches.
    void reserve(std::size_t patch_count) {
        const std::size_t blocks = (patch_count + patches_per_block - 1) / patches_per_block;
        if (block_seen_.size() >= blocks) return;
        hits_.resize(blocks * counters_per_block);
        block_seen_.resize(blocks);
    }

    /// The first of the counters of a patch: those of a sub-sample and eight neighbouring patches lie side by side.
    static constexpr std::uint32_t counter_of(PatchId patch) {
        const auto p = static_cast<std::uint32_t>(patch);
        return p / group * (group * embree_sampling::sub_samples) + p % group;
    }

    /// Call before so many rays are added, one after another or by add_packet().
    void expect(std::int64_t rays) {
        // Small counters stay in the nearest cache.
        if (counted_ + rays > std::int64_t{0xffff} * embree_sampling::sub_samples) make_room();
        counted_ += rays;
        // To look into every block costs less than to note for every ray where it met something.
        constexpr std::int64_t many = 32;
        if (!all_seen_ && rays >= many * static_cast<std::int64_t>(block_seen_.size())) {
            std::ranges::fill(block_seen_, std::uint8_t{1});
            all_seen_ = true;
        }
    }

    /// A hit of a sub-sample on the patch that has a counter.
    void add(std::uint32_t counter, std::uint32_t sub_sample) {
        ++hits_[counter + sub_sample * group];
        block_seen_[counter / counters_per_block] = 1;
    }

    /// One patch for each sub-sample. counters: [8].
    void add_packet(const std::uint32_t* counters) {
        std::uint16_t* const hits = hits_.data();
#pragma GCC unroll 8
        for (std::uint32_t k = 0; k < embree_sampling::sub_samples; ++k) ++hits[counters[k] + k * group];
        if (all_seen_) return;
        std::uint8_t* const seen = block_seen_.data();
#pragma GCC unroll 8
        for (std::uint32_t k = 0; k < embree_sampling::sub_samples; ++k) seen[counters[k] / counters_per_block] = 1;
    }

    /// Root of the sum of the squares of the estimated errors, were the row to be made of the hits so far.
    double estimate_error(std::int64_t rays);

    /// Appends the patches in order, each with hits / rays and its estimated error, one standard error.
    void move_to(FormFactorRow& row, std::int64_t rays);

private:
    static constexpr std::uint32_t group = 8;  ///< patches whose counters are mixed
    static constexpr std::uint32_t patches_per_block = 32;
    static constexpr std::uint32_t counters_per_block = patches_per_block * embree_sampling::sub_samples;

    void make_room();
    void list_touched();
    void estimate_variances();

    std::vector<std::uint16_t> hits_;       ///< [group of patches][sub_sample][patch of the group]
    std::int64_t counted_ = 0;              ///< rays in hits_, at most
    std::vector<std::uint32_t> moved_;      ///< likewise, hits that had to make room; empty while there are none
    std::vector<std::uint8_t> block_seen_;  ///< whether any of so many neighbouring patches was met
    bool all_seen_ = false;                 ///< every block counts as met
    std::size_t touched_count_ = 0;
    std::vector<std::uint32_t> touched_;    ///< [touched_count_ and some room] patches met, increasing
    std::vector<float> total_, variance_;   ///< likewise
};

}  // namespace naturel
