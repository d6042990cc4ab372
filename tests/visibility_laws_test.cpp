// Laws that every visibility method obeys, whatever its kind: run for each of all_backends().
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <map>

#include "core/building.h"
#include "core/form_factors.h"
#include "core/parallel.h"
#include "core/patch_grid.h"
#include "core/view.h"
#include "tests/all_backends.h"
#include "tests/catch.h"
#include "tests/hemicube_backend/ray_caster.h"
#include "tests/random_scenes.h"
#include "tests/reference/exact_form_factors.h"

using namespace naturel;
using namespace naturel::tests;
using glm::dvec3;

namespace {

/// A building, its grid and one method's view of it.
struct Place {
    Building building;
    PatchGrid grid;
    std::unique_ptr<Visibility> visibility;

    Place(const Scene& scene, double spacing_m, const Backend& backend)
        : building(assemble(scene)), grid(make_patch_grid(building, {.spacing_m = spacing_m})) {
        visibility = backend.make(building, grid);
    }

    FaceId face(const std::string& name) const {
        for (std::size_t f = 0; f < building.faces.size(); ++f)
            if (building.faces[f].name == name) return make_id<FaceId>(f);
        throw std::runtime_error("no face " + name);
    }

    std::vector<FormFactorRow> rows() const {
        std::vector<FormFactorRow> all(grid.gather_patch_count);
        parallel_for(all.size(), 1,
                     [&](std::size_t i) { visibility->form_factor_row(make_id<PatchId>(i), all[i]); });
        return all;
    }

    /// Share of a row that reaches a face.
    double share(const FormFactorRow& row, FaceId to) const {
        double sum = 0.0;
        for (std::size_t k = 0; k < row.values.size(); ++k)
            if (grid.patches[index(row.patches[k])].face == to) sum += row.values[k];
        return sum;
    }

    /// Form factor between whole faces, and the share that the method did not look at.
    struct Between {
        double form_factor = 0.0, truncated = 0.0;
    };
    Between between(FaceId from, FaceId to) const {
        Between sum;
        double area = 0.0;
        FormFactorRow row;
        for (std::size_t i = 0; i < grid.gather_patch_count; ++i) {
            const Patch& patch = grid.patches[i];
            if (patch.face != from) continue;
            visibility->form_factor_row(make_id<PatchId>(i), row);
            sum.form_factor += patch.area_m2 * share(row, to);
            sum.truncated += patch.area_m2 * row.truncated;
            area += patch.area_m2;
        }
        return {sum.form_factor / area, sum.truncated / area};
    }
};

double sum_of(const FormFactorRow& row) {
    double sum = 0.0;
    for (const double f : row.values)
        sum += f;
    return sum;
}

/// A closed room with tables, a partition and a slanted ramp: edges of all kinds.
Scene furnished_room(std::uint64_t seed) {
    const auto number = [&](unsigned k) {
        return std::fmod(std::abs(std::sin(12.9898 * static_cast<double>(seed) + 78.233 * k)) * 43758.5453,
                         1.0);
    };
    const dvec3 size(3 + 2 * number(1), 3 + 2 * number(2), 2.4 + number(3));
    Scene scene = closed_room(size);
    const double x = 0.5 + number(4), y = 0.5 + number(5);
    scene.polyhedra.push_back(box("table", Effect::fill, {x, y, 0.7}, {x + 1, y + 0.6, 0.74}));
    scene.polyhedra.push_back(box("leg", Effect::fill, {x + 0.4, y + 0.2, 0}, {x + 0.5, y + 0.3, 0.7}));
    scene.polyhedra.push_back(
        box("partition", Effect::fill, {size.x / 2, 0, 0}, {size.x / 2 + 0.1, size.y / 2, 2}));
    scene.polyhedra.push_back({.id = "ramp",
                               .kind = PolyhedronKind::prism,
                               .effect = Effect::fill,
                               .vertices_m = {dvec3(0, size.y, 0), dvec3(0.9, size.y, 0),
                                              dvec3(0, size.y, 0.8), dvec3(0, size.y - 1.1 - number(6), 0)},
                               .material = MaterialId{}});
    return scene;
}

/// Two rooms side by side along x (0 to 2 and 2.2 to 4.2 m) joined by an opening with two sides or one
/// without thickness.
Scene two_rooms_with_borrowed_light() {
    Scene scene = empty_scene();
    scene.glazings.push_back({.name = "pane", .normal_transmittance = grey(0.8)});
    scene.polyhedra = {box("building", Effect::fill, {-0.3, -0.3, -0.3}, {4.5, 2.3, 2.3}),
                       box("left", Effect::carve, {0, 0, 0}, {2, 2, 2}),
                       box("right", Effect::carve, {2, 0, 0}, {4, 2, 2})};
    scene.polyhedra[2].faces[4].glazing =
        make_id<GlazingId>(1);  // its left face: all of the wall between the two
    return scene;
}

/// A room 3 x 3 x 2.5 m with an unglazed window in its south wall (y = -0.3 to 0), and a slab opposite.
Scene room_with_window() {
    Scene scene = closed_room({3, 3, 2.5});
    scene.polyhedra.push_back(box("window", Effect::carve, {0.5, -0.4, 0.8}, {2.5, 0.1, 2.0}));
    scene.polyhedra.push_back(box("opposite", Effect::fill, {-20, -12, 0}, {20, -11, 3}));
    return scene;
}

}  // namespace

