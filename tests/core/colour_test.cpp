#include "core/colour.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;

namespace {

struct NamedPrimaries {
    PrimariesName name;
    std::string row;     // in rgb_primaries.csv
    std::string suffix;  // of the columns in macbeth24_d65.csv
};

const std::vector<NamedPrimaries> all_primaries{{PrimariesName::srgb, "sRGB_Rec709", "srgb"},
                                                {PrimariesName::ebu, "EBU_PAL_625 (BT.470BG)", "ebu"},
                                                {PrimariesName::p22, "P22_EBU3213E (H.273 #22)", "p22"}};

double smallest(const Band3& a) {
    return std::min({a.r, a.g, a.b});
}

}  // namespace

TEST_CASE("the matrices of the primaries follow from their chromaticities", "[core][physics][colour]") {
    const tests::CsvTable table = tests::read_csv("rgb_primaries.csv");
    for (const NamedPrimaries& set : all_primaries) {
        INFO(set.row);
        const Primaries primaries(set.name);
        const std::size_t row = table.row_where("set", set.row);
        constexpr double printed = 0.51e-8;  // eight decimals
        for (int column = 0; column < 3; ++column) {
            glm::dvec3 unit(0.0);
            unit[column] = 1.0;
            const glm::dvec3 xyz = primaries.xyz({unit.x, unit.y, unit.z});
            const Band3 inverse = primaries.from_xyz(unit);
            const glm::dvec3 band(inverse.r, inverse.g, inverse.b);
            for (int line = 0; line < 3; ++line) {
                const std::string place = std::to_string(line + 1) + std::to_string(column + 1);
                CHECK_THAT(xyz[line], WithinAbs(table.number(row, "M" + place), printed));
                CHECK_THAT(band[line], WithinAbs(table.number(row, "Minv" + place), printed));
            }
        }
    }
}

TEST_CASE("equal bands have the colour of D65 and their own value in light", "[core][physics][colour]") {
    for (const NamedPrimaries& set : all_primaries) {
        INFO(set.row);
        const Primaries primaries(set.name);
        const glm::dvec3 white = primaries.xyz(grey(1.0));
        CHECK_THAT(white.x, WithinAbs(0.950456, 0.51e-6));  // D65 of x 0.3127, y 0.3290, six decimals
        CHECK_THAT(white.y, WithinAbs(1.0, 1e-14));
        CHECK_THAT(white.z, WithinAbs(1.089058, 0.51e-6));
        CHECK_THAT(primaries.luminous(grey(1234.0)), WithinAbs(1234.0, 1e-11));
    }
}

TEST_CASE("a reflectance shows the colour it was made from", "[core][physics][colour]") {
    for (const NamedPrimaries& set : all_primaries) {
        INFO(set.row);
        const Primaries primaries(set.name);
        const glm::dvec3 xyY(0.40, 0.36, 0.30);
        const FittedReflectance fitted = reflectance_from_xyY(primaries, xyY.x, xyY.y, xyY.z, 0.99);
        CHECK(fitted.saturation_kept == 1.0);
        CHECK(glm::length(xyY_from_xyz(primaries.xyz(fitted.reflectance)) - xyY) < 1e-9);
        CHECK_THAT(primaries.luminous(fitted.reflectance), WithinAbs(0.30, 1e-14));
    }
}

TEST_CASE("the colours of the Macbeth chart get the tabulated reflectances", "[core][physics][colour]") {
    const tests::CsvTable table = tests::read_csv("macbeth24_d65.csv");
    REQUIRE(table.rows.size() == 24);
    // X, Y and Z are printed with five decimals and meet matrix rows whose absolute sum is at most 5.3;
    // the reflectances are printed with five decimals too.
    constexpr double printed = 0.5e-5 * (5.3 + 1.0);
    for (const NamedPrimaries& set : all_primaries) {
        const Primaries primaries(set.name);
        for (std::size_t row = 0; row < table.rows.size(); ++row) {
            INFO(set.row << ", " << table.text(row, "name"));
            const glm::dvec3 xyY =
                xyY_from_xyz({table.number(row, "X"), table.number(row, "Y"), table.number(row, "Z")});
            const Band3 band = primaries.from_xyz(xyz_from_xyY(xyY.x, xyY.y, xyY.z));
            CHECK_THAT(band.r, WithinAbs(table.number(row, "rhoR_" + set.suffix), printed));
            CHECK_THAT(band.g, WithinAbs(table.number(row, "rhoG_" + set.suffix), printed));
            CHECK_THAT(band.b, WithinAbs(table.number(row, "rhoB_" + set.suffix), printed));
        }
    }
}

TEST_CASE("of the Macbeth chart only cyan must be desaturated to fit sRGB", "[core][physics][colour]") {
    const tests::CsvTable table = tests::read_csv("macbeth24_d65.csv");
    const Primaries srgb(PrimariesName::srgb);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        INFO(table.text(row, "name"));
        const glm::dvec3 xyY =
            xyY_from_xyz({table.number(row, "X"), table.number(row, "Y"), table.number(row, "Z")});
        const FittedReflectance fitted = reflectance_from_xyY(srgb, xyY.x, xyY.y, xyY.z, 1.0);
        CHECK((fitted.saturation_kept < 1.0) == (table.text(row, "name") == "cyan"));
        // The share kept is Y / (Y - rho_R); an error of 3.2e-5 in rho_R (see above) moves it by 1.2e-4.
        CHECK_THAT(fitted.saturation_kept, WithinAbs(table.number(row, "clip_t"), 1.7e-4));
        CHECK_THAT(fitted.reflectance.r, WithinAbs(table.number(row, "rhoR_clip"), 6e-5));
        CHECK_THAT(fitted.reflectance.g, WithinAbs(table.number(row, "rhoG_clip"), 6e-5));
        CHECK_THAT(fitted.reflectance.b, WithinAbs(table.number(row, "rhoB_clip"), 6e-5));

        // One count: the printed XYZ may lie on the other side of a rounding border.
        const glm::dvec3 display = linear_srgb(srgb, fitted.reflectance);
        CHECK_THAT(255.0 * srgb_curve(display.x), WithinAbs(table.number(row, "sR8"), 1.0));
        CHECK_THAT(255.0 * srgb_curve(display.y), WithinAbs(table.number(row, "sG8"), 1.0));
        CHECK_THAT(255.0 * srgb_curve(display.z), WithinAbs(table.number(row, "sB8"), 1.0));
    }
}

