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
    std::string suffix;  // of the columns in macbeth24_d65.csv; empty where it has none
};

const std::vector<NamedPrimaries> all_primaries{{PrimariesName::srgb, "sRGB_Rec709", "srgb"},
                                                {PrimariesName::ebu, "EBU_PAL_625 (BT.470BG)", "ebu"},
                                                {PrimariesName::p22, "P22_EBU3213E (H.273 #22)", "p22"},
                                                {PrimariesName::smpte_c, "SMPTE_C", ""},
                                                {PrimariesName::trinitron_p22, "Trinitron_P22 (Apple RGB)", ""}};

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

TEST_CASE("xyY become bands and come back to 1e-9", "[core][physics][colour]") {
    std::size_t in_gamut = 0;
    for (const NamedPrimaries& set : all_primaries) {
        INFO(set.row);
        const Primaries primaries(set.name);
        for (double x = 0.15; x < 0.66; x += 0.03) {
            for (double y = 0.06; y < 0.62; y += 0.03) {
                for (const double Y : {0.02, 0.3, 0.8}) {
                    const glm::dvec3 xyY(x, y, Y);
                    const FittedBands fitted = reflectance_from_xyY(primaries, x, y, Y, 0.99);
                    if (fitted.desaturation.saturation_kept < 1.0) continue;
                    ++in_gamut;
                    CHECK(glm::length(xyY_from_xyz(primaries.xyz(fitted.band)) - xyY) < 1e-9);
                    CHECK_THAT(primaries.luminous(fitted.band), WithinAbs(Y, 1e-13));
                }
            }
        }
    }
    CHECK(in_gamut > 500);
}

TEST_CASE("a surface of the chromaticity of D65 is grey to the last bit", "[core][physics][colour]") {
    for (const NamedPrimaries& set : all_primaries)
        CHECK(reflectance_from_xyY(Primaries(set.name), 0.3127, 0.3290, 0.37, 0.99).band == grey(0.37));
}

TEST_CASE("custom primaries with the chromaticities of a known set are that set", "[core][physics][colour]") {
    const Primaries ebu(PrimariesName::ebu);
    const Primaries custom(PrimariesDescription{
        .name = PrimariesName::custom, .custom = {{{0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}}}});
    const Band3 band{0.3, 0.7, 0.2};
    CHECK(custom.xyz(band) == ebu.xyz(band));
}

TEST_CASE("D65 is mixed from a triangle around it and from nothing else", "[core][colour]") {
    CHECK(can_mix_d65({{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}}}));
    CHECK(can_mix_d65({{{0.30, 0.60}, {0.64, 0.33}, {0.15, 0.06}}}));  // in any order
    CHECK_FALSE(can_mix_d65({{{0.64, 0.33}, {0.30, 0.60}, {0.45, 0.40}}}));
    CHECK_FALSE(can_mix_d65({{{0.64, 0.33}, {0.64, 0.33}, {0.15, 0.06}}}));
    CHECK_FALSE(can_mix_d65({{{0.1, 0.1}, {0.2, 0.2}, {0.4, 0.4}}}));
}

TEST_CASE("adaptation turns one white into another and leaves its own alone", "[core][physics][colour]") {
    const glm::dvec3 blue_sky(0.96, 1.0, 1.6), d65(0.950456, 1.0, 1.089058);
    CHECK(glm::length(chromatic_adaptation(blue_sky, d65) * blue_sky - d65) < 1e-14);
    CHECK(glm::length(chromatic_adaptation(d65, d65) * blue_sky - blue_sky) < 1e-14);
    // Bradford from illuminant A to D65, published to seven decimals (B. Lindbloom): first row.
    const glm::dmat3 a_to_d65 = chromatic_adaptation({1.09850, 1.0, 0.35585}, {0.95047, 1.0, 1.08883});
    CHECK_THAT(a_to_d65[0].x, WithinAbs(0.8446965, 1e-6));
    CHECK_THAT(a_to_d65[1].x, WithinAbs(-0.1179225, 1e-6));
    CHECK_THAT(a_to_d65[2].x, WithinAbs(0.3948108, 1e-6));
}

TEST_CASE("the colours of the Macbeth chart get the tabulated reflectances", "[core][physics][colour]") {
    const tests::CsvTable table = tests::read_csv("macbeth24_d65.csv");
    REQUIRE(table.rows.size() == 24);
    // X, Y and Z are printed with five decimals and meet matrix rows whose absolute sum is at most 5.3;
    // the reflectances are printed with five decimals too.
    constexpr double printed = 0.5e-5 * (5.3 + 1.0);
    for (const NamedPrimaries& set : all_primaries) {
        if (set.suffix.empty()) continue;
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
        const FittedBands fitted = reflectance_from_xyY(srgb, xyY.x, xyY.y, xyY.z, 1.0);
        CHECK((fitted.desaturation.saturation_kept < 1.0) == (table.text(row, "name") == "cyan"));
        // The share kept is Y / (Y - rho_R); an error of 3.2e-5 in rho_R (see above) moves it by 1.2e-4.
        CHECK_THAT(fitted.desaturation.saturation_kept, WithinAbs(table.number(row, "clip_t"), 1.7e-4));
        CHECK_THAT(fitted.band.r, WithinAbs(table.number(row, "rhoR_clip"), 6e-5));
        CHECK_THAT(fitted.band.g, WithinAbs(table.number(row, "rhoG_clip"), 6e-5));
        CHECK_THAT(fitted.band.b, WithinAbs(table.number(row, "rhoB_clip"), 6e-5));

        // One count: the printed XYZ may lie on the other side of a rounding border.
        const glm::dvec3 display = linear_srgb(srgb, fitted.band);
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
                    const FittedBands fitted = reflectance_from_xyY(primaries, x, y, Y, limit);
                    const Band3& rho = fitted.band;
                    CHECK(smallest(rho) >= 0.0);
                    CHECK(largest(rho) <= limit);
                    CHECK_THAT(primaries.luminous(rho), WithinAbs(Y, 1e-12));
                    // On the straight line from the colour to the grey of the same Y, and at its first
                    // border.
                    const Band3 wanted = primaries.from_xyz(xyz_from_xyY(x, y, Y));
                    const Band3 gap = rho - grey(Y) - fitted.desaturation.saturation_kept * (wanted - grey(Y));
                    CHECK(largest(gap * gap) < 1e-24);
                    if (fitted.desaturation.saturation_kept < 1.0) {
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
    const FittedBands brightest = reflectance_from_xyY(primaries, 0.3127, 0.3290, 0.99, 0.99);
    CHECK(brightest.desaturation.saturation_kept == 1.0);
    CHECK(largest(brightest.band) <= 0.99);
    CHECK(smallest(brightest.band) > 0.99 - 1e-12);

    CHECK(reflectance_from_xyY(primaries, 0.3, 0.0, 0.4, 0.99).band == grey(0.0));
    CHECK(reflectance_from_xyY(primaries, 0.3, 0.3, 0.0, 0.99).band == grey(0.0));

    const FittedBands too_bright = reflectance_from_xyY(primaries, 0.4, 0.4, 1.2, 0.99);
    CHECK(too_bright.desaturation.saturation_kept == 0.0);
    CHECK(too_bright.band == grey(0.99));

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
