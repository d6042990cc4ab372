#include "core/glazing.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "tests/catch.h"
#include "tests/csv_table.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double n = 1.52;

Glazing glazing_of(AngularLaw law, const Band3& normal_transmittance, int panes = 1) {
    Glazing glazing;
    glazing.angular_law = law;
    glazing.normal_transmittance = normal_transmittance;
    glazing.panes = panes;
    return glazing;
}

double cos_deg(double incidence_deg) {
    return std::cos(radians_from_degrees(incidence_deg));
}

/// 2 x integral of the transmittance times c dc: midpoint rule in the root of c.
double diffuse_by_midpoints(const GlazingTransmission& glazing) {
    constexpr int count = 20000;
    double sum = 0.0;
    for (int k = 0; k < count; ++k) {
        const double t = (k + 0.5) / count;
        sum += glazing.transmittance(t * t).g * 4.0 * t * t * t / count;
    }
    return sum;
}

}  // namespace

TEST_CASE("glazings follow the tabulated angular laws", "[core][physics][glazing]") {
    const tests::CsvTable table = tests::read_csv("glazing_angular.csv");
    REQUIRE(table.rows.size() == 20);
    const GlazingTransmission mitalas(glazing_of(AngularLaw::mitalas, grey(1.0)));
    const GlazingTransmission mitalas_clear(glazing_of(AngularLaw::mitalas, grey(0.87881)));
    const GlazingTransmission rivero(glazing_of(AngularLaw::rivero, grey(1.0)));
    const GlazingTransmission single(glazing_of(AngularLaw::fresnel, grey(0.88)));
    const GlazingTransmission two_panes(glazing_of(AngularLaw::fresnel, grey(0.7792013), 2));
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const auto number = [&](const char* column) { return table.number(row, column); };
        INFO("incidence " << number("incidence_deg") << " degrees");
        const double c = cos_deg(number("incidence_deg"));
        // Six decimals, and for the Fresnel law the table of GlazingTransmission (1e-6).
        constexpr double printed = 0.51e-6;
        CHECK_THAT(mitalas.transmittance(c).g, WithinAbs(std::max(0.0, number("mitalas_norm")), printed));
        CHECK_THAT(mitalas_clear.transmittance(c).g,
                   WithinAbs(std::max(0.0, number("mitalas_arseneault_abs")), printed));
        CHECK_THAT(rivero.transmittance(c).g, WithinAbs(number("rivero_norm") / 1.018, printed));
        CHECK_THAT(single.transmittance(c).g, WithinAbs(number("fresnel_n1.52_Tn0.88_abs"), printed + 1e-6));
        CHECK_THAT(two_panes.transmittance(c).g, WithinAbs(number("double_0.88x2_abs"), printed + 1e-6));
    }
}

TEST_CASE("every law gives the normal transmittance at normal incidence", "[core][physics][glazing]") {
    const AngularLaw law =
        GENERATE(AngularLaw::fresnel, AngularLaw::mitalas, AngularLaw::rivero, AngularLaw::constant);
    const int panes = GENERATE(1, 2, 3, 7);
    // 0.95 and 1 are more than one pane of lossless glass lets through (0.918), 0.7 more than seven.
    const Band3 normal = GENERATE(Band3{0.0, 0.88, 1.0}, Band3{0.7, 0.05, 0.95}, Band3{1e-9, 0.9, 0.4});
    INFO("law " << static_cast<int>(law) << ", panes " << panes);
    const GlazingTransmission glazing(glazing_of(law, normal, panes));
    const Band3 at_normal = glazing.transmittance(1.0);
    CHECK_THAT(at_normal.r, WithinAbs(normal.r, 1e-14));
    CHECK_THAT(at_normal.g, WithinAbs(normal.g, 1e-14));
    CHECK_THAT(at_normal.b, WithinAbs(normal.b, 1e-14));
}

