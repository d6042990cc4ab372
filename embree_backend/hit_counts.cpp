#include "embree_backend/hit_counts.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/wide.h"

namespace naturel {
namespace {

constexpr std::uint32_t n = embree_sampling::sub_samples;

/// The whole is better stratified than its parts: its error is that of so many independent ones times this. (docs/embree.md)
constexpr float gain_of_the_whole = 0.80f;

/// A variance from eight sub-samples has seven degrees of freedom; the mean variance of patches with about as many hits
/// counts like so many more.
constexpr float pooled_freedom = 7.0f;

/// Hits and their variance among the sub-samples, of the sum of all, for each of the patches.
template <class Count>
inline __attribute__((always_inline)) void variances(const std::uint32_t* patches, std::size_t count, const Count* hits,
                                                     float* total, float* variance) {
    for (std::size_t p = 0; p < count; ++p) {
        const Count* const own = hits + std::size_t{patches[p]} * n;
        float h[n], square[n];
        for (std::uint32_t k = 0; k < n; ++k) h[k] = static_cast<float>(static_cast<std::int32_t>(own[k]));
        // In pairs: the same sums whatever the width of the registers.
        const float sum = ((h[0] + h[4]) + (h[2] + h[6])) + ((h[1] + h[5]) + (h[3] + h[7]));
        const float mean = sum * (1.0f / n);
        for (std::uint32_t k = 0; k < n; ++k) square[k] = (h[k] - mean) * (h[k] - mean);
        const float squares = ((square[0] + square[4]) + (square[2] + square[6])) + ((square[1] + square[5]) + (square[3] + square[7]));
        total[p] = sum;
        variance[p] = squares * (static_cast<float>(n) / (n - 1));
    }
}

NATUREL_WIDE void variances_of_few(const std::uint32_t* patches, std::size_t count, const std::uint16_t* hits, float* total,
                                   float* variance) {
    variances(patches, count, hits, total, variance);
}

}  // namespace

void HitCounts::make_room() {
    moved_.resize(hits_.size());
    for (std::size_t block = 0; block < block_seen_.size(); ++block)
        if (block_seen_[block] != 0)
            for (std::size_t k = block * patches_per_block * n; k < (block + 1) * patches_per_block * n; ++k) {
                moved_[k] += hits_[k];
                hits_[k] = 0;
            }
    counted_ = 0;
}

/// Looks into the blocks that were met: fewer steps than to note each patch when it is met first.
void HitCounts::list_touched() {
    touched_.clear();
    const auto met = [&](std::size_t patch) {
        std::uint64_t parts[2];
        static_assert(sizeof(parts) == n * sizeof(hits_[0]));
        std::memcpy(parts, hits_.data() + patch * n, sizeof(parts));
        return (parts[0] | parts[1]) != 0;
    };
    const auto met_before = [&](std::size_t patch) {
        return std::any_of(moved_.data() + patch * n, moved_.data() + (patch + 1) * n, [](std::uint32_t hits) { return hits != 0; });
    };
    for (std::size_t block = 0; block < block_seen_.size(); ++block)
        if (block_seen_[block] != 0)
            for (std::size_t patch = block * patches_per_block; patch < (block + 1) * patches_per_block; ++patch)
                if (met(patch) || (!moved_.empty() && met_before(patch))) touched_.push_back(static_cast<std::uint32_t>(patch));
}

void HitCounts::estimate_variances() {
    list_touched();
    total_.resize(touched_.size());
    variance_.resize(touched_.size());
    if (moved_.empty()) {
        variances_of_few(touched_.data(), touched_.size(), hits_.data(), total_.data(), variance_.data());
    } else {
        make_room();
        variances(touched_.data(), touched_.size(), moved_.data(), total_.data(), variance_.data());
    }
    // By octaves of hits.
    const auto octave = [](float hits) { return std::bit_cast<std::uint32_t>(hits) >> 23 & 0xffu; };
    std::array<float, 256> sum{}, mean{};
    std::array<std::uint32_t, 256> members{};
    for (std::size_t p = 0; p < touched_.size(); ++p) {
        sum[octave(total_[p])] += variance_[p];
        ++members[octave(total_[p])];
    }
    for (std::size_t k = 0; k < mean.size(); ++k)
        if (members[k] != 0) mean[k] = sum[k] / static_cast<float>(members[k]);
    constexpr float gain = gain_of_the_whole * gain_of_the_whole;
    for (std::size_t p = 0; p < touched_.size(); ++p)
        variance_[p] = gain * ((n - 1) * variance_[p] + pooled_freedom * mean[octave(total_[p])]) / (n - 1 + pooled_freedom);
}

double HitCounts::estimate_error(std::int64_t rays) {
    estimate_variances();
    double sum = 0.0;
    for (std::size_t p = 0; p < touched_.size(); ++p) sum += variance_[p];
    return std::sqrt(sum) / static_cast<double>(rays);
}

void HitCounts::move_to(FormFactorRow& row, std::int64_t rays) {
    estimate_variances();
    const double weight = 1.0 / static_cast<double>(rays);
    row.patches.resize(touched_.size());
    row.values.resize(touched_.size());
    row.errors.resize(touched_.size());
    for (std::size_t p = 0; p < touched_.size(); ++p) {
        row.patches[p] = make_id<PatchId>(touched_[p]);
        std::uint64_t hits = 0;
        for (std::size_t k = std::size_t{touched_[p]} * n; k < (std::size_t{touched_[p]} + 1) * n; ++k) {
            hits += hits_[k] + (moved_.empty() ? 0u : moved_[k]);
            hits_[k] = 0;
        }
        row.values[p] = weight * static_cast<double>(hits);
        row.errors[p] = static_cast<float>(weight) * std::sqrt(variance_[p]);
        block_seen_[touched_[p] / patches_per_block] = 0;
    }
    counted_ = 0;
    moved_ = {};
}

}  // namespace naturel
