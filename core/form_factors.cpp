#include "core/form_factors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/errors.h"
#include "core/parallel.h"

namespace naturel {
namespace {

/// A sparse square matrix in compressed rows, columns increasing in a row.
struct SparseRows {
    std::vector<std::uint64_t> row_begin;
    std::vector<std::uint32_t> column;
    std::vector<double> value;

    void resize(std::size_t entries) {
        parallel_for(2, 1, [&](std::size_t part) { part == 0 ? value.resize(entries) : column.resize(entries); });
    }
};

/// What the rows say about themselves, [row].
struct RowShares {
    std::vector<double> lost;
    std::vector<double> truncated;
    std::vector<double> escaped;
};

FormFactors collect_rows(const Visibility& visibility, std::size_t count, bool with_errors, RowShares& shares,
                         Progress& progress) {
    FormFactorRows rows = visibility.form_factor_rows(count, with_errors, progress);
    shares.lost = std::move(rows.lost);
    shares.truncated = std::move(rows.truncated);
    shares.escaped = std::move(rows.escaped);
    FormFactors f;
    f.row_begin = std::move(rows.row_begin);
    f.column = std::move(rows.column);
    f.value = std::move(rows.value);
    f.error = std::move(rows.error);
    return f;
}

/// Counting sort by column. Each task owns a range of columns and reads all rows in order, so that neither
/// the result nor the order of writes depends on the number of threads.
SparseRows transpose(const FormFactors& f) {
    const std::size_t count = f.row_count();
    // Enough tasks for many threads; more would read the rows ever more often.
    constexpr std::size_t least_columns = 256, most_tasks = 128;
    const std::size_t columns_per_task = std::max(least_columns, (count + most_tasks - 1) / most_tasks);
    const std::size_t tasks = (count + columns_per_task - 1) / columns_per_task;

    const auto for_each_in_task = [&](std::size_t task, const auto& visit) {
        const std::size_t first = task * columns_per_task;
        const std::size_t last = std::min(count, first + columns_per_task);
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t* const row_end = f.column.data() + f.row_begin[i + 1];
            const std::uint32_t* c = std::lower_bound(f.column.data() + f.row_begin[i], row_end, first);
            for (; c != row_end && *c < last; ++c)
                visit(i, *c, f.value[static_cast<std::size_t>(c - f.column.data())]);
        }
    };

