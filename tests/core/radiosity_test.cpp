#include "core/radiosity.h"

#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinRel;

namespace {

/// An enclosure with everything solve_radiosity() asks for.
struct Case {
    FormFactors form_factors;
    std::vector<double> area_m2;
    std::vector<PatchOptics> optics;
    std::vector<LightBySource> direct_lx;

    RadiositySolution solve(const RadiosityOptions& options = {}) const {
        NoProgress quiet;
        return solve_radiosity(form_factors, area_m2, optics, direct_lx, options, quiet);
    }
};

FormFactors from_table(const std::vector<std::vector<double>>& table) {
    FormFactors f;
    f.row_begin.push_back(0);
    for (const std::vector<double>& row : table) {
        for (std::size_t j = 0; j < row.size(); ++j) {
            if (row[j] == 0.0) continue;
            f.column.push_back(static_cast<std::uint32_t>(j));
            f.value.push_back(row[j]);
        }
        f.row_begin.push_back(f.column.size());
    }
    return f;
}

double noise(std::size_t i, unsigned seed) {
    std::uint64_t x = (seed * 0x9e3779b97f4a7c15ull) ^ (i * 0xbf58476d1ce4e5b9ull);
    x = (x ^ (x >> 31)) * 0xd6e8feb86659fd93ull;
    return static_cast<double>((x ^ (x >> 32)) >> 11) * 0x1p-53;
}

/// A sphere of 1 m2 cut into patches, F_ij = A_j: closed and reciprocal.
Case sphere(std::size_t count, unsigned seed) {
    Case c;
    double total = 0.0;
    for (std::size_t i = 0; i < count; ++i)
        c.area_m2.push_back(0.1 + noise(i, seed));
    for (const double a : c.area_m2)
        total += a;
    for (double& a : c.area_m2)
        a /= total;
    c.form_factors = from_table(std::vector<std::vector<double>>(count, c.area_m2));
    c.optics.resize(count);
    c.direct_lx.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        c.optics[i].reflectance = {0.9 * noise(i, seed + 1), 0.9 * noise(i, seed + 2),
                                   0.9 * noise(i, seed + 3)};
        c.direct_lx[i].sky = {100.0 * noise(i, seed + 4), 100.0 * noise(i, seed + 5), 0.0};
        if (i == 0) c.direct_lx[i].other = {5000.0, 4000.0, 3000.0};
    }
    return c;
}

/// A closed enclosure with rows that sum to 1 but obey no reciprocity.
Case lopsided(std::size_t count, unsigned seed) {
    Case c = sphere(count, seed);
    for (std::size_t i = 0; i < count; ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j < count; ++j) {
            double& value = c.form_factors.value[i * count + j];
            value = std::pow(noise(i * count + j, seed + 9), 4.0);
            sum += value;
        }
        for (std::size_t j = 0; j < count; ++j)
            c.form_factors.value[i * count + j] /= sum;
    }
    return c;
}

/// E_ind by Gaussian elimination on E = F K (E_dir + E) + F M, one band of one source.
std::vector<double> solve_directly(const Case& c, double Band3::*band, Band3 LightBySource::*source) {
    const std::size_t n = c.area_m2.size();
    std::vector<std::vector<double>> a(n, std::vector<double>(n + 1));
    for (std::size_t i = 0; i < n; ++i) {
        a[i][i] += 1.0;
        for (std::size_t e = c.form_factors.row_begin[i]; e < c.form_factors.row_begin[i + 1]; ++e) {
            const std::size_t j = c.form_factors.column[e];
            const double f = c.form_factors.value[e];
            const auto leaves = [&](std::size_t by, double share) {
                a[i][by] -= f * share;
                a[i][n] += f * share * (c.direct_lx[by].*source.*band);
            };
            leaves(j, c.optics[j].reflectance.*band);
            if (c.optics[j].behind != PatchId::none) {
                const std::size_t k = index(c.optics[j].behind);
                leaves(k, c.optics[k].transmittance.*band * c.area_m2[k] / c.area_m2[j]);
            }
            a[i][n] += f * (c.optics[j].exitance_lm_m2.*source.*band);
        }
    }
    for (std::size_t p = 0; p < n; ++p)
        for (std::size_t i = 0; i < n; ++i) {
            if (i == p) continue;
            const double factor = a[i][p] / a[p][p];
            for (std::size_t k = p; k <= n; ++k)
                a[i][k] -= factor * a[p][k];
        }
    std::vector<double> x(n);
    for (std::size_t i = 0; i < n; ++i)
        x[i] = a[i][n] / a[i][i];
    return x;
}

