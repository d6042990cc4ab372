#include "core/radiosity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/errors.h"
#include "core/parallel.h"

namespace naturel {
namespace {

constexpr std::size_t channel_count = 6;

/// One number per source and band: sky r, g, b, other r, g, b. All six go through the matrix in one pass.
struct Channels {
    std::array<double, channel_count> v{};

    double& operator[](std::size_t c) { return v[c]; }
    double operator[](std::size_t c) const { return v[c]; }
    friend Channels operator+(Channels a, const Channels& b) {
        for (std::size_t c = 0; c < channel_count; ++c)
            a.v[c] += b.v[c];
        return a;
    }
};
using Field = std::vector<Channels>;  // [patch]

Channels both_sources(const Band3& x) {
    return {{x.r, x.g, x.b, x.r, x.g, x.b}};
}
Channels to_channels(const LightBySource& x) {
    return {{x.sky.r, x.sky.g, x.sky.b, x.other.r, x.other.g, x.other.b}};
}
LightBySource to_light(const Channels& x) {
    return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}
Band3 sum_of_sources(const Channels& x) {
    return {x[0] + x[3], x[1] + x[4], x[2] + x[5]};
}

/// The equation B = B0 + K F B (docs/method.md, "Radiosity"): F gathers, K reflects and transmits.
class Enclosure {
public:
    Enclosure(const FormFactors& form_factors, std::span<const double> area_m2,
              std::span<const PatchOptics> optics)
        : f_(form_factors), reflected_(optics.size()), transmitted_(optics.size()), behind_(optics.size()) {
        for (std::size_t i = 0; i < optics.size(); ++i) {
            reflected_[i] = both_sources(optics[i].reflectance);
            behind_[i] = i;
            if (optics[i].behind == PatchId::none) continue;
            const std::size_t k = index(optics[i].behind);
            NATUREL_EXPECT(k < optics.size() && index(optics[k].behind) == i);
            behind_[i] = k;
            // The two sides of an aperture have one area; the ratio keeps the flux when their grids differ by
            // rounding.
            transmitted_[i] = both_sources((area_m2[k] / area_m2[i]) * optics[k].transmittance);
        }
    }

    std::size_t size() const { return reflected_.size(); }

    /// F B.
    void gather(const Field& exitance, Field& illuminance) const {
        parallel_for(size(), 16, [&](std::size_t i) {
            Channels sum;
            for (std::size_t e = f_.row_begin[i]; e < f_.row_begin[i + 1]; ++e) {
                const double form_factor = f_.value[e];
                const Channels& from = exitance[f_.column[e]];
                for (std::size_t c = 0; c < channel_count; ++c)
                    sum[c] += form_factor * from[c];
            }
            illuminance[i] = sum;
        });
    }

    /// (K E)_i = rho_i E_i + tau_k E_k A_k / A_i, k behind i.
    Channels reflect(const Field& illuminance, std::size_t i) const {
        Channels out;
        for (std::size_t c = 0; c < channel_count; ++c)
            out[c] = reflected_[i][c] * illuminance[i][c] + transmitted_[i][c] * illuminance[behind_[i]][c];
        return out;
    }