    SparseRows t;
    t.row_begin.resize(count + 1);
    parallel_for(tasks, 1, [&](std::size_t task) {
        for_each_in_task(task, [&](std::size_t, std::uint32_t c, double) { ++t.row_begin[c + 1]; });
    });
    for (std::size_t i = 0; i < count; ++i)
        t.row_begin[i + 1] += t.row_begin[i];
    t.resize(f.column.size());
    std::vector<std::uint64_t> next(t.row_begin.begin(), t.row_begin.end() - 1);
    parallel_for(tasks, 1, [&](std::size_t task) {
        for_each_in_task(task, [&](std::size_t i, std::uint32_t c, double value) {
            t.column[next[c]] = static_cast<std::uint32_t>(i);
            t.value[next[c]++] = value;
        });
    });
    return t;
}

/// Calls visit(j, F_ij, F_ji) for all j for which one of the two is not zero, in increasing order.
template <class Visit>
void for_each_exchange(const FormFactors& f, const SparseRows& transposed, std::size_t i,
                       const Visit& visit) {
    std::size_t a = f.row_begin[i];
    std::size_t b = transposed.row_begin[i];
    const std::size_t a_end = f.row_begin[i + 1];
    const std::size_t b_end = transposed.row_begin[i + 1];
    while (a < a_end || b < b_end) {
        const bool from_a = b == b_end || (a < a_end && f.column[a] <= transposed.column[b]);
        const bool from_b = a == a_end || (b < b_end && transposed.column[b] <= f.column[a]);
        const std::uint32_t j = from_a ? f.column[a] : transposed.column[b];
        visit(j, from_a ? f.value[a++] : 0.0, from_b ? transposed.value[b++] : 0.0);
    }
}

FormFactorQuality measure(const FormFactors& f, const SparseRows& transposed, const RowShares& shares,
                          const std::vector<double>& area_m2) {
    struct RowMeasure {
        double gap = 0.0, exchanged = 0.0, flux_error = 0.0, row_sum = 0.0;
    };
    std::vector<RowMeasure> measures(f.row_count());
    parallel_for(f.row_count(), 16, [&](std::size_t i) {
        RowMeasure m;
        double arriving = 0.0;
        double leaving = 0.0;
        for_each_exchange(f, transposed, i, [&](std::uint32_t j, double f_ij, double f_ji) {
            m.gap += std::abs(area_m2[i] * f_ij - area_m2[j] * f_ji);
            m.exchanged += area_m2[i] * f_ij + area_m2[j] * f_ji;
            leaving += f_ij;
            arriving += area_m2[j] * f_ji;
        });
        m.flux_error = std::abs(arriving / area_m2[i] - leaving);
        m.row_sum = leaving;
        measures[i] = m;
    });

    FormFactorQuality q;
    double area = 0.0;
    RowMeasure sum;
    for (std::size_t i = 0; i < f.row_count(); ++i) {
        area += area_m2[i];
        q.mean_lost += area_m2[i] * shares.lost[i];
        q.mean_truncated += area_m2[i] * shares.truncated[i];
        q.mean_escaped += area_m2[i] * shares.escaped[i];
        if (shares.lost[i] > q.worst_lost) q.worst_row = i;
        q.worst_lost = std::max(q.worst_lost, shares.lost[i]);
        if (shares.lost[i] > leaking_share) ++q.leaking_rows;
        q.worst_truncated = std::max(q.worst_truncated, shares.truncated[i]);
        q.worst_escaped = std::max(q.worst_escaped, shares.escaped[i]);
        q.worst_flux_error = std::max(q.worst_flux_error, measures[i].flux_error);
        q.worst_excess = std::max(q.worst_excess, measures[i].row_sum + shares.lost[i] + shares.truncated[i] - 1.0);
        sum.gap += measures[i].gap;
        sum.exchanged += measures[i].exchanged;
    }
    if (area > 0.0) {
        q.mean_lost /= area;
        q.mean_truncated /= area;
        q.mean_escaped /= area;
    }
    if (sum.exchanged > 0.0) q.reciprocity_gap = sum.gap / sum.exchanged;
    return q;
}

/// S_ij = (A_i F_ij + A_j F_ji) / 2: symmetric to the last bit.
SparseRows mean_exchange(const FormFactors& f, const SparseRows& transposed,
                         const std::vector<double>& area_m2) {
    SparseRows s;
    s.row_begin.resize(f.row_count() + 1);
    parallel_for(f.row_count(), 16, [&](std::size_t i) {
        for_each_exchange(f, transposed, i, [&](std::uint32_t, double, double) { ++s.row_begin[i + 1]; });
    });
    for (std::size_t i = 0; i < f.row_count(); ++i)
        s.row_begin[i + 1] += s.row_begin[i];
    s.resize(s.row_begin.back());
    parallel_for(f.row_count(), 16, [&](std::size_t i) {
        std::size_t e = s.row_begin[i];
        for_each_exchange(f, transposed, i, [&](std::uint32_t j, double f_ij, double f_ji) {
            s.column[e] = j;
            s.value[e++] = 0.5 * (area_m2[i] * f_ij + area_m2[j] * f_ji);
        });
    });
    return s;
}

/// product_i = sum_j S_ij v_j.
void multiply(const SparseRows& s, const std::vector<double>& v, std::vector<double>& product) {
    parallel_for(v.size(), 16, [&](std::size_t i) {
        double sum = 0.0;
        for (std::size_t e = s.row_begin[i]; e < s.row_begin[i + 1]; ++e)
            sum += s.value[e] * v[s.column[e]];
        product[i] = sum;
    });
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
    return deterministic_sum<double>(a.size(), [&](std::size_t i) { return a[i] * b[i]; });
}

/// The scaling of a symmetric matrix to given row sums.
struct Balance {
    std::vector<double> scale;  ///< x_i
    /// x_i sum_j S_ij x_j has met its target to `tolerance` when all are 1; else at most 1, so that
    /// min(reserve_i, reserve_j) x_i S_ij x_j exceeds no target.
    std::vector<double> reserve;
};

/// Finds x > 0 with x_i sum_j S_ij x_j = target_i by Newton's method for the logarithms of x, its linear
/// systems solved by conjugate gradients (Knight & Ruiz 2013, docs/method.md "Form factors"). The damped
/// fixed point x_i <- x_i sqrt(target_i / (x_i sum_j S_ij x_j)) has the same limit, but slows down without
/// bound where floor and ceiling see little but each other. A row without entries or with target 0 is left
/// out (x_i = 0).
Balance balance(const SparseRows& s, const std::vector<double>& target, Progress& progress) {
    constexpr double tolerance = 1e-10;  // relative, per row: a tenth of what flux balances are asked to hold
    constexpr int max_newton_steps = 20;  // quadratic: 3 to 5 do when a solution exists
    constexpr int max_linear_steps = 50;  // per Newton step
    constexpr double linear_tolerance = 1e-3;
    const std::size_t count = target.size();

    std::vector<double> x(count), reserve(count, 1.0);
    for (std::size_t i = 0; i < count; ++i)
        x[i] = target[i] > 0.0 && s.row_begin[i + 1] > s.row_begin[i] ? 1.0 : 0.0;

    std::vector<double> sum(count), step(count), residual(count), preconditioned(count), search(count),
        scaled(count), image(count);
    for (int newton = 0;; ++newton) {
        if (progress.interrupted()) throw Interrupted();
        multiply(s, x, sum);
        double worst = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            sum[i] *= x[i];
            if (sum[i] > 0.0) worst = std::max(worst, std::abs(sum[i] / target[i] - 1.0));
        }
        if (worst <= tolerance) break;
        if (newton == max_newton_steps) {
            for (std::size_t i = 0; i < count; ++i)
                reserve[i] = sum[i] > target[i] ? target[i] / sum[i] : 1.0;
            break;
        }

        // (diag(sum) + X S X) step = target - sum, preconditioned by diag(sum).
        const auto precondition = [&] {
            for (std::size_t i = 0; i < count; ++i)
                preconditioned[i] = sum[i] > 0.0 ? residual[i] / sum[i] : 0.0;
        };
        for (std::size_t i = 0; i < count; ++i) {
            step[i] = 0.0;
            residual[i] = sum[i] > 0.0 ? target[i] - sum[i] : 0.0;
        }
        precondition();
        search = preconditioned;
        double rho = dot(residual, preconditioned);
        const double enough = rho * linear_tolerance * linear_tolerance;
        for (int linear = 0; linear < max_linear_steps && rho > enough; ++linear) {
            for (std::size_t i = 0; i < count; ++i)
                scaled[i] = x[i] * search[i];
            multiply(s, scaled, image);
            for (std::size_t i = 0; i < count; ++i)
                image[i] = x[i] * image[i] + sum[i] * search[i];
            const double curvature = dot(search, image);
            if (curvature <= 0.0) break;
            const double alpha = rho / curvature;
            for (std::size_t i = 0; i < count; ++i) {
                step[i] += alpha * search[i];
                residual[i] -= alpha * image[i];
            }
            precondition();
            const double next_rho = dot(residual, preconditioned);
            for (std::size_t i = 0; i < count; ++i)
                search[i] = preconditioned[i] + (next_rho / rho) * search[i];
            rho = next_rho;
        }

        double longest = 0.0;
        for (const double d : step)
            longest = std::max(longest, std::abs(d));
        const double damping = longest > 1.0 ? 1.0 / longest : 1.0;  // never change a scale by more than e
        for (std::size_t i = 0; i < count; ++i)
            x[i] *= std::exp(damping * step[i]);
    }
    return {std::move(x), std::move(reserve)};
}