TEST_CASE("a glass of 88 % lets 95.8415 % survive between its faces", "[core][physics][glazing]") {
    // Radiance's glass for the same normal transmittance; six decimals.
    CHECK_THAT(multi_pane_transmittance(1.0, 0.958415, 1, n), WithinAbs(0.88, 0.5e-6));
    const double r = 0.52 * 0.52 / (2.52 * 2.52);
    CHECK_THAT(multi_pane_transmittance(1.0, 1.0, 1, n), WithinAbs((1.0 - r) / (1.0 + r), 1e-15));
}

TEST_CASE("a prepared glazing is within 1e-6 of the Fresnel formula", "[core][physics][glazing]") {
    const int panes = GENERATE(1, 2, 3, 4, 8);
    // From opaque to lossless: the less a pane absorbs, the sharper the bend at grazing incidence.
    const double pane = GENERATE(0.01, 0.5, 0.9, 0.958415, 0.99, 0.999, 0.9999, 1.0);
    INFO(panes << " panes of internal transmittance " << pane);
    const double normal = multi_pane_transmittance(1.0, pane, panes, n);
    const GlazingTransmission glazing(glazing_of(AngularLaw::fresnel, grey(normal), panes));
    double worst = 0.0;
    constexpr int count = 20000;
    for (int k = 0; k <= count; ++k) {
        const double root = static_cast<double>(k) / count;
        const double c = root * root;
        const double exact = multi_pane_transmittance(c, pane, panes, n);
        worst = std::max(worst, std::abs(glazing.transmittance(c).g - exact));
    }
    CHECK(worst < 1e-6);
}

TEST_CASE("a glazing clearer than lossless glass keeps the lossless curve, scaled",
          "[core][physics][glazing]") {
    const GlazingTransmission glazing(glazing_of(AngularLaw::fresnel, {1.0, 0.95, 0.88}));
    const double lossless = multi_pane_transmittance(1.0, 1.0, 1, n);
    for (const double incidence_deg : {20.0, 60.0, 80.0, 89.0}) {
        INFO("incidence " << incidence_deg << " degrees");
        const double c = cos_deg(incidence_deg);
        const double shape = multi_pane_transmittance(c, 1.0, 1, n) / lossless;
        CHECK_THAT(glazing.transmittance(c).r, WithinAbs(shape, 1e-6));
        CHECK_THAT(glazing.transmittance(c).g, WithinAbs(0.95 * shape, 1e-6));
    }
}

TEST_CASE("light is reflected, transmitted or absorbed by a slab", "[core][physics][glazing][property]") {
    for (const double pane : {0.0, 0.3, 0.95, 1.0}) {
        for (const double c : {0.0, 1e-300, 1e-17, 1e-9, 1e-3, 0.1, 0.5, 0.9, 1.0}) {
            INFO("internal transmittance " << pane << ", cosine " << c);
            const SlabResponse slab = slab_response(c, pane, n);
            for (const auto& [t, r] : {std::pair{slab.transmittance_s, slab.reflectance_s},
                                       std::pair{slab.transmittance_p, slab.reflectance_p}}) {
                CHECK(t >= 0.0);
                CHECK(r >= 0.0);
                if (pane == 1.0) {
                    CHECK_THAT(t + r, WithinAbs(1.0, 1e-14));
                } else {
                    CHECK(t + r <= 1.0 + 1e-15);
                }
                if (pane == 0.0) CHECK(t == 0.0);
            }
        }
    }
}

TEST_CASE("at the Brewster angle lossless glass lets p-polarised light pass whole",
          "[core][physics][glazing][analytic]") {
    const SlabResponse slab = slab_response(1.0 / std::sqrt(1.0 + n * n), 1.0, n);
    CHECK_THAT(slab.transmittance_p, WithinAbs(1.0, 1e-14));
    const double r = std::pow((1.0 - n * n) / (1.0 + n * n), 2.0);  // one face, s
    CHECK_THAT(slab.transmittance_s, WithinAbs((1.0 - r) / (1.0 + r), 1e-14));
}