    /// Row sum of K.
    Channels gain(std::size_t i) const { return reflected_[i] + transmitted_[i]; }

private:
    const FormFactors& f_;
    Field reflected_, transmitted_;
    std::vector<std::size_t> behind_;
};

/// A bound |error of B_i| <= factor x largest |residual| for every patch, per channel.
///
/// K F has no negative entry, so with u >= 0 and u - K F u >= delta > 0 the error is at most u / delta times
/// the largest residual. u = 1 gives 1 / (1 - largest row sum of K F), i.e. 1 / (1 - rho_max). An opening
/// between rooms lets everything pass and makes that row sum 1: then u = 1 + K F 1 + (K F)^2 1 + ... with a
/// few terms.
struct ErrorBound {
    Channels contraction;  ///< largest row sum of K F
    Channels factor;       ///< infinite when no bound is known
};

ErrorBound error_bound(const Enclosure& enclosure) {
    constexpr double useless = 0.995;  // reflectances end at 0.99: only openings lie above
    constexpr int max_terms = 64;      // a chain of as many openings
    const std::size_t count = enclosure.size();
    Channels one;
    one.v.fill(1.0);
    Field power(count, one), gathered(count), sum(count);
    ErrorBound bound;
    for (int term = 0; term < max_terms; ++term) {
        for (std::size_t i = 0; i < count; ++i)
            sum[i] = sum[i] + power[i];
        enclosure.gather(power, gathered);
        Channels largest_power, largest_sum;
        for (std::size_t i = 0; i < count; ++i) {
            power[i] = enclosure.reflect(gathered, i);
            for (std::size_t c = 0; c < channel_count; ++c) {
                largest_power[c] = std::max(largest_power[c], power[i][c]);
                largest_sum[c] = std::max(largest_sum[c], sum[i][c]);
            }
        }
        if (term == 0) bound.contraction = largest_power;
        for (std::size_t c = 0; c < channel_count; ++c)
            bound.factor[c] = largest_power[c] < 1.0 ? largest_sum[c] / (1.0 - largest_power[c])
                                                     : std::numeric_limits<double>::infinity();
        if (*std::max_element(largest_power.v.begin(), largest_power.v.end()) < useless) break;
    }
    return bound;
}

/// Largest magnitude per channel.
Channels largest_of(const Field& field) {
    Channels largest;
    for (const Channels& x : field)
        for (std::size_t c = 0; c < channel_count; ++c)
            largest[c] = std::max(largest[c], std::abs(x[c]));
    return largest;
}

/// Sum over patches of weight_i a_i b_i per channel.
Channels dot(const Field& weight, const Field& a, const Field& b) {
    return deterministic_sum<Channels>(a.size(), [&](std::size_t i) {
        Channels product;
        for (std::size_t c = 0; c < channel_count; ++c)
            product[c] = weight[i][c] * a[i][c] * b[i][c];
        return product;
    });
}

/// a / b per channel, 0 where b is 0 (a channel without light, or one that is already solved).
Channels ratio(const Channels& a, const Channels& b) {
    Channels r;
    for (std::size_t c = 0; c < channel_count; ++c)
        r[c] = b[c] > 0.0 ? a[c] / b[c] : 0.0;
    return r;
}

Channels area_weighted_sum(std::span<const double> area_m2, const Field& field) {
    return deterministic_sum<Channels>(field.size(), [&](std::size_t i) {
        Channels flux;
        for (std::size_t c = 0; c < channel_count; ++c)
            flux[c] = area_m2[i] * field[i][c];
        return flux;
    });
}

/// x + factor y, per channel.
void add_scaled(Field& x, const Channels& factor, const Field& y) {
    parallel_for(x.size(), 1024, [&](std::size_t i) {
        for (std::size_t c = 0; c < channel_count; ++c)
            x[i][c] += factor[c] * y[i][c];
    });
}

/// Reports decades of accuracy won as per cents of those wanted.
class ConvergenceProgress {
public:
    ConvergenceProgress(Progress& progress, double tolerance) : progress_(progress), tolerance_(tolerance) {
        progress_.begin("radiosity", 100);
    }

    void update(double error) {
        if (progress_.interrupted()) {
            progress_.end();
            throw Interrupted();
        }
        if (!(error > 0.0) || !std::isfinite(error)) return;
        if (first_ == 0.0) first_ = error;
        const double won = std::log(first_ / error) / std::log(std::max(first_ / tolerance_, 1.0 + 1e-9));
        const auto percent = static_cast<std::size_t>(100.0 * std::clamp(won, 0.0, 1.0));
        if (percent > reported_) progress_.advance(percent - reported_);
        reported_ = std::max(reported_, percent);
    }