TEST_CASE("every row is well formed and accounts for all light", "[visibility][embree][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    const std::uint64_t seed = GENERATE(1u, 2u, 3u);
    INFO(backend.name << ", seed " << seed);
    const Place place(furnished_room(seed), 1.0, backend);
    std::size_t bad = 0;
    for (std::size_t i = 0; i < place.grid.gather_patch_count; ++i) {
        FormFactorRow row;
        row.patches = {make_id<PatchId>(3)};  // what an earlier call has left
        row.values = {7.0};
        place.visibility->form_factor_row(make_id<PatchId>(i), row);
        REQUIRE(row.patches.size() == row.values.size());
        for (std::size_t k = 0; k < row.values.size(); ++k) {
            bad += k > 0 && row.patches[k - 1] >= row.patches[k];
            bad += index(row.patches[k]) >= place.grid.gather_patch_count || index(row.patches[k]) == i;
            bad += !(row.values[k] > 0.0);
        }
        // Rounding of a sum of some thousand terms.
        CHECK(std::abs(sum_of(row) + row.lost + row.truncated - 1.0) < 1e-11);
        CHECK(row.lost >= 0.0);
    }
    CHECK(bad == 0);
}

TEST_CASE("a closed room loses no light", "[visibility][embree][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    const std::uint64_t seed = GENERATE(range(1u, 7u));
    INFO(backend.name << ", seed " << seed);
    const Place place(furnished_room(seed), 1.0, backend);
    double lost = 0.0, area = 0.0;
    const std::vector<FormFactorRow> rows = place.rows();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        lost += place.grid.patches[i].area_m2 * rows[i].lost;
        area += place.grid.patches[i].area_m2;
    }
    // Rays: edges without shared corners open by one rounding of a float in 10^7 and a second try covers
    // them. Projection: cells whose centre falls between two facets.
    CHECK(lost / area < (backend.name == "embree" ? 1e-6 : 1e-4));
}

TEST_CASE("the faces of a cube see each other by their closed forms", "[visibility][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(closed_room({1, 1, 1}), 0.125, backend);
    // 64 rows. Rays: 64 x 4096 independent ones would err by 0.4 / 512 = 8e-4 rms; strata divide that by 4
    // and more. Projection: half a cell of 256 along an outline, and form factors from the centroid of a
    // patch instead of all of it, whose error falls with the square of the patch: (1 / 8)^2 x 0.2.
    const double tolerance = backend.name == "embree" ? 6e-4 : 3e-3;
    const auto check = [&](const char* from, const char* to, double exact) {
        INFO(from << " to " << to);
        const Place::Between seen = place.between(place.face(from), place.face(to));
        CHECK(seen.form_factor < exact + tolerance);
        CHECK(seen.form_factor >
              exact - tolerance - seen.truncated);  // what a method does not look at it may miss
    };
    check("room/bottom", "room/top", reference::cube_opposed);
    check("room/left", "room/right", reference::cube_opposed);
    check("room/bottom", "room/front", reference::cube_adjacent);
    check("room/back", "room/left", reference::cube_adjacent);
    check("room/top", "room/right", reference::cube_adjacent);
}

