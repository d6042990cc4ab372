#include "core/spectrum.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/colour.h"
#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;

namespace {

Spectrum column(const tests::CsvTable& table, const std::string& name) {
    Spectrum spectrum;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        spectrum.wavelength_nm.push_back(table.number(row, "wavelength_nm"));
        spectrum.value.push_back(table.number(row, name));
    }
    return spectrum;
}

constexpr double printed = 0.5e-5 * 1.001;  // five decimals

}  // namespace

TEST_CASE("the tables in the program are those of the CIE", "[core][colour]") {
    const auto observer = tests::read_csv("cie1931_2deg_5nm.csv"), d65 = tests::read_csv("cie_d65_5nm.csv"),
               components = tests::read_csv("cie_daylight_components_5nm.csv");
    REQUIRE(observer.rows.size() == table_wavelengths);
    for (std::size_t k = 0; k < table_wavelengths; ++k) {
        for (const auto* table : {&observer, &d65, &components})
            CHECK(table->number(k, "wavelength_nm") == table_wavelength_nm(k));
        const glm::dvec3 xyz(observer.number(k, "xbar"), observer.number(k, "ybar"), observer.number(k, "zbar"));
        CHECK(cie_1931_observer[k] == xyz);
        CHECK(cie_d65[k] == d65.number(k, "relative_power"));
        const glm::dvec3 s(components.number(k, "S0"), components.number(k, "S1"), components.number(k, "S2"));
        CHECK(cie_daylight_components[k] == s);
    }
}

TEST_CASE("D65 is daylight of 6503.6 K", "[core][physics][colour]") {
    const SpectrumTable<double> power = daylight_spectrum(6503.6);
    for (std::size_t k = 0; k < table_wavelengths; ++k)  // the table of D65 has six digits
        CHECK_THAT(power[k] / cie_d65[k], WithinAbs(1.0, 1e-5));
    const Chromaticity white = daylight_chromaticity(6503.6);
    CHECK_THAT(white.x, WithinAbs(0.3127, 0.5e-4));
    CHECK_THAT(white.y, WithinAbs(0.3291, 0.5e-4));
}

TEST_CASE("the spectrum of a daylight has the chromaticity of its temperature", "[core][physics][colour]") {
    // The formula of the locus fits the spectra to 3e-4 in x and y.
    for (const double cct_k : {4000.0, 5003.0, 7000.0, 7504.0, 12000.0, 25000.0}) {
        const glm::dvec3 xyY = xyY_from_xyz(xyz_under(daylight_spectrum(cct_k), {{560.0}, {1.0}}));
        const Chromaticity locus = daylight_chromaticity(cct_k);
        INFO(cct_k << " K");
        CHECK_THAT(xyY.x, WithinAbs(locus.x, 5e-4));
        CHECK_THAT(xyY.y, WithinAbs(locus.y, 5e-4));
    }
}

TEST_CASE("between samples a spectrum is a straight line, beyond them level", "[core][colour]") {
    const Spectrum spectrum{{400.0, 500.0, 600.0}, {0.2, 0.6, 0.4}};
    CHECK(spectrum.at(380.0) == 0.2);
    CHECK(spectrum.at(400.0) == 0.2);
    CHECK_THAT(spectrum.at(425.0), WithinAbs(0.3, 1e-15));
    CHECK(spectrum.at(500.0) == 0.6);
    CHECK(spectrum.at(700.0) == 0.4);
}

