#include "core/importance.h"

#include <algorithm>
#include <numeric>

#include "core/errors.h"
#include "core/minimal_residual.h"
#include "core/parallel.h"
#include "core/wide.h"

namespace naturel {
namespace {

constexpr std::size_t lane_count = 16;
using Readings = Lanes<lane_count>;
using ReadingField = Field<lane_count>;

/// The form factors in tiles of columns, so that what a tile scatters to stays in the nearest cache.
class Tiles {
public:
    explicit Tiles(const FormFactors& f) : f_(f) {
        const std::size_t rows = f.row_count();
        for (std::size_t first = 0; first < rows; first += tile_columns) {
            for (std::size_t i = 0; i < rows; ++i) {
                const auto begin = f.column.begin() + static_cast<std::ptrdiff_t>(f.row_begin[i]);
                const auto end = f.column.begin() + static_cast<std::ptrdiff_t>(f.row_begin[i + 1]);
                begin_.push_back(static_cast<std::uint64_t>(std::lower_bound(begin, end, first) - f.column.begin()));
            }
        }
        begin_.insert(begin_.end(), f.row_begin.begin() + 1, f.row_begin.end());
    }

    const FormFactors& form_factors() const { return f_; }
    /// Where the entries of a row begin that are in a tile: [tile, and one behind the last][row].
    std::span<const std::uint64_t> begin() const { return begin_; }

private:
    static constexpr std::size_t tile_columns = 128;

    const FormFactors& f_;
    std::vector<std::uint64_t> begin_;
};

/// out += F^T y. Each number of `out` gets its terms in the order of the rows.
NATUREL_WIDE void scatter(const Tiles& tiles, const ReadingField& y, ReadingField& out) {
    const FormFactors& f = tiles.form_factors();
    const std::span<const std::uint64_t> begin = tiles.begin();
    const std::size_t rows = y.size();
    for (std::size_t tile = 0; (tile + 1) * rows < begin.size(); ++tile) {
        for (std::size_t i = 0; i < rows; ++i) {
            const Readings from = y[i];
            for (std::uint64_t e = begin[tile * rows + i]; e < begin[(tile + 1) * rows + i]; ++e) {
                const double form_factor = f.value[e];
                Readings& to = out[f.column[e]];
                for (std::size_t c = 0; c < lane_count; ++c) to.v[c] += form_factor * from.v[c];
            }
        }
    }
}

double of_band(const Band3& x, std::size_t band) { return band == 0 ? x.r : band == 1 ? x.g : x.b; }

/// What is left of light of one band where it meets a patch.
struct BandOptics {
    std::vector<double> reflected, transmitted;  ///< [patch]; transmitted: to this patch, of light on the patch behind it
    std::vector<std::size_t> behind;
};

BandOptics optics_of_band(std::span<const PatchOptics> optics, std::span<const double> area_m2, std::size_t band) {
    BandOptics found;
    for (std::size_t i = 0; i < optics.size(); ++i) {
        found.reflected.push_back(of_band(optics[i].reflectance, band));
        const bool inner = optics[i].behind != PatchId::none;
        found.behind.push_back(inner ? index(optics[i].behind) : i);
        const std::size_t k = found.behind.back();
        found.transmitted.push_back(inner ? area_m2[k] / area_m2[i] * of_band(optics[k].transmittance, band) : 0.0);
    }
    return found;
}

}  // namespace

Importance solve_importance(const FormFactors& form_factors, std::span<const double> area_m2, std::span<const PatchOptics> optics,
                            std::size_t readings, std::size_t bands,
                            const std::function<void(std::size_t reading, std::size_t band, std::span<double> out)>& weights,
                            const RadiosityOptions& options, Progress& progress) {
    const std::size_t count = form_factors.row_count();
    NATUREL_EXPECT(area_m2.size() == count && optics.size() == count);
    const double room_area_m2 = std::accumulate(area_m2.begin(), area_m2.end(), 0.0);
    Importance importance{.readings = readings, .bands = bands};
    importance.value.resize(count * bands * readings);
    const std::size_t groups = (readings + lane_count - 1) / lane_count;
    std::vector<MinimalResidual> outcomes(groups * bands);
    std::vector<BandOptics> of_bands;
    for (std::size_t band = 0; band < bands; ++band) of_bands.push_back(optics_of_band(optics, area_m2, band));
    const Tiles tiles(form_factors);

    parallel_stage("importance", groups, 1, progress, [&](std::size_t group) {
        const std::size_t first = group * lane_count, lanes_used = std::min(lane_count, readings - first);
        ReadingField per_area(count);
        for (std::size_t band = 0; band < bands; ++band) {
            const BandOptics& kept = of_bands[band];
            // Per area of the patch, importance x obeys x = weight / area + (F^T K^T area x) / area; of reciprocal F the last term is
            // F K x, self-adjoint with area x gain as the weight.
            ReadingField b(count), norm_weight(count), sent(count);
            std::vector<double> given(count);
            for (std::size_t lane = 0; lane < lanes_used; ++lane) {
                std::fill(given.begin(), given.end(), 0.0);
                weights(first + lane, band, given);
                for (std::size_t i = 0; i < count; ++i) b[i][lane] = given[i] / area_m2[i];
            }
            for (std::size_t i = 0; i < count; ++i) norm_weight[i].v.fill(area_m2[i] * (kept.reflected[i] + kept.transmitted[i]));
            const auto transport = [&](const ReadingField& x, ReadingField& image) {
                for (std::size_t i = 0; i < count; ++i) {
                    const std::size_t k = kept.behind[i];
                    for (std::size_t c = 0; c < lane_count; ++c)
                        sent[i][c] = kept.reflected[i] * area_m2[i] * x[i][c] + kept.transmitted[k] * area_m2[k] * x[k][c];
                }
                std::fill(image.begin(), image.end(), Readings{});
                scatter(tiles, sent, image);
                for (std::size_t i = 0; i < count; ++i)
                    for (std::size_t c = 0; c < lane_count; ++c) image[i][c] /= area_m2[i];
            };
            const auto image_of = [&](const ReadingField& x, ReadingField& image) {
                transport(x, image);
                for (std::size_t i = 0; i < count; ++i)
                    for (std::size_t c = 0; c < lane_count; ++c) image[i][c] = x[i][c] - image[i][c];
            };
            Readings one;
            one.v.fill(1.0);
            ReadingField row_sums(count);
            transport(ReadingField(count, one), row_sums);
            const double contraction = largest_of(row_sums)[0];
            if (band == 0) per_area = b;  // other bands start where the one before has ended
            // The error of a reading is the sum of residual x exitance.
            const auto error_of = [&](const Readings& largest_residual, const ReadingField&) {
                return room_area_m2 * *std::max_element(largest_residual.v.begin(), largest_residual.v.end());
            };
            outcomes[group * bands + band] = solve_by_minimal_residual(b, norm_weight, contraction, options.tolerance,
                                                                       options.max_iterations, image_of, error_of, [](double) {},
                                                                       per_area);
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t lane = 0; lane < lanes_used; ++lane)
                    importance.value[(i * bands + band) * readings + first + lane] = area_m2[i] * per_area[i][lane];
        }
    });
    for (const MinimalResidual& outcome : outcomes) {
        importance.iterations = std::max(importance.iterations, outcome.iterations);
        importance.relative_residual = std::max(importance.relative_residual, outcome.error);
        importance.converged = importance.converged && outcome.converged;
    }
    return importance;
}

}  // namespace naturel
