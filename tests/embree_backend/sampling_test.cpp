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
    const HemisphereFrame frame(normal);
    for (int row = 0; row < tiles.rows; ++row)
        for (int column = 0; column < tiles.columns; ++column) {
            float x[16], y[16], z[16];
            tile_directions(frame, tiles, row, column, key, x, y, z);
            for (int k = 0; k < 16; ++k)
                directions.emplace_back(x[k], y[k], z[k]);
        }
    return directions;
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

TEST_CASE("the points of a run of packets fill every division of the square evenly", "[embree]") {
    const std::uint32_t key = GENERATE(0u, 1u, 0xdeadbeefu);
    const std::uint32_t packets = GENERATE(1u, 4u, 16u);
    const std::uint32_t first = packets * GENERATE(0u, 1u, 7u);
    const int points = static_cast<int>(16 * packets);
    for (int columns = 1; columns <= points; columns *= 2) {
        const int rows = points / columns;
        std::set<std::pair<int, int>> cells;
        for (std::uint32_t packet = first; packet < first + packets; ++packet) {
            float u[16], v[16];
            tile_points(packet, key, u, v);
            for (int k = 0; k < 16; ++k) {
                CHECK((u[k] >= 0.0f && u[k] < 1.0f && v[k] >= 0.0f && v[k] < 1.0f));
                cells.insert({static_cast<int>(u[k] * static_cast<float>(columns)),
                              static_cast<int>(v[k] * static_cast<float>(rows))});
            }
        }
        INFO(columns << " x " << rows);
        CHECK(cells.size() == static_cast<std::size_t>(points));
    }
}

TEST_CASE("no cell of the tiles is bound to one part of the patch", "[embree]") {
    // The first ray of every packet: its points must reach both halves of the patch about equally often.
    int left = 0, low = 0;
    for (std::uint32_t packet = 0; packet < 256; ++packet) {
        float u[16], v[16];
        tile_points(packet, 3, u, v);
        left += u[0] < 0.5f;
        low += v[0] < 0.5f;
    }
    CHECK(std::abs(left - 128) < 5 * 8);  // five standard deviations of 256 tosses
    CHECK(std::abs(low - 128) < 5 * 8);
}

TEST_CASE("another key gives other points and directions", "[embree]") {
    float u[16], v[16], other_u[16], other_v[16];
    tile_points(3, 1, u, v);
    tile_points(3, 2, other_u, other_v);
    CHECK(u[0] != other_u[0]);
    CHECK(all_directions({0, 0, 1}, make_tiles(256), 1) != all_directions({0, 0, 1}, make_tiles(256), 2));
    CHECK(mix(1) != mix(2));
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
        for (std::uint32_t packet = 0; packet < 256; ++packet) {
            float u[16], v[16], x[16], y[16], z[16];
            tile_points(packet, 99, u, v);
            sampler.place(u, v, x, y, z);
            for (int n = 0; n < 16; ++n) {
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
    float u[16], v[16], x[16], y[16], z[16];
    tile_points(0, 1, u, v);
    PolygonSampler(polygon, centroid, 1e-4, {}).place(u, v, x, y, z);
    for (int k = 0; k < 16; ++k)
        CHECK(dvec3(x[k], y[k], z[k]) == dvec3(glm::vec3(centroid)));
}