TEST_CASE("a point sees the faces of a room by Lambert's formula", "[visibility][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(closed_room({4, 3, 2.5}), 0.5, backend);
    for (const GatherPoint& point :
         {GatherPoint{{1.1, 0.7, 0.8}, {0, 0, 1}}, GatherPoint{{3.9, 2.9, 0}, {0, 0, 1}},
          GatherPoint{{0, 1.3, 1.0}, {1, 0, 0}}}) {
        FormFactorRow row;
        place.visibility->gather_row(point, row);
        for (const char* name :
             {"room/top", "room/left", "room/right", "room/front", "room/back", "room/bottom"}) {
            const FaceId face = place.face(name);
            std::vector<dvec3> above;  // what of the face lies above the point's horizon
            bool coplanar = true;
            for (const Facet& facet : place.building.facets) {
                if (facet.face != face) continue;
                const auto& v = facet.vertices_m;
                for (std::size_t k = 0; k < v.size(); ++k) {
                    const dvec3& a = v[k];
                    const dvec3& b = v[(k + 1) % v.size()];
                    const double height_a = glm::dot(a - point.position_m, point.normal);
                    const double height_b = glm::dot(b - point.position_m, point.normal);
                    coplanar = coplanar && std::abs(height_a) < 1e-9;
                    if (height_a >= 0.0) above.push_back(a);
                    if (height_a * height_b < 0.0)
                        above.push_back(a + height_a / (height_a - height_b) * (b - a));
                }
            }
            const double exact = coplanar || above.size() < 3
                                     ? 0.0
                                     : reference::point_to_polygon(point.position_m, point.normal, above);
            INFO(name << " from " << point.position_m.x << " " << point.position_m.y << " "
                      << point.position_m.z);
            // Rays: 128 x 128 strata, of which an outline of the face crosses up to some 200: 200^0.5 / 2 of
            // 16384. Projection: half a cell along the outline, up to 2 / 256 of the hemi-cube in the worst
            // place.
            const double tolerance = backend.name == "embree" ? 1e-3 : 5e-3;
            CHECK(place.share(row, face) < exact + tolerance);
            CHECK(place.share(row, face) > exact - tolerance - row.truncated);
        }
        CHECK(std::abs(sum_of(row) + row.lost + row.truncated - 1.0) < 1e-11);
    }
}

TEST_CASE("exchanges between whole faces are reciprocal", "[visibility][embree][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    const std::uint64_t seed = GENERATE(1u, 4u);
    INFO(backend.name << ", seed " << seed);
    const Place place(furnished_room(seed), 0.5, backend);
    const std::size_t faces = place.building.faces.size();
    std::vector<double> exchange(faces * faces), truncated(faces);
    const std::vector<FormFactorRow> rows = place.rows();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Patch& patch = place.grid.patches[i];
        for (std::size_t k = 0; k < rows[i].values.size(); ++k)
            exchange[index(patch.face) * faces + index(place.grid.patches[index(rows[i].patches[k])].face)] +=
                patch.area_m2 * rows[i].values[k];
        truncated[index(patch.face)] += patch.area_m2 * rows[i].truncated;
    }
    double gap = 0.0, exchanged = 0.0, missed = 0.0;
    for (std::size_t a = 0; a < faces; ++a)
        for (std::size_t b = 0; b < a; ++b) {
            gap += std::abs(exchange[a * faces + b] - exchange[b * faces + a]);
            exchanged += exchange[a * faces + b] + exchange[b * faces + a];
        }
    for (const double t : truncated)
        missed += t;
    // Rays: some 40 patches of 4096 rays to a face, half of them strata on an outline: 0.5 / sqrt(40 x 4096)
    // of each, and more for narrow faces. Projection: narrow faces are thinner than the cells and seen from
    // the centroids of patches alone. The rest is what the method says it does not look at.
    CHECK(gap <= (backend.name == "embree" ? 0.004 : 0.03) * exchanged + 2 * missed);
}

TEST_CASE("light does not pass through furniture", "[visibility][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene scene = closed_room({2, 2, 2});
    // A slab that parts the room but for nothing: below sees below, above sees above.
    scene.polyhedra.push_back(box("slab", Effect::fill, {0, 0, 0.9}, {2, 2, 1.0}));
    const Place place(scene, 0.5, backend);
    const Place::Between up = place.between(place.face("room/bottom"), place.face("room/top"));
    CHECK(up.form_factor == 0.0);
    const Place::Between shelf = place.between(place.face("room/bottom"), place.face("slab/bottom"));
    const reference::Interval side{0, 2};
    const double exact = reference::parallel_rectangles(side, side, side, side, 0.9);
    CHECK(std::abs(shelf.form_factor - exact) < (backend.name == "embree" ? 2e-3 : 2e-2) + shelf.truncated);
}

