#include <hwy/targets.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "core/patch_grid.h"
#include "hemicube_backend/cell_kernels.h"
#include "hemicube_backend/hemicube_visibility.h"
#include "tests/catch.h"
#include "tests/random_scenes.h"

namespace naturel {
namespace {

/// While it lives, kernels are compiled for one instruction set only.
class OnlyTarget {
public:
    explicit OnlyTarget(std::int64_t target) { choose(target); }
    ~OnlyTarget() { choose(0); }
    OnlyTarget(const OnlyTarget&) = delete;
    OnlyTarget& operator=(const OnlyTarget&) = delete;

private:
    static void choose(std::int64_t targets) {
        hwy::SetSupportedTargetsForTest(targets);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
};

/// Instruction sets that the kernels are compiled for and this machine has.
std::vector<std::int64_t> targets() {
    std::vector<std::int64_t> all;
    for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) all.push_back(left & -left);
    return all;
}

TEST_CASE("rows have the same patches and weights with any instruction set", "[hemicube][visibility]") {
    // A room with solids of all kinds at a slant, so that many cells of the grid are cut.
    Scene scene = tests::closed_room({5, 4, 3});
    for (Polyhedron solid : tests::random_scene(4, 12, tests::Placement::free, 0.0).polyhedra) {
        solid.id = "solid " + solid.id;
        solid.effect = Effect::fill;
        for (glm::dvec3& vertex_m : solid.vertices_m) vertex_m = 0.2 * vertex_m + glm::dvec3(2.5, 2, 0.7);
        scene.polyhedra.push_back(solid);
    }
    const Building building = assemble(scene);
    const PatchGrid grid = make_patch_grid(building, {.spacing_m = 0.7, .outdoor_spacing_m = 2.0});
    REQUIRE(grid.gather_patch_count > 50);
    const ProjectionSurface surface = GENERATE(ProjectionSurface::hemicube, ProjectionSurface::single_plane);
    const auto visibility = make_hemicube_visibility(building, grid, {.surface = surface, .resolution = 77});
    const std::vector<std::int64_t> all = targets();
    INFO(all.size() << " instruction sets");
    std::vector<FormFactorRow> first;
    for (const std::int64_t target : all) {
        INFO(hwy::TargetName(target));
        const OnlyTarget only(target);
        REQUIRE((hwy::SupportedTargets() & HWY_TARGETS) == target);
        std::vector<FormFactorRow> rows;
        for (std::size_t i = 0; i < grid.gather_patch_count; i += grid.gather_patch_count / 50) {
            rows.emplace_back();
            visibility->form_factor_row(make_id<PatchId>(i), rows.back());
        }
        if (first.empty()) first = rows;
        int different = 0;
        for (std::size_t k = 0; k < rows.size(); ++k) {
            different += rows[k].patches != first[k].patches || rows[k].lost != first[k].lost ||
                         rows[k].values.size() != first[k].values.size() ||
                         std::memcmp(rows[k].values.data(), first[k].values.data(), rows[k].values.size() * sizeof(double)) != 0;
        }
        CHECK(different == 0);
    }
}

TEST_CASE("kernels compute the same bits with any instruction set", "[hemicube]") {
    constexpr int rows = 40, columns = 61;
    constexpr std::size_t stride = columns + kernel_lanes;
    struct Results {
        std::vector<float> depth{}, smallest{};
        std::vector<ItemCode> items{};
        std::vector<std::int32_t> grid_cells{};
        std::vector<double> left{}, right{};
        std::vector<int> before{};
        bool operator==(const Results&) const = default;
    };
    std::vector<Results> all;
    for (const std::int64_t target : targets()) {
        INFO(hwy::TargetName(target));
        const OnlyTarget only(target);
        std::mt19937_64 random(7);
        const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53; };
        const auto numbers = [&](std::size_t count, double low, double high) {
            std::vector<double> values(count);
            for (double& value : values) value = uniform(low, high);
            return values;
        };
        Results results{.depth = std::vector<float>(rows * stride, 0.1f),
                        .items = std::vector<ItemCode>(rows * stride, empty_item),
                        .left = std::vector<double>(stride, -2.0),
                        .right = std::vector<double>(stride, 2.0)};
        std::vector<float> x;
        for (const double value : numbers(stride, -1, 1)) x.push_back(static_cast<float>(value));
        for (int facet = 0; facet < 30; ++facet) {
            std::vector<int> first(rows), last(rows);
            for (std::size_t row = 0; row < rows; ++row) {
                first[row] = static_cast<int>(random() % columns);
                last[row] = first[row] + static_cast<int>(random() % (columns - static_cast<unsigned>(first[row]) + 1));
            }
            const std::vector<double> at_origin = numbers(rows, 0.2, 1);
            draw_spans({.first = first.data(), .last = last.data(), .at_origin = at_origin.data(), .by_x = uniform(-0.5, 0.5), .x = x.data(),
                        .depth = results.depth.data(), .items = results.items.data(), .stride = stride, .code = facet - 15},
                       rows);
            results.smallest.push_back(smallest_depth(results.depth.data() + 8, rows, stride));
            // A grid so fine that the last bit of a float decides.
            results.grid_cells.resize(results.grid_cells.size() + stride);
            find_grid_cells({.s_0 = static_cast<float>(uniform(1e5, 2e5)), .s_x = static_cast<float>(uniform(-1e5, 1e5)),
                             .t_0 = static_cast<float>(uniform(1e5, 2e5)), .t_x = static_cast<float>(uniform(-1e5, 1e5)),
                             .w_0 = static_cast<float>(uniform(0.3, 0.9)), .w_x = static_cast<float>(uniform(-0.2, 0.2)),
                             .last_column = 1e6, .last_row = 1e6, .columns = 2, .first_cell = 123},
                            x.data(), columns, results.grid_cells.data() + results.grid_cells.size() - stride);
            std::fill(results.grid_cells.end() - kernel_lanes, results.grid_cells.end(), 0);  // may hold anything
            const std::vector<double> y = numbers(columns, -1, 1);
            raise_left(results.left.data(), y.data(), columns, uniform(-3, 0), uniform(-1, 1));
            lower_right(results.right.data(), y.data(), columns, uniform(0, 3), uniform(-1, 1));
        }
        results.before.resize(stride);
        count_columns_before(results.left.data(), columns, -1, 1000.0 / 3, 500, results.before.data());
        std::fill(results.before.end() - kernel_lanes, results.before.end(), 0);
        all.push_back(std::move(results));
        CHECK(all.back() == all.front());
    }
}

TEST_CASE("runs of equal values end where the next value differs, with any instruction set", "[hemicube]") {
    std::mt19937 random(5);
    for (const std::int64_t target : targets()) {
        INFO(hwy::TargetName(target));
        const OnlyTarget only(target);
        for (const int count : {1, 2, 7, 8, 9, 15, 16, 17, 100, 128}) {
            INFO(count << " values");
            std::vector<std::int32_t> values(static_cast<std::size_t>(count + kernel_lanes)), ends(values.size());
            for (std::int32_t& value : values) value = static_cast<std::int32_t>(random() % 3);
            ends.resize(static_cast<std::size_t>(find_run_ends(values.data(), count, ends.data())));
            std::vector<std::int32_t> expected;
            for (int k = 1; k <= count; ++k)
                if (k == count || values[static_cast<std::size_t>(k)] != values[static_cast<std::size_t>(k - 1)]) expected.push_back(k);
            CHECK(ends == expected);
        }
    }
}

}  // namespace
}  // namespace naturel
