#include "core/sky_interpolation.h"

#include <cmath>
#include <numeric>
#include <random>

#include "core/sky_table.h"
#include "core/sun.h"
#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using glm::dvec3;

namespace {

double interpolated(const SkyInterpolation& sky, const std::vector<double>& values, const dvec3& direction) {
    SkyInterpolation::Stencil stencil;
    sky.find(direction, stencil);
    double sum = 0.0;
    for (std::size_t k = 0; k < stencil.count; ++k) sum += stencil.weights[k] * values[stencil.nodes[k]];
    return sum;
}

std::vector<dvec3> directions_all_over() {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    std::vector<dvec3> directions{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    for (int k = 0; k < 500; ++k) directions.push_back(direction_from_angles(0.5 * pi * share(random), 2.0 * pi * share(random)));
    return directions;
}

}  // namespace

TEST_CASE("between directions a smooth sky is met, and better the closer they are", "[sky_interpolation][convergence]") {
    const auto smooth = [](const dvec3& d) { return std::exp(0.7 * d.x - 0.4 * d.y + d.z); };
    const auto worst = [&](double spacing_rad) {
        const SkyInterpolation sky(spacing_rad);
        std::vector<double> values;
        for (std::size_t k = 0; k < sky.size(); ++k) values.push_back(smooth(sky.direction(k)));
        double error = 0.0;
        for (const dvec3& d : directions_all_over()) error = std::max(error, std::abs(interpolated(sky, values, d) - smooth(d)));
        return error;
    };
    const double coarse = worst(0.1), fine = worst(0.05);
    // Of the fourth order but for the short rows around the zenith, whose 24 directions leave (2 pi / 24)^4 3 / 128 of the slope
    // times their radius: that falls with the distance.
    CHECK(coarse < 2e-4);
    CHECK(fine < coarse / 2.0);
}

TEST_CASE("a table is met exactly from its own patches", "[sky_interpolation]") {
    const bool between = GENERATE(false, true);
    std::vector<double> values(145);
    std::iota(values.begin(), values.end(), 1.0);
    const SkyTable table(tregenza_patches(), values, between);
    const SkyInterpolation sky(table, 0.0);
    REQUIRE(sky.size() == values.size());
    CHECK(sky.is_smooth() == between);
    CHECK(sky == SkyInterpolation(table, 0.0));
    CHECK_FALSE(sky == SkyInterpolation(table, 0.1));
    CHECK_FALSE(sky == SkyInterpolation(0.1));
    for (const dvec3& d : directions_all_over()) CHECK_THAT(interpolated(sky, values, d), WithinAbs(table.luminance(d), 1e-9));
    for (std::size_t k = 0; k < sky.size(); ++k) CHECK_THAT(table.luminance(sky.direction(k)), WithinAbs(values[k], 1e-9));
}
