#include "embree_backend/sampling.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <vector>

#include "core/units.h"
#include "tests/catch.h"

using namespace naturel;
using namespace naturel::embree_sampling;
using Catch::Matchers::WithinAbs;
using glm::dvec3;

namespace {

std::vector<dvec3> all_directions(const dvec3& normal, const Tiles& tiles, std::uint32_t key) {
    std::vector<dvec3> directions;
    const HemisphereFrame frame(normal, key % 8);
    const RayTable table = make_ray_table(tiles, key);
    for (std::size_t first = 0; first < static_cast<std::size_t>(table.rays()); first += 8) {
        float x[8], y[8], z[8];
        place_directions(frame, table, first, x, y, z);
        for (int k = 0; k < 8; ++k)
            directions.emplace_back(x[k], y[k], z[k]);
    }
    return directions;
}

/// Cell of a point of the unit square, divided into `columns` columns.
int cell_of(std::uint32_t fraction, int columns) {
    return static_cast<int>(static_cast<double>(fraction) * 0x1p-32 * columns);
}

}  // namespace

TEST_CASE("tiles hold at least the rays asked for, in multiples of 256", "[embree]") {
    for (const int rays : {1, 255, 256, 257, 1000, 4096, 16384, 17000}) {
        const Tiles tiles = make_tiles(rays);
        CHECK(tiles.rays() >= rays);
        CHECK(tiles.rays() < rays + 256);
        CHECK(tiles.rays() % 256 == 0);
    }
    CHECK(make_tiles(4096).rows == make_tiles(4096).columns);
}

TEST_CASE("directions are distributed by the cosine", "[embree][analytic]") {
    const dvec3 normal =
        GENERATE(dvec3(0, 0, 1), dvec3(0, 0, -1), dvec3(1, 0, 0), glm::normalize(dvec3(1, -2, -3)));
    const Tiles tiles = make_tiles(16384);
    const std::vector<dvec3> directions = all_directions(normal, tiles, 17);
    double mean_cosine = 0.0, mean_square = 0.0;
    dvec3 mean{};
    for (const dvec3& d : directions) {
        const double c = glm::dot(d, normal);
        CHECK(std::abs(glm::length(d) - 1.0) < 1e-6);  // a few roundings to float
        CHECK(c > -1e-6);
        mean += d / static_cast<double>(directions.size());
        mean_cosine += c / static_cast<double>(directions.size());
        mean_square += c * c / static_cast<double>(directions.size());
    }
    // Density cos / pi: E[cos] = 2/3, E[cos^2] = 1/2, E[d] = 2/3 normal. One sample in each of n cells leaves
    // an error of about (variation within a cell = 1 / 128) / sqrt(n = 16384).
    constexpr double tolerance = 5 * (1.0 / 128) / 128;
    CHECK_THAT(mean_cosine, WithinAbs(2.0 / 3.0, tolerance));
    CHECK_THAT(mean_square, WithinAbs(0.5, tolerance));
    CHECK(glm::distance(mean, 2.0 / 3.0 * normal) < tolerance);
}

TEST_CASE("each cell of the disc has its one direction", "[embree]") {
    // Equal areas of the disc hold equal numbers: rings r < sqrt(k / 8) and sectors of 45 degrees are unions
    // of cells only in part, so up to the cells on their outline may be off.
    const std::vector<dvec3> directions = all_directions({0, 0, 1}, make_tiles(4096), 5);
    std::vector<int> ring(8), sector(8);
    for (const dvec3& d : directions) {
        ++ring[static_cast<std::size_t>(std::min(7.0, 8 * (d.x * d.x + d.y * d.y)))];
        ++sector[static_cast<std::size_t>(std::min(7.0, (std::atan2(d.y, d.x) + pi) / (pi / 4)))];
    }
    for (int k = 0; k < 8; ++k) {
        CHECK(std::abs(ring[static_cast<std::size_t>(k)] - 512) < 64);
        CHECK(std::abs(sector[static_cast<std::size_t>(k)] - 512) < 64);
    }
    std::set<std::pair<double, double>> distinct;
    for (const dvec3& d : directions)
        distinct.insert({d.x, d.y});
    CHECK(distinct.size() == directions.size());
}