void check_against_elimination(const Case& c, const RadiositySolution& s) {
    for (const auto source : {&LightBySource::sky, &LightBySource::other})
        for (const auto band : {&Band3::r, &Band3::g, &Band3::b}) {
            const std::vector<double> exact = solve_directly(c, band, source);
            double total = 0.0, wrong = 0.0;
            for (std::size_t i = 0; i < exact.size(); ++i) {
                total += c.area_m2[i] * exact[i];
                wrong += c.area_m2[i] * std::abs(s.indirect_illuminance_lx[i].*source.*band - exact[i]);
            }
            CHECK(wrong <= 1e-6 * total);  // the tolerance of the default options
        }
}

/// |in - absorbed - lost| / in, largest of the bands.
double flux_gap(const RadiositySolution& s) {
    const Band3 gap = s.flux_in_lm - s.flux_absorbed_lm - s.flux_lost_lm;
    double worst = 0.0;
    for (const auto band : {&Band3::r, &Band3::g, &Band3::b})
        if (s.flux_in_lm.*band > 0.0) worst = std::max(worst, std::abs(gap.*band) / (s.flux_in_lm.*band));
    return worst;
}

constexpr double tolerance = 1e-6;  // RadiosityOptions' default, a bound on the relative error

}  // namespace

TEST_CASE("an evenly lit closed room of one reflectance has E = E_direct / (1 - rho)",
          "[core][radiosity][analytic]") {
    const double rho = GENERATE(0.0, 0.2, 0.5, 0.9, 0.99);
    INFO("reflectance " << rho);
    const bool reciprocal = GENERATE(true, false);
    Case c = reciprocal ? sphere(30, 1) : lopsided(30, 1);
    for (std::size_t i = 0; i < 30; ++i) {
        c.optics[i].reflectance = grey(rho);
        c.direct_lx[i] = {grey(700.0), {}};
    }
    const RadiositySolution s = c.solve();
    CHECK(s.converged);
    for (const LightBySource& e : s.indirect_illuminance_lx) {
        CHECK(std::abs(e.sky.r + 700.0 - 700.0 / (1.0 - rho)) <= tolerance * 700.0 / (1.0 - rho));
        CHECK(e.other == Band3{});
    }
}

TEST_CASE("a sphere spreads what it reflects evenly", "[core][radiosity][analytic]") {
    const Case c = sphere(50, GENERATE(1u, 2u, 3u));
    const RadiositySolution s = c.solve();
    CHECK(s.converged);
    for (const auto source : {&LightBySource::sky, &LightBySource::other})
        for (const auto band : {&Band3::r, &Band3::g, &Band3::b}) {
            double reflected = 0.0, mean_reflectance = 0.0;
            for (std::size_t i = 0; i < 50; ++i) {
                reflected += c.area_m2[i] * c.optics[i].reflectance.*band * (c.direct_lx[i].*source.*band);
                mean_reflectance += c.area_m2[i] * c.optics[i].reflectance.*band;
            }
            const double expected = reflected / (1.0 - mean_reflectance);
            for (const LightBySource& e : s.indirect_illuminance_lx)
                CHECK(std::abs(e.*source.*band - expected) <= tolerance * expected);
        }
}