FormFactors renormalised(const FormFactors& raw, const RowShares& shares) {
    FormFactors f = raw;
    parallel_for(f.row_count(), 16, [&](std::size_t i) {
        const auto begin = f.value.begin() + static_cast<std::ptrdiff_t>(f.row_begin[i]);
        const auto end = f.value.begin() + static_cast<std::ptrdiff_t>(f.row_begin[i + 1]);
        const double sum = std::accumulate(begin, end, 0.0);
        if (sum <= 0.0) return;
        const double scale = (1.0 - shares.lost[i]) / sum;
        std::for_each(begin, end, [&](double& value) { value *= scale; });
    });
    return f;
}

FormFactors reciprocal(const FormFactors& raw, const SparseRows& transposed, const RowShares& shares,
                       const std::vector<double>& area_m2, Progress& progress) {
    SparseRows s = mean_exchange(raw, transposed, area_m2);
    std::vector<double> target(raw.row_count());
    for (std::size_t i = 0; i < target.size(); ++i)
        target[i] = area_m2[i] * (1.0 - shares.lost[i]);
    const Balance b = balance(s, target, progress);
    parallel_for(raw.row_count(), 16, [&](std::size_t i) {
        for (std::size_t e = s.row_begin[i]; e < s.row_begin[i + 1]; ++e) {
            const std::uint32_t j = s.column[e];
            s.value[e] *= b.scale[i] * b.scale[j] * std::min(b.reserve[i], b.reserve[j]) / area_m2[i];
        }
    });
    return {std::move(s.row_begin), std::move(s.column), std::move(s.value), {}, {}, {}, {}, raw.quality};
}