TEST_CASE("lossless panes transmit (1 - r) / (1 + (2 N - 1) r) per polarisation",
          "[core][physics][glazing][analytic]") {
    const int panes = GENERATE(1, 2, 3, 4, 10);
    for (const double c : {1e-17, 1e-9, 1e-4, 0.02, 0.3, 0.7, 1.0}) {
        INFO(panes << " panes, cosine " << c);
        const double ct = std::sqrt(1.0 - (1.0 - c * c) / (n * n));
        const auto pile = [&](double a, double b) {
            const double entering = 4.0 * a * b / ((a + b) * (a + b));  // 1 - r
            return entering / (1.0 + (2 * panes - 1) * (1.0 - entering));
        };
        const double expected = 0.5 * (pile(c, n * ct) + pile(n * c, ct));
        // Where both sides go to 0 the pile keeps 1 - R r to 2e-16, of a value of about the transmittance
        // itself.
        CHECK_THAT(multi_pane_transmittance(c, 1.0, panes, n), WithinAbs(expected, 2e-15));
    }
}

TEST_CASE("two absorbing panes sum all reflections between them", "[core][physics][glazing]") {
    for (const double c : {0.1, 0.5, 1.0}) {
        const SlabResponse slab = slab_response(c, 0.9, n);
        double s = 0.0, p = 0.0;
        for (int bounces = 0; bounces < 200; ++bounces) {  // at c = 0.1 a round trip keeps 0.45 of s
            s += std::pow(slab.transmittance_s, 2.0) * std::pow(slab.reflectance_s, 2.0 * bounces);
            p += std::pow(slab.transmittance_p, 2.0) * std::pow(slab.reflectance_p, 2.0 * bounces);
        }
        CHECK_THAT(multi_pane_transmittance(c, 0.9, 2, n), WithinAbs(0.5 * (s + p), 1e-14));
    }
}

TEST_CASE("transmittance falls with the angle, to nothing at grazing incidence",
          "[core][physics][glazing][property]") {
    const int panes = GENERATE(1, 2, 3, 10);
    const double normal = GENERATE(0.2, 0.88, 1.0);
    INFO(panes << " panes, normal transmittance " << normal);
    const GlazingTransmission glazing(glazing_of(AngularLaw::fresnel, grey(normal), panes));
    CHECK(glazing.transmittance(0.0).g == 0.0);
    double before = 0.0;
    for (int k = 1; k <= 1000; ++k) {
        const double value = glazing.transmittance(k / 1000.0).g;
        CHECK(value <= 1.0);
        CHECK(value > 0.0);
        // A pile of ten is brightest near its Brewster angle.
        if (panes <= 3) CHECK(value >= before - 1e-15);
        before = value;
    }
}

TEST_CASE("cosines outside [0, 1] by rounding are grazing or normal incidence", "[core][physics][glazing]") {
    const AngularLaw law =
        GENERATE(AngularLaw::fresnel, AngularLaw::mitalas, AngularLaw::rivero, AngularLaw::constant);
    const GlazingTransmission glazing(glazing_of(law, grey(0.88)));
    CHECK(glazing.transmittance(-1e-16) == glazing.transmittance(0.0));
    CHECK(glazing.transmittance(1.0 + 1e-15) == glazing.transmittance(1.0));
}

TEST_CASE("a constant glazing is the same at every angle", "[core][physics][glazing]") {
    const GlazingTransmission glazing(glazing_of(AngularLaw::constant, {0.3, 0.6, 1.0}));
    for (const double c : {0.0, 1e-6, 0.4, 1.0})
        CHECK(glazing.transmittance(c) == Band3{0.3, 0.6, 1.0});
    CHECK_THAT(glazing.diffuse_transmittance().r, WithinRel(0.3, 1e-14));
    CHECK_THAT(glazing.diffuse_transmittance().b, WithinRel(1.0, 1e-14));
}

