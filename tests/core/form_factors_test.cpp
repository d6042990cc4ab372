#include "core/form_factors.h"

#include <cmath>
#include <cstring>

#include "core/errors.h"
#include "core/parallel.h"
#include "tests/catch.h"

using namespace naturel;

namespace {

/// Rows written down by hand: row[i][j] = F_ij, what is missing to 1 is lost or truncated.
struct TableVisibility final : Visibility {
    std::vector<std::vector<double>> row;
    std::vector<double> lost;
    std::vector<double> escaped;  ///< none where empty

    std::string_view name() const noexcept override { return "table"; }
    std::vector<std::pair<std::string, std::string>> settings() const override { return {}; }
    void form_factor_row(PatchId from, FormFactorRow& out) const override {
        out.clear();
        out.lost = lost[index(from)];
        if (!escaped.empty()) out.escaped = escaped[index(from)];
        out.truncated = 1.0 - out.lost;
        for (std::size_t j = 0; j < row.size(); ++j) {
            const double value = row[index(from)][j];
            if (value == 0.0) continue;
            out.patches.push_back(make_id<PatchId>(j));
            out.values.push_back(value);
            out.truncated -= value;
        }
    }
    void gather_row(const GatherPoint&, FormFactorRow& out) const override { out.clear(); }
    void first_seen(const GatherPoint&, std::span<const glm::dvec3>, std::span<FacetId>) const override {}
    void view_facets(const Camera&, int, int, std::span<FacetId>) const override {}
};

PatchGrid patches_with_areas(const std::vector<double>& area_m2) {
    PatchGrid grid;
    for (const double a : area_m2) {
        Patch patch;
        patch.area_m2 = a;
        grid.patches.push_back(patch);
    }
    grid.indoor_patch_count = grid.gather_patch_count = area_m2.size();
    return grid;
}

double noise(std::size_t i, std::size_t j, unsigned seed) {
    std::uint64_t x =
        (seed * 0x9e3779b97f4a7c15ull) ^ (i * 0xbf58476d1ce4e5b9ull) ^ (j * 0x94d049bb133111ebull);
    x = (x ^ (x >> 31)) * 0xd6e8feb86659fd93ull;
    return static_cast<double>((x ^ (x >> 32)) >> 11) * 0x1p-53;
}

/// A sphere cut into patches: F_ij = A_j / A, each value off by up to `error` of itself; rows sum to 1.
struct NoisySphere {
    std::vector<double> area_m2;
    TableVisibility visibility;