TEST_CASE("a colour that does not fit keeps its luminance and as much saturation as fits",
          "[core][physics][colour][property]") {
    constexpr double limit = 0.99;
    int desaturated = 0;
    for (const NamedPrimaries& set : all_primaries) {
        const Primaries primaries(set.name);
        for (const double x : {0.05, 0.15, 0.25, 0.3127, 0.4, 0.5, 0.6}) {
            for (const double y : {0.05, 0.1, 0.2, 0.329, 0.5, 0.7}) {
                for (const double Y : {0.0, 1e-6, 0.05, 0.3, 0.7, 0.95, 0.99}) {
                    if (x + y > 1.0) continue;
                    INFO(set.row << ", xyY " << x << " " << y << " " << Y);
                    const FittedReflectance fitted = reflectance_from_xyY(primaries, x, y, Y, limit);
                    const Band3& rho = fitted.reflectance;
                    CHECK(smallest(rho) >= 0.0);
                    CHECK(largest(rho) <= limit);
                    CHECK_THAT(primaries.luminous(rho), WithinAbs(Y, 1e-12));
                    // On the straight line from the colour to the grey of the same Y, and at its first
                    // border.
                    const Band3 wanted = primaries.from_xyz(xyz_from_xyY(x, y, Y));
                    const Band3 gap = rho - grey(Y) - fitted.saturation_kept * (wanted - grey(Y));
                    CHECK(largest(gap * gap) < 1e-24);
                    if (fitted.saturation_kept < 1.0) {
                        ++desaturated;
                        CHECK(std::min(smallest(rho), limit - largest(rho)) < 1e-12);
                    }
                }
            }
        }
    }
    CHECK(desaturated > 100);  // or the law above was hardly asked
}

TEST_CASE("greys, black and colours brighter than allowed fit too", "[core][physics][colour]") {
    const Primaries primaries(PrimariesName::ebu);
    const FittedReflectance brightest = reflectance_from_xyY(primaries, 0.3127, 0.3290, 0.99, 0.99);
    CHECK(brightest.saturation_kept == 1.0);
    CHECK(largest(brightest.reflectance) <= 0.99);
    CHECK(smallest(brightest.reflectance) > 0.99 - 1e-12);

    CHECK(reflectance_from_xyY(primaries, 0.3, 0.0, 0.4, 0.99).reflectance == grey(0.0));
    CHECK(reflectance_from_xyY(primaries, 0.3, 0.3, 0.0, 0.99).reflectance == grey(0.0));

    const FittedReflectance too_bright = reflectance_from_xyY(primaries, 0.4, 0.4, 1.2, 0.99);
    CHECK(too_bright.saturation_kept == 0.0);
    CHECK(too_bright.reflectance == grey(0.99));

    CHECK(xyz_from_xyY(0.3, 0.0, 1.0) == glm::dvec3(0.0));
    CHECK(xyY_from_xyz(glm::dvec3(0.0)) == glm::dvec3(0.0));
}

TEST_CASE("bands of any primaries become sRGB by way of XYZ", "[core][physics][colour]") {
    const Band3 band{0.5, 0.2, 0.1};
    const glm::dvec3 same = linear_srgb(Primaries(PrimariesName::srgb), band);
    CHECK(glm::length(same - glm::dvec3(band.r, band.g, band.b)) < 1e-14);
    const glm::dvec3 white = linear_srgb(Primaries(PrimariesName::p22), grey(1.0));
    CHECK(glm::length(white - glm::dvec3(1.0)) < 1e-14);
    // EBU and sRGB share red and blue and differ in green; a pure EBU green lies outside sRGB on the red
    // side.
    const glm::dvec3 green = linear_srgb(Primaries(PrimariesName::ebu), {0.0, 1.0, 0.0});
    CHECK(green.x < 0.0);
    CHECK(green.y > 0.9);
}

TEST_CASE("the sRGB curve is continuous, clamps, and meets its published points", "[core][physics][colour]") {
    CHECK(srgb_curve(-1.0) == 0.0);
    CHECK(srgb_curve(0.0) == 0.0);
    CHECK_THAT(srgb_curve(1.0), WithinAbs(1.0, 1e-15));
    CHECK_THAT(srgb_curve(7.0), WithinAbs(1.0, 1e-15));
    // Middle grey, 18 %: 1.055 x 0.18^(1/2.4) - 0.055.
    CHECK_THAT(srgb_curve(0.18), WithinAbs(0.4613561, 1e-7));
    // On either side of the joint, where line and power part by less than 1e-4.
    CHECK_THAT(srgb_curve(0.003), WithinAbs(12.92 * 0.003, 1e-15));
    CHECK_THAT(srgb_curve(0.0035), WithinAbs(0.0449879071, 1e-10));
    // The standard's rounded constants leave a step of 3e-8 at the joint.
    CHECK_THAT(srgb_curve(0.0031308 + 1e-12), WithinAbs(srgb_curve(0.0031308), 1e-7));
}