TEST_CASE("the chart's spectra have its tabulated colours and bands", "[core][physics][colour]") {
    const auto spectra = tests::read_csv("macbeth24_reflectance_5nm.csv");
    const auto colours = tests::read_csv("macbeth24_d65.csv");
    const Primaries srgb(PrimariesName::srgb), p22(PrimariesName::p22), ebu(PrimariesName::ebu);
    for (std::size_t row = 0; row < colours.rows.size(); ++row) {
        const auto number = [&](const char* name) { return colours.number(row, name); };
        INFO(colours.text(row, "name"));
        const Spectrum spectrum = column(spectra, colours.text(row, "name"));
        const glm::dvec3 xyz = xyz_under_d65(spectrum);
        CHECK_THAT(xyz.x, WithinAbs(number("X"), printed));
        CHECK_THAT(xyz.y, WithinAbs(number("Y"), printed));
        CHECK_THAT(xyz.z, WithinAbs(number("Z"), printed));
        for (const auto& [primaries, suffix] :
             {std::pair{&srgb, std::string("srgb")}, {&p22, std::string("p22")}, {&ebu, std::string("ebu")}}) {
            const Band3 band = primaries->from_xyz(xyz);
            CHECK_THAT(band.r, WithinAbs(colours.number(row, "rhoR_" + suffix), printed));
            CHECK_THAT(band.g, WithinAbs(colours.number(row, "rhoG_" + suffix), printed));
            CHECK_THAT(band.b, WithinAbs(colours.number(row, "rhoB_" + suffix), printed));
        }
        const FittedBands fitted = bands_from_spectrum(srgb, spectrum, 1.0);
        CHECK_THAT(fitted.desaturation.saturation_kept, WithinAbs(number("clip_t"), 0.5e-4));
        CHECK_THAT(fitted.band.r, WithinAbs(number("rhoR_clip"), printed));
        CHECK_THAT(fitted.band.g, WithinAbs(number("rhoG_clip"), printed));
        CHECK_THAT(fitted.band.b, WithinAbs(number("rhoB_clip"), printed));
    }
}

TEST_CASE("glass in steps of 10 nm gets the tabulated bands", "[core][physics][colour][glazing]") {
    const auto spectra = tests::read_csv("glazing_spectral_10nm.csv");
    const auto bands = tests::read_csv("glazing_bands.csv");
    const auto phosphors = tests::read_csv("crt_phosphor_spectra_5nm.csv");
    REQUIRE(bands.rows.size() == 9);
    // The 41 transmittances have five decimals as well: 5e-6 / sqrt(3 x 41) on average, times at most 5.3 for the bands.
    constexpr double rounded = printed + 2.4e-6;
    const Primaries srgb(PrimariesName::srgb), p22(PrimariesName::p22);
    for (std::size_t row = 0; row < bands.rows.size(); ++row) {
        INFO(bands.text(row, "glazing"));
        const Spectrum spectrum = column(spectra, "T_" + bands.text(row, "glazing"));
        const glm::dvec3 xyz = xyz_under_d65(spectrum), xyY = xyY_from_xyz(xyz);
        CHECK_THAT(xyz.y, WithinAbs(bands.number(row, "tau_v_D65"), rounded));
        CHECK_THAT(xyY.x, WithinAbs(bands.number(row, "x_D65"), rounded));
        CHECK_THAT(xyY.y, WithinAbs(bands.number(row, "y_D65"), rounded));
        CHECK_THAT(spectrum.at(550.0), WithinAbs(bands.number(row, "T_550nm"), rounded));
        for (const auto& [primaries, suffix] : {std::pair{&srgb, std::string("srgb")}, {&p22, std::string("p22")}}) {
            const FittedBands fitted = bands_from_spectrum(*primaries, spectrum, 1.0);
            CHECK(fitted.desaturation.saturation_kept == 1.0);
            CHECK_THAT(fitted.band.r, WithinAbs(bands.number(row, "tauR_" + suffix), rounded));
            CHECK_THAT(fitted.band.g, WithinAbs(bands.number(row, "tauG_" + suffix), rounded));
            CHECK_THAT(fitted.band.b, WithinAbs(bands.number(row, "tauB_" + suffix), rounded));
        }
        // The alternative that naturel does not take, for what it is worth: weights phosphor x luminosity.
        for (const std::string band : {"R", "G", "B"}) {
            double through = 0.0, all = 0.0;
            for (std::size_t k = 0; k < table_wavelengths; ++k) {
                const double weight = phosphors.number(k, band) * cie_1931_observer[k].y;
                all += weight, through += weight * spectrum.at(table_wavelength_nm(k));
            }
            CHECK_THAT(through / all, WithinAbs(bands.number(row, "tau" + band + "_phosphorV"), rounded));
        }
    }
}