TEST_CASE("apertures catch light in form factors and let it pass to the eye",
          "[visibility][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(room_with_window(), 0.25, backend);
    REQUIRE(place.building.apertures.size() == 1);
    const Aperture& aperture = place.building.apertures[0];

    const GatherPoint point{{1.5, 2.0, 1.2}, {0, -1, 0}};
    FormFactorRow row;
    place.visibility->gather_row(point, row);
    // The reveals are 0.3 m deep: seen from here they hide nothing of the window's outer plane but its
    // margin.
    const std::vector<dvec3> opening{{0.5, 0, 0.8}, {2.5, 0, 0.8}, {2.5, 0, 2.0}, {0.5, 0, 2.0}};
    double reveals = 0.0;
    for (const char* name : {"window/bottom", "window/top", "window/left", "window/right"})
        reveals += place.share(row, place.face(name));
    const double through = reveals + place.share(row, aperture.face);
    CHECK(std::abs(through - reference::point_to_polygon(point.position_m, point.normal, opening)) < 5e-3);
    CHECK(place.share(row, aperture.face) > 0.1);

    // Straight out: the slab opposite; upwards through the window: the sky; aside: the room.
    const std::vector<dvec3> directions{
        {0, -1, 0}, glm::normalize(dvec3(0, -2.3, 0.7)), glm::normalize(dvec3(1, -0.9, 0))};
    std::vector<FacetId> seen(3);
    place.visibility->first_seen(point, directions, seen);
    REQUIRE(seen[0] != FacetId::none);
    CHECK(place.building.facets[index(seen[0])].environment == Environment::outdoor);
    CHECK(place.building.facets[index(seen[0])].normal.y > 0.999);
    CHECK(seen[1] == FacetId::none);
    REQUIRE(seen[2] != FacetId::none);
    CHECK(place.building.facets[index(seen[2])].face == place.face("room/right"));
}

TEST_CASE("each side of an inner aperture belongs to its own room", "[visibility][embree][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(two_rooms_with_borrowed_light(), 0.5, backend);
    REQUIRE(place.building.apertures.size() == 1);
    REQUIRE(place.building.apertures[0].inner);
    const FaceId one = place.building.apertures[0].face;
    const FaceId other = place.building.faces[index(one)].other_side.value();
    const bool one_is_left = place.building.faces[index(one)].normal.x < 0.0;
    const FaceId left_pane = one_is_left ? one : other;
    const FaceId right_pane = one_is_left ? other : one;
    // The rooms are cubes.
    const double tolerance = backend.name == "embree" ? 2e-3 : 2e-2;
    const auto check = [&](FaceId from, FaceId to, double exact) {
        const Place::Between seen = place.between(from, to);
        CHECK(std::abs(seen.form_factor - exact) < tolerance + seen.truncated);
    };
    check(place.face("left/left"), left_pane, reference::cube_opposed);
    check(place.face("right/right"), right_pane, reference::cube_opposed);
    check(place.face("left/bottom"), left_pane, reference::cube_adjacent);
    check(left_pane, place.face("left/left"), reference::cube_opposed);
    check(place.face("left/left"), right_pane, 0.0);
    check(place.face("right/right"), left_pane, 0.0);
    check(left_pane, place.face("right/right"), 0.0);
}