TEST_CASE("diffuse transmittance is the cosine-weighted mean over the angles", "[core][physics][glazing]") {
    struct Case {
        AngularLaw law;
        double normal;
        int panes;
        double share;  // of the normal transmittance, three decimals
    };
    const double pane = 0.958415;  // 88 % each
    const auto known = GENERATE_COPY(
        values<Case>({{AngularLaw::fresnel, 0.88, 1, 0.915},
                      {AngularLaw::fresnel, multi_pane_transmittance(1.0, pane, 2, n), 2, 0.888},
                      {AngularLaw::fresnel, multi_pane_transmittance(1.0, pane, 3, n), 3, 0.874},
                      {AngularLaw::mitalas, 0.87881, 1, 0.917},
                      {AngularLaw::rivero, 0.88, 1, 0.87855 / 1.018}}));
    INFO("law " << static_cast<int>(known.law) << ", panes " << known.panes);
    const GlazingTransmission glazing(glazing_of(known.law, grey(known.normal), known.panes));
    const double diffuse = glazing.diffuse_transmittance().g;
    CHECK_THAT(diffuse / known.normal, WithinAbs(known.share, 0.51e-3));
    // The rule's nodes meet the corners of the linear table: as good as the table itself, 1e-6.
    CHECK_THAT(diffuse, WithinAbs(diffuse_by_midpoints(glazing), 1e-6));
}

TEST_CASE("the diffuse transmittance of Rivero's law is 2/3 + pi/16 of the normal one",
          "[core][physics][glazing][analytic]") {
    const GlazingTransmission glazing(glazing_of(AngularLaw::rivero, grey(1.0)));
    // Gauss-Legendre meets sin^3, a power of 3/2 at normal incidence: error of order 64^-5 = 1e-9.
    CHECK_THAT(glazing.diffuse_transmittance().g, WithinAbs(2.0 / 3.0 + pi / 16.0, 1e-8));
}

TEST_CASE("maintenance and frame multiply the transmittance at every angle", "[core][physics][glazing]") {
    const AngularLaw law =
        GENERATE(AngularLaw::fresnel, AngularLaw::mitalas, AngularLaw::rivero, AngularLaw::constant);
    Glazing plain = glazing_of(law, {0.5, 0.7, 0.88});
    Glazing dirty = plain;
    dirty.maintenance = 0.8;
    dirty.frame = 0.75;
    const GlazingTransmission clean(plain), used(dirty);
    for (const double c : {0.05, 0.4, 1.0}) {
        CHECK_THAT(used.transmittance(c).r, WithinRel(0.6 * clean.transmittance(c).r, 1e-14));
        CHECK_THAT(used.transmittance(c).b, WithinRel(0.6 * clean.transmittance(c).b, 1e-14));
    }
    CHECK_THAT(used.diffuse_transmittance().g, WithinRel(0.6 * clean.diffuse_transmittance().g, 1e-14));
}

TEST_CASE("the bands of a glazing do not know each other", "[core][physics][glazing][property]") {
    const GlazingTransmission coloured(glazing_of(AngularLaw::fresnel, {0.3, 0.6, 0.88}, 2));
    const GlazingTransmission permuted(glazing_of(AngularLaw::fresnel, {0.88, 0.3, 0.6}, 2));
    for (const double c : {0.1, 0.33, 0.8}) {
        const Band3 a = coloured.transmittance(c), b = permuted.transmittance(c);
        CHECK(Band3{a.b, a.r, a.g} == b);
    }
}

TEST_CASE("the diffuse law is the diffuse transmittance at every angle", "[core][physics][glazing]") {
    for (const int panes : {1, 2}) {
        const GlazingTransmission fresnel(glazing_of(AngularLaw::fresnel, {0.3, 0.6, 0.78}, panes));
        const GlazingTransmission diffuse(glazing_of(AngularLaw::diffuse, {0.3, 0.6, 0.78}, panes));
        for (const double c : {0.0, 0.2, 1.0})
            CHECK(diffuse.transmittance(c) == fresnel.diffuse_transmittance());
        CHECK(diffuse.diffuse_transmittance() == fresnel.diffuse_transmittance());
    }
}

