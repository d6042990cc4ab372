#include "embree_backend/hit_counts.h"

#include <array>
#include <bit>
#include <cmath>

#include "embree_backend/wide.h"

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
    for (std::size_t p = 0; p < touched_count_; ++p)
        for (std::size_t k = std::size_t{touched_[p]} * n; k < (std::size_t{touched_[p]} + 1) * n; ++k) {
            moved_[k] += hits_[k];
            hits_[k] = 0;
        }
    counted_ = 0;
}

void HitCounts::estimate_variances() {
    total_.resize(touched_count_);
    variance_.resize(touched_count_);
    if (moved_.empty()) {
        variances_of_few(touched_.data(), touched_count_, hits_.data(), total_.data(), variance_.data());
    } else {
        make_room();
        variances(touched_.data(), touched_count_, moved_.data(), total_.data(), variance_.data());
    }
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
    for (std::size_t p = 0; p < touched_count_; ++p) ordered_[touched_[p] / 64] |= std::uint64_t{1} << (touched_[p] % 64);
    std::size_t next = 0;
    for (std::size_t word = 0; word < ordered_.size(); ++word) {
        for (std::uint64_t bits = ordered_[word]; bits != 0; bits &= bits - 1)
            touched_[next++] = static_cast<std::uint32_t>(64 * word + static_cast<std::size_t>(std::countr_zero(bits)));
        ordered_[word] = 0;
    }
    estimate_variances();
    const double weight = 1.0 / static_cast<double>(rays);
    row.patches.resize(touched_count_);
    row.values.resize(touched_count_);
    row.errors.resize(touched_count_);
    for (std::size_t p = 0; p < touched_count_; ++p) {
        row.patches[p] = make_id<PatchId>(touched_[p]);
        std::uint64_t hits = 0;
        for (std::size_t k = std::size_t{touched_[p]} * n; k < (std::size_t{touched_[p]} + 1) * n; ++k) {
            hits += hits_[k] + (moved_.empty() ? 0u : moved_[k]);
            hits_[k] = 0;
        }
        row.values[p] = weight * static_cast<double>(hits);
        row.errors[p] = static_cast<float>(weight) * std::sqrt(variance_[p]);
        seen_[touched_[p]] = 0;
    }
    touched_count_ = 0;
    counted_ = 0;
    moved_ = {};
}

}  // namespace naturel