TEST_CASE("the back of a polygon takes light away, both sides of a two-sided one give it back",
          "[visibility][embree][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    const bool two_sided = GENERATE(false, true);
    INFO(backend.name << (two_sided ? ", two sides" : ", one side"));
    Scene scene = closed_room({2, 2, 2});
    scene.polygons.push_back({.id = "board",  // facing up
                              .vertices_m = {{0.5, 0.5, 1}, {1.5, 0.5, 1}, {1.5, 1.5, 1}, {0.5, 1.5, 1}},
                              .material = MaterialId{},
                              .side = Environment::indoor,
                              .two_sided = two_sided});
    const Place place(scene, 0.5, backend);
    const GatherPoint below{{1, 1, 0.5}, {0, 0, 1}}, above{{1, 1, 1.5}, {0, 0, -1}};
    const std::vector<dvec3> board = scene.polygons[0].vertices_m;
    const double exact = reference::point_to_polygon(below.position_m, below.normal, board);
    FormFactorRow row;
    place.visibility->gather_row(above, row);
    CHECK(std::abs(place.share(row, place.face("board")) - exact) < 0.01);
    place.visibility->gather_row(below, row);
    CHECK(place.share(row, place.face("board")) == 0.0);
    CHECK(std::abs(row.lost - (two_sided ? 0.0 : exact)) < 0.01);

    std::vector<FacetId> seen(1);
    const std::vector<dvec3> up{{0, 0, 1}}, down{{0, 0, -1}};
    place.visibility->first_seen(below, up, seen);
    REQUIRE(seen[0] != FacetId::none);
    CHECK(place.building.facets[index(seen[0])].normal.z == (two_sided ? -1.0 : 1.0));
    place.visibility->first_seen(above, down, seen);
    REQUIRE(seen[0] != FacetId::none);
    CHECK(place.building.facets[index(seen[0])].normal.z == 1.0);
}

TEST_CASE("first seen directions agree with the walls of a convex room", "[visibility][embree][analytic]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(closed_room({4, 3, 2.5}), 0.5, backend);
    const GatherPoint point{{1.7, 1.1, 0.6}, glm::normalize(dvec3(1, 2, 3))};
    std::vector<dvec3> directions;
    for (int k = 0; k < 999; ++k) {                                           // not a multiple of any packet
        const double z = -1.0 + 2.0 * (k + 0.5) / 999, angle = 2.399963 * k;  // golden spiral
        const double r = std::sqrt(1 - z * z);
        const dvec3 d(r * std::cos(angle), r * std::sin(angle), z);
        if (glm::dot(d, point.normal) > 0.05) directions.push_back(d);
    }
    std::vector<FacetId> seen(directions.size());
    place.visibility->first_seen(point, directions, seen);
    std::size_t wrong = 0;
    for (std::size_t k = 0; k < directions.size(); ++k) {
        double nearest = 1e9;
        dvec3 normal{};
        for (int axis = 0; axis < 3; ++axis) {
            const double d = directions[k][axis];
            const double wall = d > 0 ? dvec3(4, 3, 2.5)[axis] : 0.0;
            const double t = (wall - point.position_m[axis]) / d;
            if (t < nearest) {
                nearest = t;
                normal = {};
                normal[axis] = d > 0 ? -1.0 : 1.0;
            }
        }
        wrong += seen[k] == FacetId::none ||
                 glm::distance(place.building.facets[index(seen[k])].normal, normal) > 1e-9;
    }
    // A projection may place a direction in the cell beside its own; rays may not.
    CHECK(static_cast<double>(wrong) <=
          (backend.name == "embree" ? 0.0 : 0.02 * static_cast<double>(directions.size())));
}

TEST_CASE("a picture shows what is first seen through its pixels", "[visibility][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(room_with_window(), 0.5, backend);
    const View view{.id = "window",
                    .from_m = {1.2, 2.7, 1.3},
                    .to_m = {1.6, 0, 1.4},
                    .field_of_view_rad = 1.4,
                    .width = 41,  // not a multiple of a tile
                    .height = 30};
    std::vector<FacetId> picture(41 * 30);
    const Camera camera = make_camera(view);
    place.visibility->view_facets(camera, 0, 30, picture);
    std::vector<dvec3> directions;
    for (int row = 0; row < 30; ++row)
        for (int column = 0; column < 41; ++column)
            directions.push_back(camera.ray(column + 0.5, row + 0.5).direction);
    std::vector<FacetId> seen(directions.size());
    place.visibility->first_seen({camera.eye_m, camera.forward}, directions, seen);
    std::size_t different = 0;
    std::map<FacetId, int> kinds;
    for (std::size_t k = 0; k < picture.size(); ++k) {
        different += picture[k] != seen[k];
        ++kinds[picture[k]];
    }
    CHECK(static_cast<double>(different) <= (backend.name == "embree" ? 0.0 : 0.1 * 41 * 30));
    CHECK(kinds.contains(FacetId::none));
    CHECK(kinds.size() > 6);
}