TEST_CASE("each sub-sample has one direction in every half of a tile", "[embree]") {
    const Tiles tiles = make_tiles(4096);
    const RayTable table = make_ray_table(tiles, 5);
    for (std::uint32_t sub_sample = 0; sub_sample < sub_samples; ++sub_sample) {
        std::set<std::pair<int, int>> halves;
        for (std::size_t ray = sub_sample; ray < 4096; ray += sub_samples) {
            // Back from the disc to the square.
            const double x = table.x[ray], y = table.y[ray], radius = std::hypot(x, y);
            const bool wide = std::abs(x) > std::abs(y);
            const double a = wide ? std::copysign(radius, x) : radius * std::atan2(x, std::abs(y)) * 4 / pi;
            const double b = wide ? radius * std::atan2(y, std::abs(x)) * 4 / pi : std::copysign(radius, y);
            halves.insert({static_cast<int>((a + 1) / 2 * tiles.columns), static_cast<int>((b + 1) / 2 * 2 * tiles.rows)});
        }
        // Rounding to float may move a ray on an outline next door.
        CHECK(halves.size() >= 512 - 1);
    }
}

TEST_CASE("rays start evenly from all over the patch, and so do those of each sub-sample", "[embree]") {
    const StartTable starts = make_start_table(make_tiles(4096));
    const int packets = GENERATE(1, 2, 8, 32, 512);
    // Squares of tiles follow each other only within a row of the table: take all of it, or what one tile holds.
    const auto check = [](const std::vector<std::pair<std::uint32_t, std::uint32_t>>& points) {
        const int count = static_cast<int>(points.size());
        for (int columns = 1; columns <= count; columns *= 2) {
            std::set<std::pair<int, int>> cells;
            for (const auto& [u, v] : points) cells.insert({cell_of(u, columns), cell_of(v, count / columns)});
            INFO(columns << " x " << count / columns);
            CHECK(cells.size() == static_cast<std::size_t>(count));
        }
    };
    // 16 x 16 tiles of two packets: the blocks of 2 and 8 packets are squares of 1 and 2 x 2 tiles.
    const int side = packets == 8 ? 2 : packets == 32 ? 4 : packets == 512 ? 16 : 1;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
    std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> own(sub_samples);
    for (int row = 0; row < side; ++row)
        for (int column = 0; column < side; ++column)
            for (std::size_t k = 0; k < (packets == 1 ? 8u : 16u); ++k) {
                const std::size_t ray = static_cast<std::size_t>(16 * (16 * row + column)) + k;
                all.emplace_back(starts.u[ray], starts.v[ray]);
                own[k % sub_samples].push_back(all.back());
            }
    check(all);
    for (const auto& points : own) check(points);
}

TEST_CASE("no cell of the tiles is bound to one part of the patch", "[embree]") {
    // The ray of sub-sample 0 in each packet is in either half of the half tile about equally often.
    const RayTable table = make_ray_table(make_tiles(4096), 3);
    const Tiles tiles = make_tiles(4096);
    int left = 0;
    for (std::size_t ray = 0; ray < 4096; ray += 8) {
        const double x = table.x[ray], y = table.y[ray], radius = std::hypot(x, y);
        const double a = std::abs(x) > std::abs(y) ? std::copysign(radius, x) : radius * std::atan2(x, std::abs(y)) * 4 / pi;
        const double within = (a + 1) / 2 * tiles.columns;
        left += within - std::floor(within) < 0.5;
    }
    CHECK(std::abs(left - 256) < 5 * 12);  // five standard deviations of 512 tosses
}

TEST_CASE("another key gives other directions", "[embree]") {
    CHECK(all_directions({0, 0, 1}, make_tiles(256), 0) != all_directions({0, 0, 1}, make_tiles(256), 8));
    CHECK(mix(1) != mix(2));
}

