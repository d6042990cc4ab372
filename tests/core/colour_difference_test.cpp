#include "core/colour_difference.h"

#include <cmath>
#include <glm/vec3.hpp>
#include <vector>

#include "core/units.h"
#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const glm::dvec3 d65(0.95047, 1.0, 1.08883);

struct Pair {
    Lab first, second;
    double difference;
};

/// The 34 pairs of Sharma, Wu and Dalal 2005, Table 1.
std::vector<Pair> published_pairs() {
    const tests::CsvTable table = tests::read_csv("ciede2000_pairs.csv");
    std::vector<Pair> pairs;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const auto number = [&](const char* column) { return table.number(row, column); };
        pairs.push_back({{number("L1"), number("a1"), number("b1")},
                         {number("L2"), number("a2"), number("b2")},
                         number("delta_e")});
    }
    return pairs;
}

}  // namespace

TEST_CASE("CIEDE2000 gives the published differences", "[core][colour][colour_difference]") {
    const std::vector<Pair> pairs = published_pairs();
    REQUIRE(pairs.size() == 34);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        INFO("pair " << k + 1);
        CHECK_THAT(colour_difference(pairs[k].first, pairs[k].second),
                   WithinAbs(pairs[k].difference, 0.51e-4));  // four decimals
    }
}

TEST_CASE("a colour difference is the same from either side, and nothing between equal colours",
          "[core][colour][colour_difference]") {
    const std::vector<Pair> pairs = published_pairs();
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        INFO("pair " << k + 1);
        const auto& [first, second, difference] = pairs[k];
        // Sums in another order: rounding.
        CHECK_THAT(colour_difference(second, first), WithinRel(colour_difference(first, second), 1e-12));
        CHECK(colour_difference(first, first) == 0.0);
        CHECK(colour_difference(second, second) == 0.0);
    }
}

TEST_CASE("a small difference in lightness alone follows the weight of lightness",
          "[core][colour][colour_difference]") {
    for (const double lightness : {0.0, 20.0, 50.0, 80.0, 100.0}) {
        INFO("L* " << lightness);
        const double off = (lightness - 50.0) * (lightness - 50.0);
        const double weight = 1.0 + 0.015 * off / std::sqrt(20.0 + off);
        constexpr double step = 1e-4;  // the weight changes by less than 2e-6 over it
        const double difference =
            colour_difference({lightness - step / 2, 0, 0}, {lightness + step / 2, 0, 0});
        CHECK_THAT(difference, WithinRel(step / weight, 1e-5));
    }
}

TEST_CASE("a colour difference has no step where the hue turns over", "[core][colour][colour_difference]") {
    // Both sides of the a axis: the mean hue lies near 0, not near pi.
    const double across = colour_difference({50, 30, -1e-6}, {50, 30, 1e-6});
    const double beside = colour_difference({50, 30, 1e-6}, {50, 30, 3e-6});
    CHECK(across > 0.0);
    CHECK_THAT(across, WithinRel(beside, 1e-4));  // hue differs by 1e-7 rad; rounding of the hue to 1e-16 rad
}

TEST_CASE("CIE L*a*b* is 100 for white, 0 for black, and grey where XYZ is a share of white",
          "[core][colour][colour_difference]") {
    constexpr double rounding = 1e-12;
    const auto check_grey = [&](double share, double lightness) {
        const Lab lab = lab_from_xyz(share * d65, d65);
        INFO("share " << share);
        CHECK_THAT(lab.L, WithinAbs(lightness, rounding));
        CHECK_THAT(lab.a, WithinAbs(0.0, 500.0 * 1e-15));
        CHECK_THAT(lab.b, WithinAbs(0.0, 200.0 * 1e-15));
    };
    check_grey(1.0, 100.0);
    check_grey(0.0, 0.0);
    check_grey(0.125, 42.0);           // 116 / 2 - 16
    check_grey(216.0 / 24389.0, 8.0);  // the knee, (6/29)^3
    check_grey(27.0 / 24389.0, 1.0);   // on the straight line
}

TEST_CASE("CIE L*a*b* depends on the ratio to white alone", "[core][colour][colour_difference]") {
    const glm::dvec3 xyz(0.41, 0.21, 0.02);
    const Lab once = lab_from_xyz(xyz, d65), bright = lab_from_xyz(5000.0 * xyz, 5000.0 * d65);
    CHECK_THAT(bright.L, WithinAbs(once.L, 1e-10));
    CHECK_THAT(bright.a, WithinAbs(once.a, 1e-10));
    CHECK_THAT(bright.b, WithinAbs(once.b, 1e-10));
    CHECK(once.a > 0.0);  // red
    CHECK(once.b > 0.0);  // and yellow: an orange
}
