#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace naturel {

/// Numbers that are worked on side by side and do not mix.
template <std::size_t lanes>
struct Lanes {
    std::array<double, lanes> v{};

    double& operator[](std::size_t c) { return v[c]; }
    double operator[](std::size_t c) const { return v[c]; }
    friend Lanes operator+(Lanes a, const Lanes& b) {
        for (std::size_t c = 0; c < lanes; ++c) a.v[c] += b.v[c];
        return a;
    }
};

template <std::size_t lanes>
using Field = std::vector<Lanes<lanes>>;  // [patch]

/// Largest magnitude per lane.
template <std::size_t lanes>
Lanes<lanes> largest_of(const Field<lanes>& field) {
    Lanes<lanes> largest;
    for (const Lanes<lanes>& x : field)
        for (std::size_t c = 0; c < lanes; ++c) largest[c] = std::max(largest[c], std::abs(x[c]));
    return largest;
}

struct MinimalResidual {
    int iterations = 0;  ///< applications of the operator
    double error = 0.0;  ///< of the last evaluation
    bool converged = false;
};

/// Solves x = b + T x in every lane on its own, for an operator T >= 0 whose powers vanish.
/// T is to be self-adjoint in the inner product sum weight a b, or nearly so: then these are conjugate residuals, else still a minimal
/// residual method, Orthomin(1), which converges because T shrinks (Eisenstat, Elman & Schultz 1983).
/// image_of(x, image): writes x - T x; the last call is for the x that is returned.
/// contraction: largest row sum of T. error_of(largest_residual, x) -> double: what shall come below `tolerance`.
/// on_step(error): told of every step. x: starts the iteration.
template <std::size_t lanes, class ImageOf, class ErrorOf, class OnStep>
MinimalResidual solve_by_minimal_residual(const Field<lanes>& b, const Field<lanes>& weight, double contraction, double tolerance,
                                          int max_iterations, const ImageOf& image_of, const ErrorOf& error_of, const OnStep& on_step,
                                          Field<lanes>& x) {
    const std::size_t count = b.size();
    Field<lanes> residual(count), search(count), search_image(count), residual_image(count);
    MinimalResidual result;

    const auto apply = [&](const Field<lanes>& of, Field<lanes>& image) {
        image_of(of, image);
        ++result.iterations;
    };
    /// Leaves b + T x - x in `residual`.
    const auto evaluate = [&] {
        apply(x, residual);
        parallel_for(count, 1024, [&](std::size_t i) {
            for (std::size_t c = 0; c < lanes; ++c) residual[i][c] = b[i][c] - residual[i][c];
        });
        result.error = error_of(largest_of(residual), x);
        result.converged = result.error <= tolerance;
        on_step(result.error);
    };
    /// Sum over patches of weight_i a_i b_i per lane.
    const auto dot = [&](const Field<lanes>& a, const Field<lanes>& other) {
        return deterministic_sum<Lanes<lanes>>(count, [&](std::size_t i) {
            Lanes<lanes> product;
            for (std::size_t c = 0; c < lanes; ++c) product[c] = weight[i][c] * a[i][c] * other[i][c];
            return product;
        });
    };
    /// Per lane, 0 where the divisor is 0 (a lane without light, or one that is already solved).
    const auto ratio = [](const Lanes<lanes>& a, const Lanes<lanes>& divisor) {
        Lanes<lanes> r;
        for (std::size_t c = 0; c < lanes; ++c) r[c] = divisor[c] > 0.0 ? a[c] / divisor[c] : 0.0;
        return r;
    };
    const auto add_scaled = [&](Field<lanes>& to, const Lanes<lanes>& factor, const Field<lanes>& y) {
        parallel_for(count, 1024, [&](std::size_t i) {
            for (std::size_t c = 0; c < lanes; ++c) to[i][c] += factor[c] * y[i][c];
        });
    };
    const auto passes_left = [&](int passes) { return result.iterations + passes <= max_iterations; };

    evaluate();
    Lanes<lanes> one;
    one.v.fill(1.0);
    bool accelerate = true;
    while (!result.converged && passes_left(1)) {
        if (!accelerate || !passes_left(2)) {  // Jacobi
            add_scaled(x, one, residual);
            evaluate();
            continue;
        }
        const Lanes<lanes> start = largest_of(residual);
        double promised = 1.0;  // what Jacobi would have left of the residual
        search = residual;
        apply(search, search_image);
        for (;;) {
            const Lanes<lanes> image_norm = dot(search_image, search_image);
            const Lanes<lanes> step = ratio(dot(residual, search_image), image_norm);
            Lanes<lanes> back;
            for (std::size_t c = 0; c < lanes; ++c) back[c] = -step[c];
            add_scaled(x, step, search);
            add_scaled(residual, back, search_image);

            const Lanes<lanes> largest = largest_of(residual);
            const double error = error_of(largest, x);
            on_step(error);
            if (error <= 0.5 * tolerance) break;  // half: rounding has moved the residual off the true one
            // T far from self-adjoint can grow in this norm. Jacobi shrinks the largest residual by the contraction factor
            // whatever the rows: fall back to it when ten times worse than that.
            promised *= contraction;
            for (std::size_t c = 0; c < lanes; ++c) accelerate = accelerate && largest[c] <= 10.0 * promised * start[c];
            if (!accelerate || !passes_left(2)) break;

            apply(residual, residual_image);
            const Lanes<lanes> turn = ratio(dot(residual_image, search_image), image_norm);
            parallel_for(count, 1024, [&](std::size_t i) {
                for (std::size_t c = 0; c < lanes; ++c) {
                    search[i][c] = residual[i][c] - turn[c] * search[i][c];
                    search_image[i][c] = residual_image[i][c] - turn[c] * search_image[i][c];
                }
            });
        }
        evaluate();
    }
    return result;
}

}  // namespace naturel
