#include "core/box_index.h"

#include <random>

#include "tests/catch.h"

using namespace naturel;
using glm::dvec3;

TEST_CASE("an index of boxes finds what looking at every box finds", "[core][box_index]") {
    for (const std::size_t count : {0u, 1u, 4u, 5u, 37u, 1000u}) {
        INFO(count << " boxes");
        std::mt19937_64 random(count + 1);
        // Whole numbers: faces and points coincide, and a face belongs to its box.
        const auto number = [&](unsigned below) { return static_cast<double>(random() % below); };
        std::vector<Box> boxes;
        for (std::size_t k = 0; k < count; ++k) {
            const dvec3 low{number(20), number(20), number(20)};
            // Some are flat as facets are, some fill the place.
            boxes.push_back({low, low + dvec3(number(k % 50 == 0 ? 20 : 3), number(4), number(2))});
        }
        const BoxIndex index(boxes);
        std::vector<std::uint32_t> found{7};
        for (int trial = 0; trial < 2000; ++trial) {
            const dvec3 p{number(23), number(23), number(21)};
            std::vector<std::uint32_t> expected;
            for (std::uint32_t k = 0; k < count; ++k)
                if (p.x >= boxes[k].low_m.x && p.y >= boxes[k].low_m.y && p.z >= boxes[k].low_m.z && p.x <= boxes[k].high_m.x &&
                    p.y <= boxes[k].high_m.y && p.z <= boxes[k].high_m.z)
                    expected.push_back(k);
            index.containing(p, found);
            if (found != expected) FAIL("at " << p.x << ", " << p.y << ", " << p.z);
        }
    }
}

TEST_CASE("a box around points holds them with its margin", "[core][box_index]") {
    const std::vector<dvec3> points{{1, 5, 0}, {2, 3, 0}, {0, 4, 0}};
    const Box box = box_around(points, 0.5);
    CHECK((box.low_m == dvec3(-0.5, 2.5, -0.5)));
    CHECK((box.high_m == dvec3(2.5, 5.5, 0.5)));
}
