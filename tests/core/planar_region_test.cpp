#include "core/planar_region.h"

#include <glm/geometric.hpp>
#include <random>

#include "tests/catch.h"

using namespace naturel;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Ring rectangle(double left_m, double bottom_m, double right_m, double top_m) {
    const auto nm = [](double m) { return static_cast<ClipperLib::cInt>(std::llround(m * nanometres_per_metre)); };
    return {{nm(left_m), nm(bottom_m)}, {nm(right_m), nm(bottom_m)}, {nm(right_m), nm(top_m)}, {nm(left_m), nm(top_m)}};
}

bool is_convex(const Ring& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const PlanePoint &a = ring[i], &b = ring[(i + 1) % ring.size()], &c = ring[(i + 2) % ring.size()];
        const double length = std::hypot(double(c.X - a.X), double(c.Y - a.Y));
        const double cross = double(b.X - a.X) * double(c.Y - b.Y) - double(b.Y - a.Y) * double(c.X - b.X);
        if (cross < -4.0 * length) return false;  // 4 nm, as convex_parts() allows
    }
    return true;
}

double total_area(const std::vector<Ring>& rings) {
    double sum = 0.0;
    for (const Ring& ring : rings) sum += area_m2(ring);
    return sum;
}

}  // namespace

TEST_CASE("a rectangle less a rectangle has convex parts of the same area", "[core][planar_region]") {
    const Region region = subtract({rectangle(0, 0, 4, 3)}, {rectangle(1, 1, 2, 2)});
    CHECK_THAT(area_m2(region), WithinRel(11.0, 1e-15));
    const auto parts = convex_parts(region);
    CHECK(parts.size() == 4);
    CHECK_THAT(total_area(parts), WithinRel(11.0, 1e-15));
    for (const Ring& part : parts) CHECK(is_convex(part));
}

TEST_CASE("convex parts of random regions are convex and cover exactly the region", "[core][planar_region][property]") {
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        INFO("seed " << seed);
        std::mt19937_64 random(seed);
        const bool lattice = seed % 2 == 1;  // coordinates on a coarse lattice: holes touch each other and the outline
        const auto coordinate = [&] {
            return lattice ? 0.5 * static_cast<double>(random() % 17) : static_cast<double>(random() >> 11) * 0x1p-53 * 8.0;
        };
        Region region{rectangle(0, 0, 8, 8)};
        for (int k = 0; k < 12; ++k) {
            Ring triangle;
            for (int i = 0; i < 3; ++i)
                triangle.emplace_back(std::llround(coordinate() * 1e9), std::llround(coordinate() * 1e9));
            if (!ClipperLib::Orientation(triangle)) ClipperLib::ReversePath(triangle);
            region = k % 3 == 2 ? unite(region, {triangle}) : subtract(region, {triangle});
        }
        const auto parts = convex_parts(region);
        for (const Ring& part : parts) CHECK(is_convex(part));
        // Each of the some hundred corners may move by 2 nm when near-touching corners are joined.
        CHECK_THAT(total_area(parts), WithinAbs(area_m2(region), 1e-7));
        for (std::size_t i = 0; i < parts.size(); ++i)
            for (std::size_t j = i + 1; j < parts.size(); ++j)
                CHECK(area_m2(intersect({parts[i]}, {parts[j]})) < 1e-7);
    }
}

TEST_CASE("offsetting shrinks a room by the margin on every side", "[core][planar_region]") {
    CHECK_THAT(area_m2(offset({rectangle(0, 0, 4, 3)}, -0.5)), WithinRel(6.0, 1e-12));
    CHECK(offset({rectangle(0, 0, 0.9, 3)}, -0.5).empty());
}

TEST_CASE("a plane frame takes points of its plane there and back", "[core][planar_region]") {
    const PlaneFrame frame = make_plane_frame({1, 2, 3}, glm::dvec3(0.6, 0, 0.8));
    const glm::dvec3 p = frame.origin_m + 0.123456789 * frame.x - 2.5 * frame.y;
    const glm::dvec3 q = frame.to_world(frame.to_plane(p));
    CHECK_THAT(glm::distance(p, q), WithinAbs(0.0, 1e-9));
}
