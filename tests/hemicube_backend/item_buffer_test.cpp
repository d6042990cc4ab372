#include "hemicube_backend/item_buffer.h"

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "tests/catch.h"
#include "tests/hemicube_backend/ray_caster.h"
#include "tests/random_scenes.h"

namespace naturel {
namespace {

using glm::dvec3;

void add_facet(Building& building, std::vector<dvec3> vertices_m) {
    Facet facet;
    facet.face = make_id<FaceId>(building.faces.size());
    facet.normal = glm::normalize(glm::cross(vertices_m[1] - vertices_m[0], vertices_m[2] - vertices_m[0]));
    facet.vertices_m = std::move(vertices_m);
    building.facets.push_back(facet);
    building.faces.emplace_back();
}

/// Convex polygons of 3 to 6 corners anywhere around the origin, many of them through one another.
Building random_facets(unsigned seed, int count, double least_radius_m = 0.2, double largest_radius_m = 3) {
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const auto direction = [&] {
        for (;;) {
            const dvec3 v{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            if (glm::length(v) > 0.1 && glm::length(v) < 1) return glm::normalize(v);
        }
    };
    Building building;
    for (int i = 0; i < count; ++i) {
        const dvec3 centre = uniform(0.1, 4) * direction(), normal = direction();
        const dvec3 a = glm::normalize(glm::cross(normal, direction())), b = glm::cross(normal, a);
        const int corners = 3 + static_cast<int>(random() % 4);
        const double radius = uniform(least_radius_m, largest_radius_m);
        std::vector<dvec3> vertices;
        for (int k = 0; k < corners; ++k) {
            const double angle = 2 * 3.141592653589793 * (k + uniform(0.1, 0.9)) / corners;
            vertices.push_back(centre + radius * (std::cos(angle) * a + std::sin(angle) * b));
        }
        add_facet(building, std::move(vertices));
    }
    return building;
}

/// The five planes of a hemi-cube at a point, without turning.
std::vector<ProjectionAxes> hemicube_axes() {
    const dvec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    std::vector<ProjectionAxes> axes{{x, y, z}};
    for (const dvec3& side : {x, y, -x, -y})
        axes.push_back({glm::cross(z, side), z, side});
    return axes;
}

struct Drawing {
    Building building;
    dvec3 viewpoint_m{};
    FacetKind kind = FacetKind::opaque;

    /// seen(direction, facet) for every cell of a plane.
    template <class Seen>
    void for_each_cell(const ProjectionAxes& axes, const ProjectionCells& cells, const Seen& seen) const {
        const FacetSet facets(building);
        ItemBuffer buffer;
        buffer.draw(facets, {viewpoint_m, axes}, cells, kind);
        for (int row = 0; row < cells.rows; ++row) {
            for (int column = 0; column < cells.columns; ++column) {
                const auto c = static_cast<std::size_t>(column);
                const dvec3 direction = static_cast<double>(cells.centres_of(row)[c]) * axes.right +
                                        cells.row_centres[static_cast<std::size_t>(row)] * axes.up +
                                        axes.forward;
                seen(glm::normalize(direction), buffer.facet(row, column));
            }
        }
    }

    int count_empty(const ProjectionAxes& axes, const ProjectionCells& cells) const {
        int empty = 0;
        for_each_cell(axes, cells, [&](const dvec3&, FacetId seen) { empty += seen == FacetId::none; });
        return empty;
    }
};

TEST_CASE("every cell shows the facet that a ray through its centre meets",
          "[hemicube][item buffer][property]") {
    const unsigned seed = GENERATE(range(1u, 9u));
    INFO("seed " << seed);
    const Drawing drawing{random_facets(seed, 60)};
    const std::vector<ProjectionAxes> axes = hemicube_axes();
    struct Plane {
        ProjectionCells cells;
        ProjectionAxes axes;
    };
    const Plane planes[] = {{hemicube_top_cells(48), axes[0]},
                            {hemicube_side_cells(48), axes[1]},
                            {hemicube_side_cells(48), axes[2]},
                            {hemicube_side_cells(48), axes[3]},
                            {hemicube_side_cells(48), axes[4]},
                            {single_plane_cells(48, 14, CellSpacing::equal_solid_angle), axes[0]},
                            {single_plane_cells(48, 3, CellSpacing::equal_form_factor), axes[0]},
                            {rim_cells(48, 3), axes[1]}};
    int wrong = 0, undecided = 0, compared = 0;
    for (const Plane& plane : planes) {
        drawing.for_each_cell(plane.axes, plane.cells, [&](const dvec3& direction, FacetId seen) {
            const tests::RayHit hit = tests::cast_ray(drawing.building, drawing.viewpoint_m, direction);
            // Edges are drawn 10 nm x (1 + extent of the plane) wider, depths compared as floats: both below
            // these margins.
            if (hit.edge_margin_rad < 1e-5 || hit.depth_margin < 1e-4) {
                ++undecided;
            } else {
                ++compared;
                wrong += seen != hit.facet;
            }
        });
    }
    CHECK(wrong == 0);
    CHECK(undecided < compared / 500);
}

void compare_with_rays(int count, std::uint64_t seed) {
    INFO(count << " polyhedra, seed " << seed);
    const Drawing drawing{assemble(tests::random_scene(seed, count, tests::Placement::free, 0.0)), {0.3, -0.2, 3.1}};
    const std::vector<ProjectionAxes> axes = hemicube_axes();
    int wrong = 0, undecided = 0, compared = 0;
    const auto compare = [&](const dvec3& direction, FacetId seen) {
        const tests::RayHit hit = tests::cast_ray(drawing.building, drawing.viewpoint_m, direction);
        if (hit.edge_margin_rad < 1e-5 || hit.depth_margin < 1e-4) {
            // Rounding of an edge, or coplanar facets.
            ++undecided;
        } else {
            ++compared;
            wrong += seen != hit.facet;
        }
    };
    drawing.for_each_cell(axes[0], hemicube_top_cells(31), compare);
    drawing.for_each_cell(axes[1], hemicube_side_cells(31), compare);
    drawing.for_each_cell(axes[3], rim_cells(24, 3), compare);
    CHECK(wrong == 0);
    CHECK(compared > 20 * undecided);
}

TEST_CASE("in scenes of polyhedra every cell shows the facet that a ray through its centre meets",
          "[hemicube][item buffer][property]") {
    const int count = GENERATE(5, 50);
    compare_with_rays(count, GENERATE(1u, 2u));
}

TEST_CASE("in scenes of 200 polyhedra every cell shows the facet that a ray through its centre meets",
          "[hemicube][item buffer][property][slow]") {
    compare_with_rays(200, GENERATE(1u, 2u));
}

TEST_CASE("what is hidden, and the order of drawing, change no cell", "[hemicube][item buffer][property]") {
    const unsigned seed = GENERATE(range(1u, 5u));
    const Building building = random_facets(seed, 400);
    // Drawn front to back with hidden parts left out, twice: in two different orders.
    const FacetSet facets(building);
    const ProjectionCells cells = hemicube_top_cells(64);
    for (const bool parallel : {false, true}) {
        const Projection projection{{0.1, 0.2, parallel ? -5.0 : 0.0}, hemicube_axes()[0], parallel};
        ItemBuffer all;
        all.draw(facets, projection, cells, FacetKind::opaque);
        Building few = building;  // every second facet as an aperture, drawn later
        for (std::size_t k = 0; k < few.facets.size(); k += 2) few.facets[k].is_aperture = true;
        ItemBuffer in_two_steps;
        const FacetSet halves(few);
        in_two_steps.draw(halves, projection, cells, FacetKind::apertures);
        in_two_steps.add(halves, FacetKind::opaque);
        bool same = true;
        for (int row = 0; row < cells.rows; ++row)
            same = same && std::equal(all.codes(row), all.codes(row) + cells.columns, in_two_steps.codes(row));
        CHECK(same);
    }
}

TEST_CASE("facets drawn one by one, nothing left out, give the same picture", "[hemicube][item buffer][property]") {
    const unsigned seed = GENERATE(range(1u, 4u));
    INFO("seed " << seed);
    // Anywhere, and a ceiling with tiles close below it and behind it, which a careless bound of depth would mistake.
    Building building = random_facets(seed, 100, 0.1, 0.5);
    std::mt19937 random(seed);
    const auto add_tile = [&](double x, double y, double half, double z) {
        add_facet(building, {{x - half, y - half, z}, {x - half, y + half, z}, {x + half, y + half, z}, {x + half, y - half, z}});
    };
    const auto below = [&](unsigned count) { return static_cast<double>(random() % count); };
    add_tile(0, 0, 0.9, 1);
    for (int k = 0; k < 200; ++k)
        add_tile(0.01 * below(160) - 0.8, 0.01 * below(160) - 0.8, 0.02, 0.9 + 0.001 * below(200));
    const std::size_t count = building.facets.size();
    const ProjectionCells cells = hemicube_top_cells(200);
    for (const bool parallel : {false, true}) {
        const Projection projection{{0.1, 0.2, parallel ? -5.0 : 0.0}, hemicube_axes()[0], parallel};
        // Each facet into a buffer of its own, where nothing can hide it; then the rule of the buffer: the nearest, of equally
        // near ones the smaller code. All others are apertures, so that planes are shared out as in the whole.
        struct Cell {
            float depth = -std::numeric_limits<float>::infinity();
            ItemCode code = empty_item;
        };
        std::vector<Cell> nearest(static_cast<std::size_t>(cells.rows * cells.columns));
        ItemBuffer one;
        std::size_t seen_alone = 0;
        for (std::size_t k = 0; k < count; ++k) {
            Building alone = building;
            for (std::size_t j = 0; j < count; ++j) alone.facets[j].is_aperture = j != k;
            const FacetSet facets(alone);
            one.draw(facets, projection, cells, FacetKind::opaque);
            if (one.entries().empty()) continue;
            ++seen_alone;
            const ItemBuffer::Entry& entry = one.entries()[0];
            for (int row = 0; row < cells.rows; ++row) {
                const auto at_origin = static_cast<float>(entry.w_1 + entry.w_y * cells.row_centres[static_cast<std::size_t>(row)]);
                for (int column = 0; column < cells.columns; ++column) {
                    const ItemCode code = one.codes(row)[column];
                    if (code == empty_item) continue;
                    const float depth =
                        at_origin + static_cast<float>(entry.w_x) * cells.centres_of(row)[static_cast<std::size_t>(column)];
                    Cell& cell = nearest[static_cast<std::size_t>(row * cells.columns + column)];
                    if (depth > cell.depth || (depth == cell.depth && code < cell.code)) cell = {depth, code};
                }
            }
        }
        ItemBuffer all;
        const FacetSet facets(building);
        all.draw(facets, projection, cells, FacetKind::opaque);
        int different = 0;
        for (int row = 0; row < cells.rows; ++row)
            for (int column = 0; column < cells.columns; ++column)
                different += all.codes(row)[column] != nearest[static_cast<std::size_t>(row * cells.columns + column)].code;
        CHECK(different == 0);
        CHECK(all.entries().size() < seen_alone);  // something was left out
    }
}

TEST_CASE("from air, leaving out the backs of solids changes no cell", "[hemicube][item buffer][property]") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u);
    const auto placement = GENERATE(tests::Placement::free, tests::Placement::lattice);
    INFO("seed " << seed << ", " << (placement == tests::Placement::free ? "free" : "lattice"));
    Scene scene = tests::random_scene(seed, 30, placement, 0.0);
    // A sheet in the midst of them: its back is no back of a solid and has to be seen.
    scene.polygons.push_back({.id = "sheet", .vertices_m = {{-3, -3, 4}, {3, -3, 4.1}, {3, 3, 4.3}, {-3, 3, 4.2}}});
    const Building building = assemble(scene);
    const FacetSet facets(building);
    const ProjectionCells top = hemicube_top_cells(48), side = hemicube_side_cells(48);
    ItemBuffer all, from_air;
    int different = 0, backs = 0;
    std::size_t drawn = 0, drawn_from_air = 0;
    for (std::size_t k = 0; k < building.facets.size(); k += building.facets.size() / 40 + 1) {
        const Facet& facet = building.facets[k];
        const PlaneFrame plane = make_plane_frame(facets[make_id<FacetId>(k)].centre_m, facet.normal);
        for (int face = 0; face < 5; ++face) {
            const dvec3 sides[] = {plane.x, plane.y, -plane.x, -plane.y};
            const ProjectionAxes axes = face == 0 ? ProjectionAxes{plane.x, plane.y, facet.normal}
                                                  : ProjectionAxes{glm::cross(facet.normal, sides[face - 1]), facet.normal, sides[face - 1]};
            const ProjectionCells& cells = face == 0 ? top : side;
            all.draw(facets, {plane.origin_m, axes}, cells, FacetKind::all);
            from_air.draw(facets, {plane.origin_m, axes}, cells, FacetKind::all_from_air);
            drawn += all.entries().size();
            drawn_from_air += from_air.entries().size();
            for (int row = 0; row < cells.rows; ++row) {
                for (int column = 0; column < cells.columns; ++column) {
                    const ItemCode code = all.codes(row)[column];
                    different += code != from_air.codes(row)[column];
                    backs += code != empty_item && !ItemBuffer::faces_viewpoint(code);
                }
            }
        }
    }
    CHECK(different == 0);
    CHECK(backs > 0);
    CHECK(drawn_from_air < drawn);
}

TEST_CASE("a parallel projection shows what rays along its direction meet", "[hemicube][item buffer][property]") {
    const unsigned seed = GENERATE(range(1u, 4u));
    const Building building = random_facets(seed, 100);
    const FacetSet facets(building);
    const dvec3 forward = glm::normalize(dvec3(0.3, -0.5, -0.8)), right = glm::normalize(glm::cross(dvec3(0, 0, 1), forward));
    // From within the scene: what lies behind the plane of the view is cut off.
    const Projection projection{{0.2, 0.1, 0.4}, {right, glm::cross(forward, right), forward}, true};
    const ProjectionCells cells = picture_cells({.half_width = 3, .half_height = 2, .width = 61, .height = 40});
    ItemBuffer buffer;
    buffer.draw(facets, projection, cells, FacetKind::opaque);
    int wrong = 0, undecided = 0, open = 0;
    for (int row = 0; row < cells.rows; ++row) {
        for (int column = 0; column < cells.columns; ++column) {
            const dvec3 start_m = projection.eye_m +
                                  static_cast<double>(cells.centres_of(row)[static_cast<std::size_t>(column)]) * right +
                                  cells.row_centres[static_cast<std::size_t>(row)] * projection.axes.up;
            const tests::RayHit hit = tests::cast_ray(building, start_m, forward);
            open += hit.facet == FacetId::none;
            if (hit.edge_margin_rad < 1e-5 || hit.depth_margin < 1e-4)
                ++undecided;
            else
                wrong += buffer.facet(row, column) != hit.facet;
        }
    }
    CHECK(wrong == 0);
    CHECK(undecided < 20);
    CHECK(open < 2000);
}

TEST_CASE("facets that share an edge leave no gap, even with T-junctions", "[hemicube][item buffer]") {
    // A box around the viewpoint: its edges, and the diagonals below, run exactly through cell centres.
    Drawing drawing;
    const auto wall = [&](const dvec3& centre, const dvec3& a, const dvec3& b) {
        const dvec3 corner[] = {centre - a - b, centre + a - b, centre + a + b, centre - a + b};
        // One triangle, and beyond its longest edge two that meet at a third of it: the T-junction lies on a
        // diagonal.
        const dvec3 third = corner[0] + (corner[2] - corner[0]) / 3.0;
        add_facet(drawing.building, {corner[0], corner[1], corner[2]});
        add_facet(drawing.building, {corner[0], third, corner[3]});
        add_facet(drawing.building, {third, corner[2], corner[3]});
    };
    const dvec3 x{0.7, 0, 0}, y{0, 0.7, 0}, z{0, 0, 0.7};
    wall(z, y, x);
    wall(-z, x, y);
    wall(x, z, y);
    wall(-x, y, z);
    wall(y, x, z);
    wall(-y, z, x);
    for (const dvec3 viewpoint_m :
         {dvec3{0, 0, 0}, dvec3{0.1, 0.1, 0}, dvec3{0, 0, -0.35}, dvec3{0.3, -0.3, -0.7}}) {
        drawing.viewpoint_m = viewpoint_m;
        for (const int resolution : {2, 30, 64}) {
            INFO("at " << viewpoint_m.x << ' ' << viewpoint_m.y << ' ' << viewpoint_m.z << ", resolution "
                       << resolution);
            const std::vector<ProjectionAxes> axes = hemicube_axes();
            CHECK(drawing.count_empty(axes[0], hemicube_top_cells(resolution)) == 0);
            CHECK(drawing.count_empty(
                      axes[0], single_plane_cells(resolution, 14, CellSpacing::equal_solid_angle)) == 0);
            for (std::size_t side = 1; side < 5; ++side) {
                CHECK(drawing.count_empty(axes[side], hemicube_side_cells(resolution)) == 0);
            }
        }
    }
}

TEST_CASE("cracks of a few nanometres between facets are not seen", "[hemicube][item buffer]") {
    // Walls of a box that end 2 nm before their edges, which run through the cell centres on the diagonals.
    Drawing drawing;
    const double end = 0.7 - 2e-9;
    const dvec3 x{0.7, 0, 0}, y{0, 0.7, 0}, z{0, 0, 0.7};
    for (const auto& [centre, a, b] :
         {std::array{z, y, x}, {-z, x, y}, {x, z, y}, {-x, y, z}, {y, x, z}, {-y, z, x}}) {
        const dvec3 u = end / 0.7 * a, v = end / 0.7 * b;
        add_facet(drawing.building, {centre - u - v, centre + u - v, centre + u + v, centre - u + v});
    }
    const std::vector<ProjectionAxes> axes = hemicube_axes();
    for (const double height_m : {0.0, -0.35}) {
        drawing.viewpoint_m = {0, 0, height_m};
        CHECK(drawing.count_empty(axes[0], single_plane_cells(64, 14, CellSpacing::uniform)) == 0);
        for (std::size_t side = 1; side < 5; ++side)
            CHECK(drawing.count_empty(axes[side], hemicube_side_cells(64)) == 0);
    }
}

TEST_CASE("of coplanar facets that overlap the one with the smaller number is seen",
          "[hemicube][item buffer]") {
    // On a tilted plane, with corners rounded to 1 nm as assembly does, so that their planes are not quite
    // the same.
    const dvec3 a = glm::normalize(dvec3(1, 0.3, 0.2)), b = glm::normalize(glm::cross(dvec3(0.1, 0.2, 1), a));
    const auto rounded = [&](double u, double v) {
        return glm::round((dvec3(0.1, 0.2, 2) + u * a + v * b) * 5e7) / 5e7;
    };
    Drawing drawing;
    add_facet(drawing.building, {rounded(0, -3), rounded(-3, 0), rounded(0, 3), rounded(3, 0)});
    add_facet(drawing.building,
              {rounded(0.1, -1.7), rounded(-2.1, 0.3), rounded(0.2, 2.3), rounded(2.9, 0.1)});
    int first = 0, second = 0;
    drawing.for_each_cell(hemicube_axes()[0], hemicube_top_cells(256),
                          [&](const dvec3& direction, FacetId seen) {
                              first += seen == make_id<FacetId>(0);
                              if (tests::cast_ray(drawing.building, {}, direction).edge_margin_rad > 1e-5)
                                  second += seen == make_id<FacetId>(1);
                          });
    CHECK(first > 30000);
    CHECK(second == 0);
}

TEST_CASE("of the two sides of a polygon the one that faces the viewpoint is seen",
          "[hemicube][item buffer]") {
    const int front = GENERATE(0, 1);
    Drawing drawing;
    const std::vector<dvec3> up{{-1, -1, 1.1}, {1, -1, 1.3}, {1, 1, 1.5}, {-1, 1, 1.3}};
    const std::vector<dvec3> down{up[0], up[3], up[2], up[1]};
    add_facet(drawing.building, front == 0 ? down : up);
    add_facet(drawing.building, front == 0 ? up : down);
    int other = 0;
    drawing.for_each_cell(hemicube_axes()[0], hemicube_top_cells(64), [&](const dvec3&, FacetId seen) {
        other += seen != make_id<FacetId>(static_cast<std::size_t>(front)) && seen != FacetId::none;
    });
    CHECK(other == 0);
}

TEST_CASE("a facet in the plane of the viewpoint is not seen, nor what lies below it",
          "[hemicube][item buffer]") {
    Drawing drawing;
    drawing.viewpoint_m = {0.2, 0.1, 3};
    add_facet(drawing.building, {{-1, -1, 3}, {1, -1, 3}, {1, 1, 3}, {-1, 1, 3}});
    add_facet(drawing.building, {{-1, -1, 2.9}, {1, -1, 2.9}, {1, 1, 2.9}, {-1, 1, 2.9}});
    const std::vector<ProjectionAxes> axes = hemicube_axes();
    const ProjectionCells top = hemicube_top_cells(64), side = hemicube_side_cells(64);
    CHECK(drawing.count_empty(axes[0], top) == top.rows * top.columns);
    CHECK(drawing.count_empty(axes[1], side) == side.rows * side.columns);
}

TEST_CASE("apertures are drawn on request", "[hemicube][item buffer]") {
    Drawing drawing;
    add_facet(drawing.building, {{-9, -9, 1}, {-9, 9, 1}, {9, 9, 1}, {9, -9, 1}});
    drawing.building.facets[0].is_aperture = true;
    const ProjectionCells top = hemicube_top_cells(8);
    CHECK(drawing.count_empty(hemicube_axes()[0], top) == 64);
    drawing.kind = FacetKind::all;
    CHECK(drawing.count_empty(hemicube_axes()[0], top) == 0);
}

TEST_CASE("a band of rows shows what the whole shows", "[hemicube][item buffer]") {
    const Building building = random_facets(3, 40);
    const FacetSet facets(building);
    const Projection projection{{}, hemicube_axes()[0]};
    const ProjectionCells cells = hemicube_top_cells(64);
    ItemBuffer whole, band;
    whole.draw(facets, projection, cells, FacetKind::opaque);
    band.draw(facets, projection, cells, FacetKind::opaque, 20, 31);
    for (int row = 20; row < 31; ++row) {
        CHECK(std::equal(whole.codes(row), whole.codes(row) + cells.columns, band.codes(row)));
    }
}

}  // namespace
}  // namespace naturel