TEST_CASE("phosphors of a colour tube have their known chromaticities", "[core][physics][colour]") {
    const auto phosphors = tests::read_csv("crt_phosphor_spectra_5nm.csv");
    const auto chromaticity = [&](const char* name) {
        glm::dvec3 sum(0.0);
        for (std::size_t k = 0; k < table_wavelengths; ++k)
            sum += phosphors.number(k, name) * cie_1931_observer[k];
        return xyY_from_xyz(sum);
    };
    const glm::dvec3 r = chromaticity("R"), g = chromaticity("G"), b = chromaticity("B");
    for (const auto& [value, published] :
         {std::pair{r.x, 0.6189}, {r.y, 0.3440}, {g.x, 0.2765}, {g.y, 0.6049}, {b.x, 0.1512}, {b.y, 0.0611}})
        CHECK_THAT(value, WithinAbs(published, 0.51e-4));
    CHECK(can_mix_d65({{{r.x, r.y}, {g.x, g.y}, {b.x, b.y}}}));
}

TEST_CASE("a sphere painted all over shows how far three bands are from the spectrum", "[core][physics][colour]") {
    const auto table = tests::read_csv("threeband_sphere_vectors.csv");
    const auto spectra = tests::read_csv("macbeth24_reflectance_5nm.csv");
    REQUIRE(table.rows.size() == 10);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const std::string wall = table.text(row, "wall");
        INFO(wall);
        const Spectrum reflectance = column(spectra, wall);
        Spectrum reflected = reflectance;
        for (double& value : reflected.value)
            value /= 1.0 - value;  // all interreflections of an evenly lit sphere
        const glm::dvec3 spectral = xyz_under_d65(reflected);
        const auto expected = [&](const std::string& suffix) {
            return glm::dvec3(table.number(row, "X_" + suffix), table.number(row, "Y_" + suffix),
                              table.number(row, "Z_" + suffix));
        };
        const auto agree = [](const glm::dvec3& a, const glm::dvec3& b) {
            for (int k = 0; k < 3; ++k)
                CHECK_THAT(a[k], WithinAbs(b[k], printed));
        };
        agree(spectral, expected("spectral"));
        for (const auto& [name, suffix] :
             {std::pair{PrimariesName::srgb, std::string("srgb")}, {PrimariesName::p22, std::string("p22")}}) {
            const Primaries primaries(name);
            const Band3 rho = bands_from_spectrum(primaries, reflectance, 1.0).band;
            const glm::dvec3 banded =
                primaries.xyz({rho.r / (1.0 - rho.r), rho.g / (1.0 - rho.g), rho.b / (1.0 - rho.b)});
            agree(banded, expected("3band_" + suffix));
            CHECK_THAT(banded.y / spectral.y - 1.0, WithinAbs(table.number(row, "Yerr_" + suffix), printed));
        }
    }
}

TEST_CASE("a spectrum of one value is grey within the four digits of D65, and never out of gamut",
          "[core][physics][colour]") {
    const double value = GENERATE(0.0, 0.3, 0.99, 1.0);
    const FittedBands fitted =
        bands_from_spectrum(Primaries(PrimariesName::srgb), {{550.0}, {value}}, std::max(value, 0.5));
    CHECK(fitted.desaturation.saturation_kept == 1.0);
    for (const double band : {fitted.band.r, fitted.band.g, fitted.band.b})
        CHECK_THAT(band, WithinAbs(value, 2.8e-4 * value + 1e-15));
}