TEST_CASE("pictures of any method differ in pixels on edges only", "[visibility][embree]") {
    const Scene scene = furnished_room(6);
    const View views[] = {
        // From above through the room, whose ceiling the plane of the view cuts off; at a slant; from outside, perspective.
        {.id = "plan", .kind = ViewKind::parallel, .from_m = {2.5, 2, 2.3}, .to_m = {2.5, 2, 0}, .up = {0, 1, 0}, .width_m = 6.1},
        {.id = "axonometry", .kind = ViewKind::parallel, .from_m = {3, 3, 2.2}, .to_m = {1, 0.5, 0.6}, .width_m = 5.3},
        {.id = "outside", .kind = ViewKind::parallel, .from_m = {9, -8, 7}, .to_m = {2, 2, 1}, .width_m = 9},
        {.id = "perspective", .from_m = {2.6, 2.7, 1.9}, .to_m = {1, 0.4, 0.7}, .field_of_view_rad = 1.4},
        {.id = "fisheye", .kind = ViewKind::fisheye, .from_m = {2.6, 2.7, 1.9}, .to_m = {1, 0.4, 0.7}, .field_of_view_rad = pi},
        {.id = "equal area", .kind = ViewKind::fisheye, .projection = FisheyeProjection::equal_area, .from_m = {2.6, 2.7, 1.9},
         .to_m = {1, 0.4, 0.7}, .field_of_view_rad = pi},
        {.id = "panorama", .kind = ViewKind::panorama, .from_m = {2.6, 2.7, 1.9}, .to_m = {1, 0.4, 0.7}},
        // Cut open: from above the roof, by two planes at a slant from outside, all around from inside.
        {.id = "cut plan", .kind = ViewKind::parallel, .from_m = {2.5, 2, 9}, .to_m = {2.5, 2, 0}, .up = {0, 1, 0}, .width_m = 6.1,
         .cut_planes = {{{0, 0, 1.2}, {0, 0, 1}}}, .see_through = SeeThrough::backs},
        {.id = "cut perspective", .from_m = {9, -8, 7}, .to_m = {2, 2, 1}, .field_of_view_rad = 0.7,
         .cut_planes = {{{2.5, 0, 0}, glm::normalize(dvec3(2, -1, 0))}, {{0, 0, 2.1}, glm::normalize(dvec3(0.1, -0.2, 1))}}},
        {.id = "cut fisheye", .kind = ViewKind::fisheye, .from_m = {2.6, 2.7, 1.9}, .to_m = {1, 0.4, 0.7}, .field_of_view_rad = pi,
         .cut_planes = {{{1.5, 1.5, 1}, glm::normalize(dvec3(1, 1, 0.5))}, {{0, 0, 0.1}, {0, 0, -1}}}},
        {.id = "cut panorama", .kind = ViewKind::panorama, .from_m = {2.6, 2.7, 1.9}, .to_m = {1, 0.4, 0.7},
         .cut_planes = {{{1, 0, 0}, {-1, 0, 0}}}, .see_through = SeeThrough::backs},
        {.id = "through backs", .from_m = {3, 3, -1}, .to_m = {2, 2, 1}, .field_of_view_rad = 1.4, .see_through = SeeThrough::backs},
        {.id = "through walls", .kind = ViewKind::parallel, .from_m = {9, -8, 7}, .to_m = {2, 2, 1}, .width_m = 9,
         .see_through = SeeThrough::walls},
        {.id = "fisheye through walls", .kind = ViewKind::fisheye, .from_m = {9, -8, 7}, .to_m = {2, 2, 1}, .field_of_view_rad = 1.0,
         .see_through = SeeThrough::walls}};
    for (View view : views) {
        view.width = 150;
        view.height = 101;
        const Camera camera = make_camera(view);
        std::vector<RayHit> hits;
        std::vector<std::vector<FacetId>> pictures;
        for (const Backend& backend : all_backends()) {
            const Place place(scene, 1.0, backend);
            pictures.emplace_back(150 * 101);
            // In two parts: what a picture shows does not depend on how much is drawn at a time.
            const std::span<FacetId> seen(pictures.back());
            place.visibility->view_facets(camera, 0, 37, seen.first(37 * 150));
            place.visibility->view_facets(camera, 37, 101, seen.subspan(37 * 150));
            if (!hits.empty()) continue;
            for (int row = 0; row < view.height; ++row) {
                for (int column = 0; column < view.width; ++column) {
                    const Camera::Ray ray = camera.ray(column + 0.5, row + 0.5);
                    hits.push_back(camera.shows(column + 0.5, row + 0.5)
                                       ? cast_ray(place.building, ray.origin_m, ray.direction, false, camera.reach(ray), view.see_through)
                                       : RayHit{});
                }
            }
        }
        INFO(view.id);
        int wrong = 0, undecided = 0;
        std::map<FacetId, int> kinds;
        for (std::size_t k = 0; k < hits.size(); ++k) {
            // Vertices, origins and directions of Embree are floats: some 1e-6 m in this room. Pixels are 4 cm wide or more.
            if (hits[k].edge_margin_rad < 1e-5 || hits[k].depth_margin < 1e-5) {
                ++undecided;
                continue;
            }
            ++kinds[hits[k].facet];
            for (const std::vector<FacetId>& picture : pictures) wrong += picture[k] != hits[k].facet;
        }
        // Drawn in blocks, a fisheye may miss what is narrower than half a pixel: one pixel or two of the 15150.
        const bool round = view.kind == ViewKind::fisheye || view.kind == ViewKind::panorama;
        CHECK(wrong <= (round ? 4 : 0));
        CHECK(undecided < 30);
        CHECK(kinds.size() > 3);
    }
}

