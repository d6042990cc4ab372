#include "core/false_colour.h"

#include <cmath>
#include <limits>

#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinRel;

TEST_CASE("viridis passes its anchors and is straight between them", "[core][false_colour]") {
    CHECK(viridis(0.0) == Rgb8{0x44, 0x01, 0x54});
    CHECK(viridis(4.0 / 9.0) == Rgb8{0x26, 0x82, 0x8e});
    CHECK(viridis(1.0) == Rgb8{0xfd, 0xe7, 0x25});
    CHECK(viridis(0.5 / 9.0) == Rgb8{70, 21, 102});  // halves of 0x44 + 0x48, 0x01 + 0x28, 0x54 + 0x78, rounded
    CHECK(viridis(-3.0) == viridis(0.0));
    CHECK(viridis(3.0) == viridis(1.0));
}

TEST_CASE("a place on the colour bar gives back its value", "[core][false_colour]") {
    const auto kind = GENERATE(ColourScaleKind::linear, ColourScaleKind::logarithmic);
    const ColourScale scale(kind, 8000.0, 2.5);
    for (const double value : {40.0, 555.0, 8000.0})
        CHECK_THAT(scale.value_at(scale.place(value)), WithinRel(value, 1e-12));  // rounding
    CHECK(scale.place(0.0) == 0.0);
    CHECK(scale.place(-5.0) == 0.0);
    CHECK(scale.place(1e9) == 1.0);
    CHECK(scale.place(std::numeric_limits<double>::quiet_NaN()) == 0.0);
}

TEST_CASE("a legend has round values, few enough and inside the scale", "[core][false_colour]") {
    CHECK(ColourScale(ColourScaleKind::linear, 1000.0).round_values(6) ==
          std::vector<double>{0, 200, 400, 600, 800, 1000});
    CHECK(ColourScale(ColourScaleKind::linear, 2500.0).round_values(6) ==
          std::vector<double>{0, 500, 1000, 1500, 2000, 2500});
    CHECK(ColourScale(ColourScaleKind::logarithmic, 1000.0, 2.0).round_values(9) ==
          std::vector<double>{10, 20, 50, 100, 200, 500, 1000});
    CHECK(ColourScale(ColourScaleKind::logarithmic, 1000.0, 3.0).round_values(5) ==
          std::vector<double>{1, 10, 100, 1000});
    for (const double maximum : {1e-8, 0.37, 1.0, 7.7, 99.0, 123456.0}) {
        for (const auto kind : {ColourScaleKind::linear, ColourScaleKind::logarithmic}) {
            for (const int most : {2, 5, 12}) {
                INFO(maximum << " " << most);
                const ColourScale scale(kind, maximum, 6.0);
                const std::vector<double> values = scale.round_values(most);
                CHECK(static_cast<int>(values.size()) <= most);
                CHECK(values.size() >= 1);
                for (const double value : values)
                    CHECK(value <= maximum * (1.0 + 1e-9));
            }
        }
    }
}

TEST_CASE("an automatic maximum is round and just above the field", "[core][false_colour]") {
    CHECK(round_maximum(std::vector{3.0, 7230.0}) == 8000.0);
    CHECK(round_maximum(std::vector{0.0201}) == 0.025);
    CHECK(round_maximum(std::vector{1000.0}) == 1000.0);
    CHECK(round_maximum(std::vector{0.0, -4.0}) == 1.0);
    CHECK(round_maximum(std::vector{std::nan(""), 9.9, std::numeric_limits<double>::infinity()}) == 10.0);
    CHECK(round_maximum({}) == 1.0);
}

TEST_CASE("a legend writes numbers as people do", "[core][false_colour]") {
    CHECK(round_text(0.0) == "0");
    CHECK(round_text(12500.0) == "12500");
    CHECK(round_text(0.05) == "0.05");
    CHECK(round_text(2.5) == "2.5");
    CHECK(round_text(1e9) == "1e+09");
}