/// sum A |F' - F| / sum A F, where the columns of F are among those of F'.
double change(const FormFactors& raw, const FormFactors& repaired, const std::vector<double>& area_m2) {
    struct Sums {
        double moved = 0.0, all = 0.0;
        Sums operator+(const Sums& o) const { return {moved + o.moved, all + o.all}; }
    };
    const Sums sums = deterministic_sum<Sums>(raw.row_count(), [&](std::size_t i) {
        Sums row;
        std::size_t r = raw.row_begin[i];
        for (std::size_t e = repaired.row_begin[i]; e < repaired.row_begin[i + 1]; ++e) {
            const bool both = r < raw.row_begin[i + 1] && raw.column[r] == repaired.column[e];
            const double before = both ? raw.value[r++] : 0.0;
            row.moved += area_m2[i] * std::abs(repaired.value[e] - before);
            row.all += area_m2[i] * before;
        }
        return row;
    });
    return sums.all > 0.0 ? sums.moved / sums.all : 0.0;
}

}  // namespace

std::vector<double> reciprocity_gaps(const FormFactors& form_factors, const PatchGrid& grid) {
    NATUREL_EXPECT(form_factors.row_count() <= grid.patches.size());
    const SparseRows transposed = transpose(form_factors);
    std::vector<double> gaps(form_factors.row_count());
    parallel_for(gaps.size(), 16, [&](std::size_t i) {
        double gap = 0.0, exchanged = 0.0;
        for_each_exchange(form_factors, transposed, i, [&](std::uint32_t j, double f_ij, double f_ji) {
            const double there = grid.patches[i].area_m2 * f_ij, back = grid.patches[j].area_m2 * f_ji;
            gap += std::abs(there - back);
            exchanged += there + back;
        });
        gaps[i] = exchanged > 0.0 ? gap / exchanged : 0.0;
    });
    return gaps;
}

