// How far pairwise form factors are from integration after exact clipping, and whether their error estimates cover that.
// Usage: pairwise_error_study FIRST_SEED SCENES [TOLERANCE]    prints a table in Markdown; docs/embree.md shows it.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <random>

#include "core/building.h"
#include "core/patch_grid.h"
#include "embree_backend/pairwise.h"
#include "tests/reference/occluded_form_factor.h"
#include "tests/reference/occluded_pairs.h"

namespace naturel::tests {
namespace {

/// What was found for one partly visible pair.
struct Sample {
    double truth = 0.0, unoccluded = 0.0;  ///< of the larger one of F_ij and F_ji
    double error = 0.0, estimate = 0.0;
};

class Study {
public:
    explicit Study(double tolerance) : tolerance_(tolerance) {}

    /// Up to `pairs` random pairs of a scene.
    void look_at(const Scene& scene, double spacing_m, std::size_t pairs, std::uint64_t seed) {
        const Building building = assemble(scene);
        const PatchGrid grid = make_patch_grid(building, {.spacing_m = spacing_m});
        const auto occluders = facet_polygons(building);
        NoProgress quiet;
        const FormFactorRows rows = PairwiseExchange(building, grid, {.tolerance = tolerance_}).rows(true, quiet);
        const std::size_t n = grid.gather_patch_count;
        std::mt19937_64 random(seed);
        for (std::size_t k = 0; k < pairs; ++k) {
            std::size_t i = n == 2 ? 0 : random() % n, j = n == 2 ? 1 : random() % n;
            if (grid.patches[i].face == grid.patches[j].face) continue;
            if (grid.patches[i].area_m2 > grid.patches[j].area_m2) std::swap(i, j);
            const auto f = reference::occluded_form_factor(grid.polygon_of(make_id<PatchId>(i)), grid.polygon_of(make_id<PatchId>(j)),
                                                           occluders, reference_tolerance);
            Sample s{.truth = f.value, .unoccluded = f.unoccluded};
            double value = 0.0;
            for (auto e = rows.row_begin[i]; e < rows.row_begin[i + 1]; ++e)
                if (rows.column[e] == j) value = rows.value[e], s.estimate = static_cast<double>(rows.error[e]);
            s.error = value - f.value;
            if (f.unoccluded == 0.0 && value == 0.0) continue;
            if (f.value < 1e-9 || f.unoccluded - f.value < 1e-9) {
                // Seen whole or not at all: a verdict that must not be missed.
                worst_certain_ = std::max(worst_certain_, std::abs(s.error));
                ++certain_;
            } else {
                samples_.push_back(s);
            }
        }
    }

    void print(const char* name) const {
        if (samples_.empty()) return;
        double squares = 0.0, mean = 0.0, worst = 0.0;
        std::size_t covered = 0;
        std::vector<double> ratios, estimates;
        for (const Sample& s : samples_) {
            squares += s.error * s.error, mean += s.error, worst = std::max(worst, std::abs(s.error));
            // The reference has an error, too.
            covered += std::abs(s.error) <= s.estimate + 2 * reference_tolerance;
            ratios.push_back(std::abs(s.error) / std::max(s.estimate, reference_tolerance));
            estimates.push_back(s.estimate);
        }
        std::ranges::sort(ratios);
        std::ranges::sort(estimates);
        const double n = static_cast<double>(samples_.size());
        const auto at = [&](const std::vector<double>& v, double share) { return v[static_cast<std::size_t>(share * (n - 1))]; };
        fmt::print("| {} | {:g} | {} | {:.2g} | {:+.1g} | {:.2g} | {:.2g} | {:.2g} | {:.2f} / {:.2f} / {:.2f} | {:.2f} % | {} | {:.1g} |\n", name, tolerance_, samples_.size(),
                   std::sqrt(squares / n), mean / n, worst, at(estimates, 0.5), at(estimates, 1.0), at(ratios, 0.5), at(ratios, 0.99), at(ratios, 1.0),
                   100.0 * static_cast<double>(covered) / n, certain_, worst_certain_);
        std::fflush(stdout);
    }

private:
    static constexpr double reference_tolerance = 1e-6;
    double tolerance_;
    std::vector<Sample> samples_;
    double worst_certain_ = 0.0;
    std::size_t certain_ = 0;
};

}  // namespace
}  // namespace naturel::tests

int main(int argc, char** argv) {
    using namespace naturel::tests;
    const auto number = [&](int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; };
    const auto first = static_cast<std::uint64_t>(number(1, 1));
    const auto scenes = static_cast<std::uint64_t>(number(2, 40));
    const double tolerance = number(3, 1e-4);
    fmt::print("| scenes | tolerance | partly visible pairs | RMS error | mean | worst | median estimate | largest | error / estimate: 50 %, 99 %, worst | covered | other pairs | their worst |\n");
    fmt::print("|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    Study pairs(tolerance), rooms(tolerance), boxes(tolerance), solids(tolerance);
    for (std::uint64_t seed = first; seed < first + scenes; ++seed)
        rooms.look_at(random_furnished_room(seed), seed % 2 == 0 ? 0.5 : 1.0, 40, seed);
    rooms.print("furnished rooms");
    for (std::uint64_t seed = first; seed < first + 25 * scenes; ++seed) pairs.look_at(random_occluded_pair(seed), 100.0, 1, seed);
    pairs.print("two polygons");
    boxes.look_at(room_with_boxes(24), 0.5, 40 * scenes, first);
    boxes.print("24 boxes");
    for (std::uint64_t seed = first; seed < first + scenes; ++seed) solids.look_at(room_of_oblique_solids(seed, 60), 1.0, 80, seed);
    solids.print("60 oblique solids");
}
