#include "embree_backend/hit_counts.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/wide.h"

namespace naturel {
namespace {

constexpr std::uint32_t n = embree_sampling::sub_samples;

/// The whole is better stratified than its parts: its error is that of so many independent ones times this. (docs/embree.md)
constexpr float gain_of_the_whole = 0.80f;

/// A variance from eight sub-samples has seven degrees of freedom; the mean variance of patches with about as many hits
/// counts like so many more.
constexpr float pooled_freedom = 7.0f;

/// Appends the patches of a block that were met, with their hits and the variance of these among the sub-samples, of the sum of
/// all. Writes up to a group more than it appends. Returns how many there are now.
template <std::uint32_t group, class Count>
inline __attribute__((always_inline)) std::size_t list_block(std::uint32_t first_patch, std::uint32_t patches, const Count* hits,
                                                             std::size_t count, std::uint32_t* touched, float* total, float* variance) {
    for (std::uint32_t first = 0; first < patches; first += group) {
        const Count* const own = hits + first * n;
        float h[n][group], sums[group], squares[group];
        for (std::uint32_t k = 0; k < n; ++k)
            for (std::uint32_t p = 0; p < group; ++p) h[k][p] = static_cast<float>(static_cast<std::int32_t>(own[k * group + p]));
        for (std::uint32_t p = 0; p < group; ++p) {
            const float sum = ((h[0][p] + h[4][p]) + (h[2][p] + h[6][p])) + ((h[1][p] + h[5][p]) + (h[3][p] + h[7][p]));
            const float mean = sum * (1.0f / n);
            const auto square = [&](std::uint32_t k) { return (h[k][p] - mean) * (h[k][p] - mean); };
            sums[p] = sum;
            squares[p] = (((square(0) + square(4)) + (square(2) + square(6))) + ((square(1) + square(5)) + (square(3) + square(7)))) *
                         (static_cast<float>(n) / (n - 1));
        }
        for (std::uint32_t p = 0; p < group; ++p) {
            touched[count] = first_patch + first + p;
            total[count] = sums[p];
            variance[count] = squares[p];
            count += sums[p] > 0.0f ? 1u : 0u;
        }
    }
    return count;
}

NATUREL_WIDE std::size_t list_block_of_few(std::uint32_t first_patch, std::uint32_t patches, const std::uint16_t* hits, std::size_t count,
                                           std::uint32_t* touched, float* total, float* variance) {
    return list_block<8>(first_patch, patches, hits, count, touched, total, variance);
}

NATUREL_WIDE void values_of(const float* total, const float* variance, std::size_t count, double weight, double* value, float* error) {
    for (std::size_t p = 0; p < count; ++p) value[p] = weight * static_cast<double>(total[p]);
    for (std::size_t p = 0; p < count; ++p) error[p] = static_cast<float>(weight) * std::sqrt(variance[p]);
}

}  // namespace

void HitCounts::make_room() {
    moved_.resize(hits_.size());
    for (std::size_t block = 0; block < block_seen_.size(); ++block)
        if (block_seen_[block] != 0)
            for (std::size_t k = block * counters_per_block; k < (block + 1) * counters_per_block; ++k) {
                moved_[k] += hits_[k];
                hits_[k] = 0;
            }
    counted_ = 0;
}

/// Looks into the blocks that were met: fewer steps than to note each patch when it is met first.
void HitCounts::list_touched() {
    if (!moved_.empty()) make_room();
    std::size_t count = 0;
    for (std::uint32_t block = 0; block < block_seen_.size(); ++block) {
        if (block_seen_[block] == 0) continue;
        if (touched_.size() < count + patches_per_block + group) {
            const std::size_t room = 2 * count + patches_per_block + group;
            touched_.resize(room);
            total_.resize(room);
            variance_.resize(room);
        }
        const std::size_t first = std::size_t{block} * counters_per_block;
        if (moved_.empty())
            count = list_block_of_few(block * patches_per_block, patches_per_block, hits_.data() + first, count, touched_.data(),
                                      total_.data(), variance_.data());
        else
            count = list_block<group>(block * patches_per_block, patches_per_block, moved_.data() + first, count, touched_.data(),
                                      total_.data(), variance_.data());
    }
    touched_count_ = count;
}

void HitCounts::estimate_variances() {
    list_touched();
    // By octaves of hits.
    const auto octave = [](float hits) { return std::bit_cast<std::uint32_t>(hits) >> 23 & 0xffu; };
    std::array<float, 256> sum{}, mean{};
    std::array<std::uint32_t, 256> members{};
    for (std::size_t p = 0; p < touched_count_; ++p) {
        sum[octave(total_[p])] += variance_[p];
        ++members[octave(total_[p])];
    }
    for (std::size_t k = 0; k < mean.size(); ++k)
        if (members[k] != 0) mean[k] = sum[k] / static_cast<float>(members[k]);
    constexpr float gain = gain_of_the_whole * gain_of_the_whole;
    for (std::size_t p = 0; p < touched_count_; ++p)
        variance_[p] = gain * ((n - 1) * variance_[p] + pooled_freedom * mean[octave(total_[p])]) / (n - 1 + pooled_freedom);
}

double HitCounts::estimate_error(std::int64_t rays) {
    estimate_variances();
    double sum = 0.0;
    for (std::size_t p = 0; p < touched_count_; ++p) sum += variance_[p];
    return std::sqrt(sum) / static_cast<double>(rays);
}

void HitCounts::move_to(FormFactorRow& row, std::int64_t rays) {
    estimate_variances();
    const double weight = 1.0 / static_cast<double>(rays);
    row.patches.resize(touched_count_);
    row.values.resize(touched_count_);
    row.errors.resize(touched_count_);
    for (std::size_t p = 0; p < touched_count_; ++p) row.patches[p] = make_id<PatchId>(touched_[p]);
    values_of(total_.data(), variance_.data(), touched_count_, weight, row.values.data(), row.errors.data());
    // Floats are exact up to 2^24.
    for (std::size_t p = 0; p < touched_count_ && !moved_.empty(); ++p) {
        std::uint64_t hits = 0;
        for (std::uint32_t k = 0; k < n; ++k) hits += moved_[counter_of(row.patches[p]) + k * group];
        row.values[p] = weight * static_cast<double>(hits);
    }
    for (std::size_t block = 0; block < block_seen_.size(); ++block)
        if (block_seen_[block] != 0) {
            std::fill_n(hits_.begin() + static_cast<std::ptrdiff_t>(block * counters_per_block), counters_per_block, std::uint16_t{0});
            block_seen_[block] = 0;
        }
    counted_ = 0;
    all_seen_ = false;
    moved_ = {};
}

}  // namespace naturel
