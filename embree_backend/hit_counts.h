#pragma once
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
        if (seen_.size() >= patch_count) return;
        hits_.resize(patch_count * embree_sampling::sub_samples);
        seen_.resize(patch_count);
        touched_.resize(patch_count + 1);
        ordered_.resize((patch_count + 63) / 64);
    }

    void add(std::uint32_t patch, std::uint32_t sub_sample) {
        ++hits_[patch * embree_sampling::sub_samples + sub_sample];
        touched_[touched_count_] = patch;  // kept if it is new
        touched_count_ += seen_[patch] == 0;
        seen_[patch] = 1;
    }

    /// Root of the sum of the squares of the estimated errors, were the row to be made of the hits so far.
    double estimate_error(std::int64_t rays);

    /// Appends the patches in order, each with hits / rays and its estimated error, one standard error.
    void move_to(FormFactorRow& row, std::int64_t rays);

private:
    void estimate_variances();

    std::vector<std::uint32_t> hits_;         ///< [patch x sub_samples]
    std::vector<std::uint8_t> seen_;          ///< [patch]
    std::vector<std::uint32_t> touched_;      ///< the patches seen, in no order
    std::size_t touched_count_ = 0;
    std::vector<std::uint64_t> ordered_;      ///< one bit per patch: read in order, no sorting
    std::vector<float> total_, variance_;     ///< [touched]
};

}  // namespace naturel
