#include "core/gauss_legendre.h"

#include <cmath>

#include "core/errors.h"
#include "core/units.h"

namespace naturel {

QuadratureRule gauss_legendre(int count) {
    NATUREL_EXPECT(count >= 1);
    QuadratureRule rule{std::vector<double>(static_cast<std::size_t>(count)),
                        std::vector<double>(static_cast<std::size_t>(count))};
    for (int k = 0; k < count; ++k) {
        // Newton's method on the Legendre polynomial P_count from the usual first guess (Abramowitz &
        // Stegun 22.16.6).
        double x = -std::cos(pi * (k + 0.75) / (count + 0.5));
        double slope = 1.0;
        for (int step = 0; step < 100; ++step) {
            double p = 1.0, before = 0.0;  // P_n and P_(n-1)
            for (int n = 1; n <= count; ++n) {
                const double next = ((2 * n - 1) * x * p - (n - 1) * before) / n;
                before = p;
                p = next;
            }
            slope = count * (x * p - before) / (x * x - 1.0);
            const double change = p / slope;
            x -= change;
            if (std::abs(change) < 1e-15) break;
        }
        const auto at = static_cast<std::size_t>(k);
        rule.nodes[at] = 0.5 * (1.0 + x);
        rule.weights[at] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    return rule;
}

}  // namespace naturel