    void finish() {
        progress_.advance(100 - reported_);
        progress_.end();
    }

private:
    Progress& progress_;
    double tolerance_;
    double first_ = 0.0;
    std::size_t reported_ = 0;
};

}  // namespace

RadiositySolution solve_radiosity(const FormFactors& form_factors, std::span<const double> area_m2,
                                  std::span<const PatchOptics> optics,
                                  std::span<const LightBySource> direct_illuminance_lx,
                                  const RadiosityOptions& options, Progress& progress) {
    const std::size_t count = form_factors.row_count();
    NATUREL_EXPECT(area_m2.size() == count && optics.size() == count &&
                   direct_illuminance_lx.size() == count);
    const Enclosure enclosure(form_factors, area_m2, optics);
    const ErrorBound bound = error_bound(enclosure);

    // What leaves before anything was gathered: emission and the reflection of direct light.
    Field direct(count), first_exitance(count), weight(count);
    for (std::size_t i = 0; i < count; ++i)
        direct[i] = to_channels(direct_illuminance_lx[i]);
    for (std::size_t i = 0; i < count; ++i) {
        first_exitance[i] = enclosure.reflect(direct, i) + to_channels(optics[i].exitance_lm_m2);
        // In this inner product K F is self-adjoint (reciprocal F, no inner apertures) and its norm at most
        // the largest gain: the minimal residual steps below then have conjugate directions.
        const Channels gain = enclosure.gain(i);
        for (std::size_t c = 0; c < channel_count; ++c)
            weight[i][c] = gain[c] > 0.0 ? area_m2[i] / gain[c] : 0.0;
    }
    double room_area_m2 = 0.0;
    for (const double a : area_m2)
        room_area_m2 += a;

    /// Bound on the relative error of the emitted flux, largest over the channels.
    const auto error_of = [&](const Channels& largest_residual, const Channels& flux) {
        double worst = 0.0;
        for (std::size_t c = 0; c < channel_count; ++c)
            if (largest_residual[c] > 0.0)
                worst = std::max(worst, flux[c] > 0.0 ? largest_residual[c] * bound.factor[c] * room_area_m2 / flux[c]
                                                      : std::numeric_limits<double>::infinity());
        return worst;
    };

    RadiositySolution solution;
    ConvergenceProgress decades(progress, options.tolerance);
    Field exitance = first_exitance, illuminance(count), residual(count);
    Field search(count), search_image(count), residual_image(count);

    /// x - K F x; one pass over the matrix.
    const auto image_of = [&](const Field& x, Field& image) {
        enclosure.gather(x, illuminance);
        parallel_for(count, 1024, [&](std::size_t i) {
            const Channels reflected = enclosure.reflect(illuminance, i);
            for (std::size_t c = 0; c < channel_count; ++c)
                image[i][c] = x[i][c] - reflected[c];
        });
        ++solution.iterations;
    };
    /// Leaves F B in `illuminance` and B0 + K F B - B in `residual`; one pass over the matrix.
    const auto evaluate = [&] {
        image_of(exitance, residual);
        parallel_for(count, 1024, [&](std::size_t i) {
            for (std::size_t c = 0; c < channel_count; ++c)
                residual[i][c] = first_exitance[i][c] - residual[i][c];
        });
        solution.relative_residual = error_of(largest_of(residual), area_weighted_sum(area_m2, exitance));
        solution.converged = solution.relative_residual <= options.tolerance;
        decades.update(solution.relative_residual);
    };

    const auto passes_left = [&](int passes) {
        return solution.iterations + passes <= options.max_iterations;
    };

    evaluate();
    Channels one;
    one.v.fill(1.0);
    bool accelerate = true;
    while (!solution.converged && passes_left(1)) {
        if (!accelerate || !passes_left(2)) {  // Jacobi
            add_scaled(exitance, one, residual);
            evaluate();
            continue;
        }
        // Orthomin(1): conjugate residuals if K F is self-adjoint, else still a minimal residual method,
        // which converges because K F shrinks (Eisenstat, Elman & Schultz 1983).
        const Channels start = largest_of(residual);
        double promised = 1.0;  // what Jacobi would have left of the residual
        search = residual;
        image_of(search, search_image);
        for (;;) {
            const Channels image_norm = dot(weight, search_image, search_image);
            const Channels step = ratio(dot(weight, residual, search_image), image_norm);
            Channels back;
            for (std::size_t c = 0; c < channel_count; ++c)
                back[c] = -step[c];
            add_scaled(exitance, step, search);
            add_scaled(residual, back, search_image);

            const Channels largest = largest_of(residual);
            const double error = error_of(largest, area_weighted_sum(area_m2, exitance));
            decades.update(error);
            if (error <= 0.5 * options.tolerance)
                break;  // half: rounding has moved the residual off the true one
            // Rows far from reciprocal can make K F grow in this norm. Jacobi shrinks the largest residual by
            // the contraction factor whatever the rows: fall back to it when ten times worse than that.
            const double contraction =
                *std::max_element(bound.contraction.v.begin(), bound.contraction.v.end());
            promised *= contraction;
            for (std::size_t c = 0; c < channel_count; ++c)
                accelerate = accelerate && largest[c] <= 10.0 * promised * start[c];
            if (!accelerate || !passes_left(2)) break;

            image_of(residual, residual_image);
            const Channels turn = ratio(dot(weight, residual_image, search_image), image_norm);
            parallel_for(count, 1024, [&](std::size_t i) {
                for (std::size_t c = 0; c < channel_count; ++c) {
                    search[i][c] = residual[i][c] - turn[c] * search[i][c];
                    search_image[i][c] = residual_image[i][c] - turn[c] * search_image[i][c];
                }
            });
        }
        evaluate();
    }
    decades.finish();

    // `illuminance` is F B of the last evaluation.
    solution.exitance_lm_m2.resize(count);
    solution.indirect_illuminance_lx.resize(count);
    Field absorbed(count), lost(count), incoming(count);
    parallel_for(count, 16, [&](std::size_t i) {
        const Channels reflected = enclosure.reflect(illuminance, i);
        solution.exitance_lm_m2[i] = to_light(first_exitance[i] + reflected);
        solution.indirect_illuminance_lx[i] = to_light(illuminance[i]);

        double row_sum = 0.0;
        for (std::size_t e = form_factors.row_begin[i]; e < form_factors.row_begin[i + 1]; ++e)
            row_sum += form_factors.value[e];
        const Channels kept = both_sources(optics[i].reflectance + optics[i].transmittance);
        const Channels emitted = to_channels(optics[i].exitance_lm_m2);
        for (std::size_t c = 0; c < channel_count; ++c) {
            incoming[i][c] = direct[i][c] + emitted[c];
            absorbed[i][c] = (1.0 - kept[c]) * (direct[i][c] + illuminance[i][c]);
            lost[i][c] = (1.0 - row_sum) * (first_exitance[i][c] + reflected[c]);
        }
    });
    solution.flux_in_lm = sum_of_sources(area_weighted_sum(area_m2, incoming));
    solution.flux_absorbed_lm = sum_of_sources(area_weighted_sum(area_m2, absorbed));
    solution.flux_lost_lm = sum_of_sources(area_weighted_sum(area_m2, lost));
    return solution;
}

}  // namespace naturel
