#include "core/gauss_legendre.h"

#include <cmath>

#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;

TEST_CASE("a rule of n nodes integrates every power up to 2 n - 1 exactly", "[core][physics][quadrature]") {
    const int count = GENERATE(1, 2, 3, 8, 64);
    const QuadratureRule rule = gauss_legendre(count);
    for (int power = 0; power < 2 * count; ++power) {
        INFO(count << " nodes, power " << power);
        double sum = 0.0;
        for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
            sum += rule.weights[k] * std::pow(rule.nodes[k], power);
        }
        CHECK_THAT(sum, WithinAbs(1.0 / (power + 1), 1e-13));  // rounding of 64 terms
    }
}

TEST_CASE("the nodes of a rule increase inside the interval", "[core][physics][quadrature]") {
    const QuadratureRule rule = gauss_legendre(33);
    REQUIRE(rule.nodes.size() == 33);
    CHECK(rule.nodes.front() > 0.0);
    CHECK(rule.nodes.back() < 1.0);
    for (std::size_t k = 1; k < rule.nodes.size(); ++k)
        CHECK(rule.nodes[k] > rule.nodes[k - 1]);
}
