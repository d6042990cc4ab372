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

    /// Call before so many rays are added, one after another or by add_packet().
    void expect(std::int64_t rays) {
        // Small counters stay in the nearest cache.
        if (counted_ + rays > std::int64_t{0xffff} * embree_sampling::sub_samples) make_room();
        counted_ += rays;
    }

    void add(std::uint32_t patch, std::uint32_t sub_sample) {
        ++hits_[patch * embree_sampling::sub_samples + sub_sample];
        touched_[touched_count_] = patch;  // kept if it is new
        touched_count_ += seen_[patch] == 0;
        seen_[patch] = 1;
    }

    /// One patch for each sub-sample. patches: [8].
    void add_packet(const std::uint32_t* patches) {
        std::uint16_t* const hits = hits_.data();
        std::uint8_t* const seen = seen_.data();
        std::uint32_t* const touched = touched_.data();
        std::size_t count = touched_count_;
        for (std::uint32_t k = 0; k < embree_sampling::sub_samples; ++k) {
            const std::size_t patch = patches[k];
            ++hits[patch * embree_sampling::sub_samples + k];
            touched[count] = static_cast<std::uint32_t>(patch);
            count += seen[patch] ^ 1u;
            seen[patch] = 1;
        }
        touched_count_ = count;
    }

    /// Root of the sum of the squares of the estimated errors, were the row to be made of the hits so far.
    double estimate_error(std::int64_t rays);

    /// Appends the patches in order, each with hits / rays and its estimated error, one standard error.
    void move_to(FormFactorRow& row, std::int64_t rays);

private:
    void make_room();
    void estimate_variances();

    std::vector<std::uint16_t> hits_;      ///< [patch x sub_samples]
    std::int64_t counted_ = 0;             ///< rays in hits_, at most
    std::vector<std::uint32_t> moved_;     ///< [patch x sub_samples] hits that had to make room; empty while there are none
    std::vector<std::uint8_t> seen_;       ///< [patch] 0 or 1
    std::vector<std::uint32_t> touched_;   ///< the patches seen, in no order
    std::size_t touched_count_ = 0;
    std::vector<std::uint64_t> ordered_;   ///< one bit per patch: read in order, no sorting
    std::vector<float> total_, variance_;  ///< [touched]
};

}  // namespace naturel
