#include "embree_backend/hit_counts.h"

#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinRel;

TEST_CASE("counts of a row are those of a plain list of hits", "[embree][analytic]") {
    // The second has more hits than 16-bit counters bear.
    const std::int64_t packets = GENERATE(std::int64_t{500}, std::int64_t{200'000});
    constexpr std::size_t patch_count = 1000;
    HitCounts counts;
    counts.reserve(patch_count);
    FormFactorRow row;
    for (unsigned round = 0; round < 2; ++round) {  // nothing of the first is left in the second
        INFO(packets << " packets, round " << round);
        std::minstd_rand random(round + 1);
        std::map<std::uint32_t, std::array<std::int64_t, 8>> hits;
        counts.expect(8);
        counts.add(HitCounts::counter_of(make_id<PatchId>(patch_count - 1)), 3);
        ++hits[patch_count - 1][3];
        for (std::int64_t n = 0; n < packets; ++n) {
            // Few patches get most of them, many get one or two.
            std::array<std::uint32_t, 8> counters{};
            for (std::uint32_t k = 0; k < 8; ++k) {
                const std::uint32_t patch = static_cast<std::uint32_t>(n % 4 == 0 ? random() % patch_count : 100 + random() % 3);
                counters[k] = HitCounts::counter_of(make_id<PatchId>(patch));
                ++hits[patch][k];
            }
            if (n % 100 == 0) counts.expect(8 * std::min<std::int64_t>(100, packets - n));
            counts.add_packet(counters.data());
        }
        const std::int64_t rays = 8 * packets + 1;
        std::map<int, std::pair<double, int>> octaves;
        const auto variance = [](const std::array<std::int64_t, 8>& h) {
            double mean = 0.0, sum = 0.0;
            for (const auto count : h) mean += static_cast<double>(count) / 8.0;
            for (const auto count : h) sum += (static_cast<double>(count) - mean) * (static_cast<double>(count) - mean);
            return 8.0 / 7.0 * sum;
        };
        const auto total = [](const std::array<std::int64_t, 8>& h) { return std::accumulate(h.begin(), h.end(), std::int64_t{0}); };
        for (const auto& [patch, h] : hits) {
            auto& [sum, members] = octaves[std::ilogb(static_cast<double>(total(h)))];
            sum += variance(h);
            ++members;
        }
        const double before = counts.estimate_error(rays);
        counts.move_to(row, rays);
        REQUIRE(row.patches.size() == hits.size());
        std::size_t p = 0;
        double worst_error = 0.0, squares = 0.0;
        bool same_patches = true, same_values = true;
        for (const auto& [patch, h] : hits) {
            const auto& [sum, members] = octaves[std::ilogb(static_cast<double>(total(h)))];
            const double error = 0.8 * std::sqrt(0.5 * (variance(h) + sum / members)) / static_cast<double>(rays);
            same_patches &= row.patches[p] == make_id<PatchId>(patch);
            same_values &= row.values[p] == 1.0 / static_cast<double>(rays) * static_cast<double>(total(h));
            worst_error = std::max(worst_error, std::abs(static_cast<double>(row.errors[p]) / error - 1.0));
            squares += error * error;
            ++p;
        }
        CHECK(same_patches);
        CHECK(same_values);
        CHECK(worst_error <= 1e-4);  // sums of up to a thousand floats
        CHECK_THAT(before, WithinRel(std::sqrt(squares), 1e-4));
    }
}