    NoisySphere(std::size_t count, double error, unsigned seed) {
        double total = 0.0;
        for (std::size_t i = 0; i < count; ++i)
            area_m2.push_back(0.2 + noise(i, i, seed));
        for (const double a : area_m2)
            total += a;
        visibility.lost.assign(count, 0.0);
        visibility.row.assign(count, std::vector<double>(count));
        for (std::size_t i = 0; i < count; ++i) {
            double sum = 0.0;
            for (std::size_t j = 0; j < count; ++j)
                sum += visibility.row[i][j] = (i == j ? 0.0 : 1.0) * area_m2[j] / total *
                                              (1.0 + error * (2.0 * noise(i, j, seed) - 1.0));
            for (double& value : visibility.row[i])
                value /= sum;
        }
    }
    FormFactors compute(FormFactorRepair repair) const {
        NoProgress quiet;
        return compute_form_factors(visibility, patches_with_areas(area_m2), {.repair = repair}, quiet);
    }
};

double value_at(const FormFactors& f, std::size_t i, std::size_t j) {
    for (std::size_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e)
        if (f.column[e] == j) return f.value[e];
    return 0.0;
}

double row_sum(const FormFactors& f, std::size_t i) {
    double sum = 0.0;
    for (std::size_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e)
        sum += f.value[e];
    return sum;
}

/// Largest relative |A_i F_ij - A_j F_ji|.
double worst_asymmetry(const FormFactors& f, const std::vector<double>& area_m2) {
    double worst = 0.0;
    for (std::size_t i = 0; i < f.row_count(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const double a = area_m2[i] * value_at(f, i, j);
            const double b = area_m2[j] * value_at(f, j, i);
            if (a + b > 0.0) worst = std::max(worst, std::abs(a - b) / (a + b));
        }
    return worst;
}

}  // namespace

TEST_CASE("unrepaired form factors are the rows that the visibility method gave", "[core][form_factors]") {
    const NoisySphere sphere(12, 0.2, 1);
    const FormFactors f = sphere.compute(FormFactorRepair::none);
    REQUIRE(f.row_count() == 12);
    for (std::size_t i = 0; i < 12; ++i)
        for (std::size_t j = 0; j < 12; ++j)
            CHECK(value_at(f, i, j) == sphere.visibility.row[i][j]);
    CHECK(f.quality.repair_change == 0.0);
}

TEST_CASE("the measured quality is what the definitions say", "[core][form_factors]") {
    TableVisibility visibility;
    visibility.row = {{0.0, 0.5}, {0.3, 0.0}};
    visibility.lost = {0.1, 0.2};  // truncated: 0.4, 0.5
    visibility.escaped = {0.001, 0.003};
    NoProgress quiet;
    const FormFactors f = compute_form_factors(visibility, patches_with_areas({2.0, 6.0}),
                                               {.repair = FormFactorRepair::none}, quiet);
    using Catch::Matchers::WithinAbs;
    constexpr double rounding = 1e-14;  // a handful of operations on numbers of order 1
    CHECK_THAT(f.quality.mean_lost, WithinAbs((2 * 0.1 + 6 * 0.2) / 8, rounding));
    CHECK_THAT(f.quality.worst_lost, WithinAbs(0.2, rounding));
    CHECK_THAT(f.quality.mean_truncated, WithinAbs((2 * 0.4 + 6 * 0.5) / 8, rounding));
    CHECK_THAT(f.quality.worst_truncated, WithinAbs(0.5, rounding));
    CHECK_THAT(f.quality.mean_escaped, WithinAbs((2 * 0.001 + 6 * 0.003) / 8, rounding));
    CHECK(f.quality.worst_escaped == 0.003);
    CHECK(f.escaped == visibility.escaped);
    CHECK_THAT(f.quality.reciprocity_gap, WithinAbs((1.8 - 1.0) / (1.8 + 1.0), rounding));
    CHECK_THAT(f.quality.worst_flux_error, WithinAbs(1.8 / 2 - 0.5, rounding));
}

TEST_CASE("a repair keeps what the rows say of escaped rays, and does not give it back twice", "[core][form_factors]") {
    for (const FormFactorRepair repair : {FormFactorRepair::renormalise, FormFactorRepair::reciprocal}) {
        NoisySphere sphere(12, 0.1, 3);
        sphere.visibility.escaped.assign(12, 0.0);
        sphere.visibility.escaped[5] = 0.004;
        const FormFactors f = sphere.compute(repair);
        CHECK(f.escaped == sphere.visibility.escaped);
        // The balance stops at 1e-10 per row.
        for (std::size_t i = 0; i < 12; ++i) CHECK(std::abs(row_sum(f, i) - 1.0) < 1e-9);
    }
}

TEST_CASE("renormalised rows sum to one less what they lost", "[core][form_factors]") {
    TableVisibility visibility;
    visibility.row = {{0.0, 0.5}, {0.3, 0.0}};
    visibility.lost = {0.1, 0.2};
    NoProgress quiet;
    const FormFactors f = compute_form_factors(visibility, patches_with_areas({2.0, 6.0}),
                                               {.repair = FormFactorRepair::renormalise}, quiet);
    using Catch::Matchers::WithinAbs;
    CHECK_THAT(row_sum(f, 0), WithinAbs(0.9, 1e-15));
    CHECK_THAT(row_sum(f, 1), WithinAbs(0.8, 1e-15));
    CHECK_THAT(f.quality.repair_change, WithinAbs((2 * 0.4 + 6 * 0.5) / (2 * 0.5 + 6 * 0.3), 1e-14));
}

TEST_CASE("reciprocal repair conserves flux", "[core][form_factors][property]") {
    const unsigned seed = GENERATE(range(1u, 6u));
    INFO("seed " << seed);
    NoisySphere sphere(40, 0.5, seed);
    for (std::size_t i = 0; i < 40; i += 7) {  // a leak here and there
        sphere.visibility.lost[i] = 0.1;
        for (double& value : sphere.visibility.row[i])
            value *= 0.9;
    }
    const FormFactors raw = sphere.compute(FormFactorRepair::none);
    const FormFactors f = sphere.compute(FormFactorRepair::reciprocal);
    CHECK(worst_asymmetry(raw, sphere.area_m2) > 0.1);  // there was something to repair
    CHECK(worst_asymmetry(f, sphere.area_m2) < 1e-14);  // rounding of two products
    for (std::size_t i = 0; i < f.row_count(); ++i) {
        INFO("row " << i);
        // The balance stops at 1e-10 per row; light through leaks stays lost.
        CHECK(std::abs(row_sum(f, i) - (1.0 - sphere.visibility.lost[i])) < 1e-9);
    }
    CHECK(f.quality.repair_change > 0.01);
    CHECK(f.quality.repair_change < 0.5);  // values move by less than the error put in
    CHECK(f.quality.worst_flux_error == raw.quality.worst_flux_error);  // measured before the repair
}

TEST_CASE("reciprocal repair leaves consistent rows alone", "[core][form_factors]") {
    TableVisibility
        visibility;  // three strips of an infinite triangular duct: F_ij = (l_i + l_j - l_k) / (2 l_i)
    visibility.row = {{0.0, 1.0 / 3.0, 2.0 / 3.0}, {0.25, 0.0, 0.75}, {0.4, 0.6, 0.0}};
    visibility.lost = {0.0, 0.0, 0.0};
    NoProgress quiet;
    const FormFactors f = compute_form_factors(visibility, patches_with_areas({3.0, 4.0, 5.0}), {}, quiet);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            CHECK_THAT(value_at(f, i, j), Catch::Matchers::WithinAbs(visibility.row[i][j], 1e-10));
    CHECK(f.quality.repair_change < 1e-10);  // where the balance stops
}

TEST_CASE("a patch that sees nothing does not disturb the repair of the others", "[core][form_factors]") {
    NoisySphere sphere(20, 0.3, 3);
    const bool seen_by_others = GENERATE(false, true);
    for (std::size_t j = 0; j < 20; ++j) {
        sphere.visibility.row[4][j] = 0.0;
        if (!seen_by_others) sphere.visibility.row[j][4] = 0.0;
    }
    sphere.visibility.lost[4] = 1.0;
    const FormFactors f = sphere.compute(FormFactorRepair::reciprocal);
    CHECK(row_sum(f, 4) == 0.0);
    for (std::size_t i = 0; i < 20; ++i) {
        if (i == 4) continue;
        INFO("row " << i);
        CHECK(std::abs(row_sum(f, i) - 1.0) < 1e-9);
        CHECK(value_at(f, i, 4) == 0.0);
    }
}

TEST_CASE("where no scaling meets both laws the repair makes no light", "[core][form_factors]") {
    TableVisibility visibility;  // two patches that see only each other and disagree about how large they are
    visibility.row = {{0.0, 1.0}, {1.0, 0.0}};
    visibility.lost = {0.0, 0.0};
    const std::vector<double> area_m2{1.0, 2.0};
    NoProgress quiet;
    const FormFactors f = compute_form_factors(visibility, patches_with_areas(area_m2), {}, quiet);
    CHECK(worst_asymmetry(f, area_m2) < 1e-14);
    CHECK(row_sum(f, 0) <= 1.0 + 1e-12);
    CHECK(row_sum(f, 1) <= 1.0 + 1e-12);
    CHECK(row_sum(f, 0) > 0.99);  // and takes no more than it must
}

TEST_CASE("form factors have the same bits for any number of threads", "[core][form_factors]") {
    const NoisySphere sphere(600, 0.3, 2);  // more columns than one task of the transposition owns
    FormFactors first;
    for (const int threads : {1, 2, 3, 8}) {
        INFO(threads << " threads");
        const ThreadLimit limit(threads);
        const FormFactors f = sphere.compute(FormFactorRepair::reciprocal);
        if (threads == 1) first = f;
        CHECK(f.row_begin == first.row_begin);
        CHECK(f.column == first.column);
        REQUIRE(f.value.size() == first.value.size());
        CHECK(std::memcmp(f.value.data(), first.value.data(), f.value.size() * sizeof(double)) == 0);
        CHECK(std::memcmp(&f.quality, &first.quality, sizeof f.quality) == 0);
    }
}

TEST_CASE("form factors that memory cannot hold are refused, and the sample says what rows are like",
          "[core][form_factors]") {
    // 2000 patches in groups of 20 that see each other alone: sparse rows. The first loses a tenth.
    constexpr std::size_t count = 2000, group = 20;
    TableVisibility visibility;
    visibility.lost.assign(count, 0.0);
    visibility.lost[0] = 0.1;
    visibility.row.assign(count, std::vector<double>(count));
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t j = i / group * group; j < (i / group + 1) * group; ++j)
            if (j != i) visibility.row[i][j] = 0.9 / (group - 1);
    const PatchGrid grid = patches_with_areas(std::vector<double>(count, 1.0));
    NoProgress progress;

    const FormFactorSample sample = sample_form_factors(visibility, grid, progress);
    CHECK(sample.mean_row_length == group - 1);
    CHECK(sample.worst_lost == 0.1);
    CHECK(index(sample.worst_patch) == 0);

    // An entry takes 12 bytes, and up to four copies of it exist at a time.
    const double needed = 4.0 * 12.0 * count * (group - 1);
    CHECK(forecast_memory_bytes(count, sample.mean_row_length) == needed);
    CHECK_NOTHROW(refuse_excessive_memory(visibility, grid, needed, progress));
    CHECK_THROWS_AS(refuse_excessive_memory(visibility, grid, 0.99 * needed, progress), InputError);
}