TEST_CASE("black surfaces give no indirect light", "[core][radiosity][analytic]") {
    Case c = sphere(20, 4);
    for (PatchOptics& o : c.optics)
        o.reflectance = {};
    const RadiositySolution s = c.solve();
    CHECK(s.converged);
    CHECK(s.iterations == 1);
    for (const LightBySource& e : s.indirect_illuminance_lx)
        CHECK(e.total() == Band3{});
}

TEST_CASE("an emitting surface lights the room by its exitance", "[core][radiosity][analytic]") {
    Case c = sphere(20, 5);
    for (std::size_t i = 0; i < 20; ++i) {
        c.optics[i].reflectance = grey(0.5);
        c.direct_lx[i] = {};
    }
    c.optics[7].exitance_lm_m2.other = {300.0, 200.0, 100.0};
    const RadiositySolution s = c.solve();
    for (const LightBySource& e : s.indirect_illuminance_lx) {
        CHECK(e.sky == Band3{});
        CHECK_THAT(e.other.r, WithinRel(c.area_m2[7] * 300.0 / (1.0 - 0.5), tolerance));
        CHECK_THAT(e.other.b, WithinRel(c.area_m2[7] * 100.0 / (1.0 - 0.5), tolerance));
    }
    CHECK_THAT(s.exitance_lm_m2[7].other.r,
               WithinRel(300.0 + 0.5 * s.indirect_illuminance_lx[7].other.r, tolerance));
    CHECK_THAT(s.flux_in_lm.g, WithinRel(c.area_m2[7] * 200.0, 1e-14));
    CHECK(flux_gap(s) <= tolerance);
}

TEST_CASE("the iteration meets the direct solution, reciprocal rows or not", "[core][radiosity]") {
    const unsigned seed = GENERATE(range(1u, 6u));
    const bool reciprocal = GENERATE(true, false);
    INFO("seed " << seed << ", reciprocal " << reciprocal);
    const Case c = reciprocal ? sphere(40, seed) : lopsided(40, seed);
    const RadiositySolution s = c.solve();
    CHECK(s.converged);
    check_against_elimination(c, s);
}

TEST_CASE("rows on which conjugate residuals fail are solved by Jacobi", "[core][radiosity]") {
    // A ring of patches that each see only the next one, and areas that grow by 8 from one to the next: far
    // from reciprocal, and K F grows by sqrt(8) in the norm that conjugate residuals minimise.
    constexpr std::size_t count = 12;
    Case c;
    std::vector<std::vector<double>> table(count, std::vector<double>(count));
    for (std::size_t i = 0; i < count; ++i) {
        table[i][(i + 1) % count] = 1.0;
        c.area_m2.push_back(std::pow(8.0, static_cast<double>(count - i)));
    }
    c.form_factors = from_table(table);
    c.optics.resize(count);
    c.direct_lx.resize(count);
    for (PatchOptics& o : c.optics)
        o.reflectance = grey(0.95);
    for (std::size_t i = 0; i < count; ++i)
        c.direct_lx[i] = {{1.0, 2.0, 3.0}, {noise(i, 1), noise(i, 2), 1.0}};
    const RadiositySolution s = c.solve();
    CHECK(s.converged);
    check_against_elimination(c, s);
}

TEST_CASE("indirect light is linear in direct light and keeps its sources apart",
          "[core][radiosity][property]") {
    const Case a = sphere(30, 6);
    Case b = a, both = a;
    for (std::size_t i = 0; i < 30; ++i) {
        b.direct_lx[i] = {grey(10.0 * noise(i, 21)), grey(900.0 * noise(i, 22))};
        both.direct_lx[i] = 2.0 * a.direct_lx[i] + 3.0 * b.direct_lx[i];
    }
    const RadiositySolution sa = a.solve(), sb = b.solve(), sum = both.solve();
    for (std::size_t i = 0; i < 30; ++i) {
        const LightBySource expected =
            2.0 * sa.indirect_illuminance_lx[i] + 3.0 * sb.indirect_illuminance_lx[i];
        CHECK_THAT(sum.indirect_illuminance_lx[i].sky.g, WithinRel(expected.sky.g, 2 * tolerance));
        CHECK_THAT(sum.indirect_illuminance_lx[i].other.b, WithinRel(expected.other.b, 2 * tolerance));
    }
}