TEST_CASE("Radiance's transmissivity of a normal transmittance and back", "[core][physics][glazing]") {
    for (const double T : {0.05, 0.5, 0.88, 0.91}) {
        // Radiance's own formula, with constants for the index 1.52; they have ten digits, divided by 0.0036 T.
        const double radiance =
            (std::sqrt(0.8402528435 + 0.0072522239 * T * T) - 0.9166530661) / 0.0036261119 / T;
        CHECK_THAT(internal_transmittance(T, 1, n), WithinAbs(radiance, 1e-10 / (0.0036 * T) + 1e-8));
    }
    for (const int panes : {1, 2, 3, 4})
        for (const double index : {1.3, 1.52, 1.9})
            for (const double pane : {0.0, 0.2, 0.9, 0.99}) {
                INFO(panes << " panes, index " << index << ", internal " << pane);
                const double T = multi_pane_transmittance(1.0, pane, panes, index);
                CHECK_THAT(internal_transmittance(T, panes, index), WithinAbs(pane, 1e-13));
            }
}

TEST_CASE("a slab follows its refractive index", "[core][physics][glazing]") {
    Glazing glazing = glazing_of(AngularLaw::fresnel, grey(multi_pane_transmittance(1.0, 0.95, 2, 1.7)), 2);
    glazing.refractive_index = 1.7;
    const GlazingTransmission two(glazing);
    for (const double c : {0.05, 0.3, 0.8, 1.0})
        CHECK_THAT(two.transmittance(c).g, WithinAbs(multi_pane_transmittance(c, 0.95, 2, 1.7), 1e-6));
}

TEST_CASE("clear panes reflect diffuse light as tabulated", "[core][physics][glazing]") {
    const double pane = 0.958415;  // 88 % each
    for (const auto& [panes, known] : {std::pair{1, 0.148}, {2, 0.217}, {3, 0.262}}) {
        const Glazing glazing =
            glazing_of(AngularLaw::fresnel, grey(multi_pane_transmittance(1.0, pane, panes, n)), panes);
        CHECK_THAT(pane_reflectance(glazing).g, WithinAbs(known, 0.51e-3));
    }
}

TEST_CASE("what a pile does not transmit or reflect it absorbs", "[core][physics][glazing][property]") {
    const int panes = GENERATE(1, 2, 3, 4);
    for (const double c : {0.02, 0.3, 0.9, 1.0}) {
        const PileResponse lossless = multi_pane_response(c, 1.0, panes, n);
        CHECK_THAT(lossless.transmittance + lossless.reflectance, WithinAbs(1.0, 1e-13));
        const PileResponse tinted = multi_pane_response(c, 0.7, panes, n);
        CHECK(tinted.transmittance + tinted.reflectance < 1.0);
    }
}

TEST_CASE("no glazing gives more light than it gets by the reflectance naturel gives it",
          "[core][physics][glazing][property]") {
    const AngularLaw law = GENERATE(AngularLaw::fresnel, AngularLaw::mitalas, AngularLaw::rivero,
                                    AngularLaw::constant, AngularLaw::diffuse);
    const int panes = GENERATE(1, 2, 4);
    for (const double T : {0.0, 0.3, 0.88, 0.95, 1.0}) {
        INFO("law " << static_cast<int>(law) << ", " << panes << " panes, transmittance " << T);
        Glazing glazing = glazing_of(law, grey(T), panes);
        glazing.frame = 0.8;
        const Band3 reflectance = pane_reflectance(glazing);
        CHECK(reflectance.g >= 0.0);
        CHECK(GlazingTransmission(glazing).diffuse_transmittance().g + reflectance.g <= 1.0 + 1e-12);
        if (law == AngularLaw::constant) CHECK(reflectance == grey(0.0));
    }
}