TEST_CASE("what is seen does not depend on where the building stands", "[visibility][embree][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    Scene near = furnished_room(5), far = near;
    const dvec3 offset(3000, -2000, 0);
    for (Polyhedron& p : far.polyhedra)
        for (dvec3& v : p.vertices_m)
            v += offset;
    const Place here(near, 1.0, backend), there(far, 1.0, backend);
    REQUIRE(here.grid.gather_patch_count == there.grid.gather_patch_count);
    const std::vector<FormFactorRow> a = here.rows(), b = there.rows();
    double different = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::vector<double> change(here.grid.gather_patch_count);
        for (std::size_t k = 0; k < a[i].values.size(); ++k)
            change[index(a[i].patches[k])] += a[i].values[k];
        for (std::size_t k = 0; k < b[i].values.size(); ++k)
            change[index(b[i].patches[k])] -= b[i].values[k];
        for (const double c : change)
            different += std::abs(c);
    }
    // Coordinates of 3 km leave 5e-13 m: a ray in 10^6 may fall on the other side of an edge, a cell centre
    // likewise.
    CHECK(different / static_cast<double>(a.size()) < 1e-3);
}

TEST_CASE("rows of any method have the same bits for any number of threads", "[visibility][embree]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Scene scene = furnished_room(6);
    std::vector<FormFactorRow> first;
    for (const int threads : {1, 2, 3, 8}) {
        INFO(threads << " threads");
        const ThreadLimit limit(threads);
        const Place place(scene, 1.0, backend);
        const std::vector<FormFactorRow> rows = place.rows();
        if (threads == 1) first = rows;
        bool equal = true;
        for (std::size_t i = 0; i < rows.size(); ++i)
            equal = equal && rows[i].patches == first[i].patches && rows[i].values == first[i].values &&
                    rows[i].errors == first[i].errors && rows[i].lost == first[i].lost &&
                    rows[i].truncated == first[i].truncated && rows[i].escaped == first[i].escaped;
        CHECK(equal);
    }
}

TEST_CASE("repaired form factors of any method conserve flux",
          "[visibility][embree][form_factors][property]") {
    const Backend backend = GENERATE(from_range(all_backends()));
    INFO(backend.name);
    const Place place(furnished_room(7), 1.0, backend);
    NoProgress quiet;
    const FormFactors f = compute_form_factors(*place.visibility, place.grid, {}, quiet);
    std::vector<double> arriving(f.row_count());
    for (std::size_t i = 0; i < f.row_count(); ++i) {
        double sum = 0.0;
        for (std::size_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) {
            sum += f.value[e];
            arriving[f.column[e]] += place.grid.patches[i].area_m2 * f.value[e];
        }
        FormFactorRow row;
        place.visibility->form_factor_row(make_id<PatchId>(i), row);
        CHECK(std::abs(sum - (1.0 - row.lost)) < 1e-9);  // the repair stops at 1e-10
    }
    for (std::size_t i = 0; i < f.row_count(); ++i)
        CHECK(std::abs(arriving[i] / place.grid.patches[i].area_m2 - 1.0) < 1e-4);  // what was lost, at most
    CHECK(f.quality.repair_change < 0.5);
    CHECK(f.quality.reciprocity_gap < 0.5);
}