TEST_CASE("bands do not mix", "[core][radiosity][property]") {
    Case c = sphere(30, 7);
    Case swapped = c;
    for (std::size_t i = 0; i < 30; ++i) {
        Band3& rho = swapped.optics[i].reflectance;
        std::swap(rho.r, rho.b);
        std::swap(swapped.direct_lx[i].sky.r, swapped.direct_lx[i].sky.b);
        std::swap(swapped.direct_lx[i].other.r, swapped.direct_lx[i].other.b);
    }
    const RadiositySolution a = c.solve(), b = swapped.solve();
    for (std::size_t i = 0; i < 30; ++i) {
        CHECK(a.indirect_illuminance_lx[i].sky.r == b.indirect_illuminance_lx[i].sky.b);
        CHECK(a.indirect_illuminance_lx[i].other.b == b.indirect_illuminance_lx[i].other.r);
        CHECK(a.indirect_illuminance_lx[i].other.g == b.indirect_illuminance_lx[i].other.g);
    }

    for (std::size_t i = 0; i < 30; ++i) {
        c.optics[i].reflectance = grey(c.optics[i].reflectance.g);
        c.direct_lx[i] = {grey(c.direct_lx[i].sky.r), grey(c.direct_lx[i].other.r)};
    }
    const RadiositySolution greys = c.solve();
    for (const LightBySource& e : greys.indirect_illuminance_lx) {
        CHECK(e.sky == grey(e.sky.r));
        CHECK(e.other == grey(e.other.r));
    }
}

TEST_CASE("flux in equals flux absorbed plus flux lost", "[core][radiosity][property]") {
    Case c = sphere(40, GENERATE(8u, 9u, 10u));
    for (double& value : c.form_factors.value)
        value *= 0.9;  // every row leaks a tenth
    c.optics[3].exitance_lm_m2.other = {50.0, 60.0, 70.0};
    const RadiositySolution s = c.solve();
    CHECK(s.converged);
    CHECK(flux_gap(s) <= tolerance);
    CHECK(s.flux_lost_lm.g > 0.0);
    double lost = 0.0;
    for (std::size_t i = 0; i < 40; ++i)
        lost += c.area_m2[i] * 0.1 * s.exitance_lm_m2[i].total().g;
    CHECK_THAT(s.flux_lost_lm.g, WithinRel(lost, 1e-12));
}