FormFactorSample sample_form_factors(const Visibility& visibility, const PatchGrid& grid, Progress& progress) {
    // About 512 rows in all, but one of every face: enough for a forecast within some percent. Fewer where rows are so long that
    // a method that looks at each pair would take minutes.
    const std::size_t wanted_rows = std::clamp<std::size_t>(20'000'000 / std::max<std::size_t>(1, grid.gather_patch_count), 64, 512);
    const std::size_t step = std::max<std::size_t>(1, grid.gather_patch_count / wanted_rows);
    std::vector<PatchId> chosen;
    for (std::size_t k = 0; k < grid.gather_patch_count; ++k)
        if (k % step == 0 || grid.patches[k].face != grid.patches[k - 1].face)
            chosen.push_back(make_id<PatchId>(k));
    if (chosen.empty()) return {};

    std::vector<double> lost(chosen.size());
    std::vector<std::size_t> entries(chosen.size());
    ThreadScratch<FormFactorRow> rows;
    parallel_stage("form factors of some patches", chosen.size(), 1, progress, [&](std::size_t k) {
        FormFactorRow& row = rows.local();
        visibility.form_factor_row(chosen[k], row);
        lost[k] = row.lost;
        entries[k] = row.values.size();
    });

    const auto worst = std::ranges::max_element(lost);
    const std::size_t all_entries = std::accumulate(entries.begin(), entries.end(), std::size_t{0});
    return {.mean_row_length = static_cast<double>(all_entries) / static_cast<double>(entries.size()),
            .worst_lost = *worst,
            .worst_patch = chosen[static_cast<std::size_t>(worst - lost.begin())]};
}

double forecast_memory_bytes(std::size_t row_count, double mean_row_length) {
    // A column number and a value per entry.
    constexpr double bytes_per_entry = sizeof(std::uint32_t) + sizeof(double);
    // While rows are repaired there are the rows, their transpose and the exchanges of both, up to twice as long.
    // Measured in a room of 4268 patches: 3.4 times the rows.
    constexpr double copies = 4.0;
    return copies * static_cast<double>(row_count) * mean_row_length * bytes_per_entry;
}

void refuse_excessive_memory(const Visibility& visibility, const PatchGrid& grid, double memory_bytes,
                             Progress& progress) {
    const std::size_t count = grid.gather_patch_count;
    if (forecast_memory_bytes(count, static_cast<double>(count)) <= memory_bytes) return;
    const FormFactorSample sample = sample_form_factors(visibility, grid, progress);
    const double needed = forecast_memory_bytes(count, sample.mean_row_length);
    if (needed > memory_bytes)
        throw InputError("", fmt::format("the form factors of {} patches need about {:.1f} GB of memory, and "
                                         "{:.1f} GB are left for them (make \"spacing_m\" of \"grid\" larger, or \"--grid-spacing\")",
                                         count, needed / 1e9, memory_bytes / 1e9));
}

FormFactors compute_form_factors(const Visibility& visibility, const PatchGrid& grid,
                                 const FormFactorOptions& options, Progress& progress) {
    NATUREL_EXPECT(grid.gather_patch_count <= grid.patches.size());
    std::vector<double> area_m2(grid.gather_patch_count);
    for (std::size_t i = 0; i < area_m2.size(); ++i)
        area_m2[i] = grid.patches[i].area_m2;

    RowShares shares;
    FormFactors raw = collect_rows(visibility, grid.gather_patch_count, options.errors, shares, progress);
    const SparseRows transposed = transpose(raw);
    raw.quality = measure(raw, transposed, shares, area_m2);
    if (options.repair == FormFactorRepair::none) {
        raw.lost = std::move(shares.lost);
        raw.truncated = std::move(shares.truncated);
        raw.escaped = std::move(shares.escaped);
        return raw;
    }

    FormFactors repaired = options.repair == FormFactorRepair::renormalise
                               ? renormalised(raw, shares)
                               : reciprocal(raw, transposed, shares, area_m2, progress);
    repaired.quality.repair_change = change(raw, repaired, area_m2);
    // An exchange that one side alone has found has no estimate on the other.
    if (raw.error.empty() || repaired.column != raw.column)
        repaired.error.clear();
    else
        repaired.error = std::move(raw.error);
    repaired.lost = std::move(shares.lost);
    repaired.truncated = std::move(shares.truncated);
    repaired.escaped = std::move(shares.escaped);
    return repaired;
}

}  // namespace naturel