TEST_CASE("a frame keeps its normal in all of its eight positions", "[embree]") {
    const dvec3 normal = glm::normalize(dvec3(1, -2, -3));
    std::set<std::pair<float, float>> positions;
    for (std::uint32_t k = 0; k < 8; ++k) {
        const HemisphereFrame frame(normal, k);
        CHECK(glm::distance(dvec3(frame.z), normal) < 1e-7);  // rounding to float
        CHECK(std::abs(glm::dot(frame.x, frame.y)) < 1e-6f);
        CHECK(std::abs(glm::dot(frame.x, frame.z)) < 1e-6f);
        positions.insert({frame.x.x, frame.y.x});
    }
    CHECK(positions.size() == 8);
}

TEST_CASE("Morton numbers keep aligned blocks together", "[embree]") {
    std::set<std::uint32_t> block;
    for (std::uint32_t a = 8; a < 12; ++a)
        for (std::uint32_t b = 4; b < 8; ++b)
            block.insert(morton(a, b));
    CHECK(block.size() == 16);
    CHECK(*block.begin() % 16 == 0);
    CHECK(*block.rbegin() == *block.begin() + 15);
}

TEST_CASE("points are spread evenly over a polygon", "[embree][analytic]") {
    const std::vector<std::vector<dvec3>> polygons{
        {{0, 0, 1}, {2, 0.5, 1}, {2.5, 2, 1}, {0.5, 1.5, 1}},          // parallelogram
        {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}},                             // triangle
        {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0.5, 2}, {0, -0.5, 1}},  // pentagon
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}},       // with a corner on an edge
    };
    for (const std::vector<dvec3>& polygon : polygons) {
        dvec3 centroid{};
        double area = 0.0;
        for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
            const double a = glm::length(glm::cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]));
            centroid += a / 3 * (polygon[0] + polygon[k] + polygon[k + 1]);
            area += a;
        }
        centroid /= area;
        constexpr double margin = 1e-3;
        const dvec3 shift(0.5, -1, 2);
        const PolygonSampler sampler(polygon, centroid, margin, shift);
        dvec3 mean{};
        const dvec3 normal = glm::normalize(glm::cross(polygon[1] - polygon[0], polygon.back() - polygon[0]));
        double nearest = 1.0, off_plane = 0.0;
        const StartTable starts = make_start_table(make_tiles(4096));
        for (std::size_t first = 0; first < 4096; first += 8) {
            float x[8], y[8], z[8];
            sampler.place(starts, first, {0xdeadbeefu, 0x12345678u}, x, y, z);
            for (int n = 0; n < 8; ++n) {
                const dvec3 p = dvec3(x[n], y[n], z[n]) - shift;
                mean += p / 4096.0;
                off_plane = std::max(off_plane, std::abs(glm::dot(normal, p - polygon[0])));
                for (std::size_t k = 0; k < polygon.size(); ++k) {
                    const dvec3 edge = glm::normalize(polygon[(k + 1) % polygon.size()] - polygon[k]);
                    nearest = std::min(nearest, glm::dot(glm::cross(normal, edge), p - polygon[k]));
                }
            }
        }
        CHECK(glm::distance(mean, centroid) < 2e-3);  // 4096 points of a sequence: about log(4096) / 4096
        CHECK(nearest > 0.999 * margin);
        CHECK(off_plane < 1e-6);  // floats of a few metres
    }
}

TEST_CASE("a polygon smaller than the margin is sampled at its centroid", "[embree]") {
    const std::vector<dvec3> polygon{{0, 0, 0}, {1e-5, 0, 0}, {0, 1e-5, 0}};
    const dvec3 centroid(1e-5 / 3, 1e-5 / 3, 0);
    float x[8], y[8], z[8];
    PolygonSampler(polygon, centroid, 1e-4, {}).place(make_start_table(make_tiles(256)), 0, {}, x, y, z);
    for (int k = 0; k < 8; ++k)
        CHECK(dvec3(x[k], y[k], z[k]) == dvec3(glm::vec3(centroid)));
}