TEST_CASE("a measured reflectance scales that of clear panes", "[core][physics][glazing]") {
    const Glazing glazing = glazing_of(AngularLaw::fresnel, grey(0.5));
    const double clear = multi_pane_response(1.0, internal_transmittance(0.5, 1, n), 1, n).reflectance;
    const Band3 coated = pane_reflectance(glazing, Band3{clear, 2.0 * clear, 0.0});
    CHECK_THAT(coated.r, WithinRel(pane_reflectance(glazing).r, 1e-12));
    CHECK_THAT(coated.g, WithinRel(2.0 * pane_reflectance(glazing).g, 1e-12));
    CHECK(coated.b == 0.0);
}

TEST_CASE("a table of angles is met at its angles and a smooth law between them", "[core][physics][glazing]") {
    const double step_deg = GENERATE(5.0, 10.0);
    Glazing table = glazing_of(AngularLaw::table, grey(0.88));
    for (double angle_deg = 0.0; angle_deg <= 90.0; angle_deg += step_deg) {
        const double T = angle_deg == 90.0 ? 0.0 : multi_pane_transmittance(cos_deg(angle_deg), 0.958415, 1, n);
        table.angular_table.push_back({radians_from_degrees(angle_deg), {T, 0.5 * T, 0.0}});
    }
    const GlazingTransmission glazing(table);
    for (const AngularSample& sample : table.angular_table) {
        const Band3 T = glazing.transmittance(std::cos(sample.incidence_rad));
        CHECK_THAT(T.r, WithinAbs(sample.transmittance.r, 2e-6));  // linear between 2048 places
        CHECK_THAT(T.g, WithinAbs(sample.transmittance.g, 2e-6));
        CHECK(T.b == 0.0);
    }
    double worst = 0.0, worst_grazing = 0.0;
    for (double angle_deg = 0.0; angle_deg < 90.0; angle_deg += 0.37) {
        const double gap = std::abs(glazing.transmittance(cos_deg(angle_deg)).r -
                                    multi_pane_transmittance(cos_deg(angle_deg), 0.958415, 1, n));
        (angle_deg < 80.0 ? worst : worst_grazing) = std::max(angle_deg < 80.0 ? worst : worst_grazing, gap);
    }
    // Measured 0.011 beyond 80 degrees, where no sample says how the law bends.
    INFO("worst " << worst << ", beyond 80 degrees " << worst_grazing);
    CHECK(worst < (step_deg == 5.0 ? 0.001 : 0.006));
    CHECK(worst_grazing < 0.012);
    CHECK_THAT(glazing.diffuse_transmittance().r,
               WithinAbs(GlazingTransmission(glazing_of(AngularLaw::fresnel, grey(0.88))).diffuse_transmittance().r, 1e-3));
}

TEST_CASE("between the angles of a table transmittance stays between their values", "[core][glazing][property]") {
    Glazing table = glazing_of(AngularLaw::table, grey(0.9));
    const std::vector<std::pair<double, double>> samples{{0, 0.9}, {10, 0.9}, {11, 0.2}, {50, 0.6}, {60, 0.6}, {90, 0}};
    for (const auto& [angle_deg, T] : samples)
        table.angular_table.push_back({radians_from_degrees(angle_deg), grey(T)});
    const GlazingTransmission glazing(table);
    for (std::size_t k = 0; k + 1 < samples.size(); ++k)
        for (double share = 0.0; share <= 1.0; share += 0.05) {
            const double angle_deg = samples[k].first + share * (samples[k + 1].first - samples[k].first);
            const double T = glazing.transmittance(cos_deg(angle_deg)).g;
            INFO(angle_deg << " degrees");
            // The corner of the steep step is rounded by the table of 2048 places: 0.7 in 1 degree.
            CHECK(T >= std::min(samples[k].second, samples[k + 1].second) - 0.01);
            CHECK(T <= std::max(samples[k].second, samples[k + 1].second) + 0.01);
        }
}