TEST_CASE("two rooms share light through an inner aperture", "[core][radiosity][analytic]") {
    // Two evenly lit spheres of area A; a share w of each is one aperture of reflectance rho_a and
    // transmittance tau. With e_k = illuminance of room k: e_1 = w (rho_a e_1 + tau e_2) + (1 - w)(rho_1 e_1
    // + E_1 rho_1 in E_dir), ...
    const double rho_a = GENERATE(0.0, 0.1);
    const double tau = GENERATE(0.0, 0.8, 1.0);
    if (rho_a + tau > 1.0) return;
    INFO("reflectance " << rho_a << ", transmittance " << tau);
    constexpr double w = 0.25, rho_1 = 0.7, rho_2 = 0.3, direct = 1000.0;
    Case c;
    c.area_m2 = {6.0, 2.0, 6.0, 2.0};  // walls and aperture of room 1, of room 2
    c.form_factors = from_table({{1 - w, w, 0, 0}, {1 - w, w, 0, 0}, {0, 0, 1 - w, w}, {0, 0, 1 - w, w}});
    c.optics.resize(4);
    c.direct_lx.resize(4);
    c.optics[0].reflectance = grey(rho_1);
    c.optics[2].reflectance = grey(rho_2);
    c.optics[1] = {grey(rho_a), grey(tau), make_id<PatchId>(3), {}};
    c.optics[3] = {grey(rho_a), grey(tau), make_id<PatchId>(1), {}};
    c.direct_lx[0].sky = grey(direct);

    const double a11 = 1 - w * rho_a - (1 - w) * rho_1, a12 = -w * tau;
    const double a21 = -w * tau, a22 = 1 - w * rho_a - (1 - w) * rho_2;
    const double source = (1 - w) * rho_1 * direct;
    const double determinant = a11 * a22 - a12 * a21;
    const double e_1 = source * a22 / determinant, e_2 = -source * a21 / determinant;

    const RadiositySolution s = c.solve();
    CHECK(s.converged);  // also with tau = 1, where one reflection takes nothing from light on the aperture
    for (const std::size_t i : {0u, 1u})
        CHECK(std::abs(s.indirect_illuminance_lx[i].sky.r - e_1) <= tolerance * e_1);
    for (const std::size_t i : {2u, 3u})
        CHECK(std::abs(s.indirect_illuminance_lx[i].sky.r - e_2) <= tolerance * e_1);
    check_against_elimination(c, s);
    CHECK(flux_gap(s) <= tolerance);
    CHECK(s.flux_in_lm.r == 6.0 * direct);
}

TEST_CASE("a solution that stopped early says so", "[core][radiosity]") {
    Case c = lopsided(40, 11);
    for (PatchOptics& o : c.optics)
        o.reflectance = 0.99 / 0.9 * o.reflectance;
    const int allowed = GENERATE(1, 2, 3);
    const RadiositySolution s = c.solve({.tolerance = 1e-12, .max_iterations = allowed});
    CHECK_FALSE(s.converged);
    CHECK(s.iterations <= allowed);
    CHECK(s.relative_residual > 1e-12);
}

TEST_CASE("an enclosure that takes no light never claims to be solved", "[core][radiosity]") {
    Case c = sphere(10, 12);
    for (PatchOptics& o : c.optics)
        o.reflectance = grey(1.0);
    const RadiositySolution s = c.solve({.tolerance = 1e-6, .max_iterations = 50});
    CHECK_FALSE(s.converged);
    CHECK(s.iterations <= 50);
}

TEST_CASE("the reported error bounds the true one", "[core][radiosity][property]") {
    const Case c = lopsided(40, GENERATE(13u, 14u, 15u));
    const std::vector<double> exact = solve_directly(c, &Band3::g, &LightBySource::other);
    const RadiositySolution s = c.solve({.tolerance = 1e-3, .max_iterations = 100});
    double wrong = 0.0, flux = 0.0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
        const double total = exact[i] + c.direct_lx[i].other.g;
        wrong += c.area_m2[i] * std::abs(s.exitance_lm_m2[i].other.g - c.optics[i].reflectance.g * total);
        flux += c.area_m2[i] * c.optics[i].reflectance.g * total;
    }
    CHECK(wrong <= s.relative_residual * flux);
}

TEST_CASE("radiosity has the same bits for any number of threads", "[core][radiosity]") {
    const Case c = sphere(700, 16);
    RadiositySolution first;
    for (const int threads : {1, 2, 3, 8}) {
        INFO(threads << " threads");
        const ThreadLimit limit(threads);
        const RadiositySolution s = c.solve();
        if (threads == 1) first = s;
        const std::size_t bytes = 700 * sizeof(LightBySource);
        CHECK(std::memcmp(s.exitance_lm_m2.data(), first.exitance_lm_m2.data(), bytes) == 0);
        CHECK(std::memcmp(s.indirect_illuminance_lx.data(), first.indirect_illuminance_lx.data(), bytes) ==
              0);
        CHECK(s.iterations == first.iterations);
        CHECK(s.relative_residual == first.relative_residual);
    }
}
