#include "core/view_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "core/picture_reader.h"
#include "core/polyhedra.h"
#include "core/units.h"

namespace naturel {
namespace {

using glm::dvec3;

/// The words of "kind". Plans and sections are parallel views that the scene frames.
enum class KindWord { perspective, parallel, fisheye, panorama, plan, section };

constexpr Range pixels{1, most_pixels_per_side, "pixels"};
constexpr Range width_range{0.001, 1e5, "m"};

/// Of what a plan or a section is fitted to, on each side, as a share of its size.
constexpr double frame_margin = 0.05;

struct Bounds {
    dvec3 low_m{std::numeric_limits<double>::infinity()}, high_m{-std::numeric_limits<double>::infinity()};
    bool empty() const { return !(low_m.x <= high_m.x); }
    void include(const std::vector<dvec3>& points_m) {
        for (const dvec3& p : points_m) low_m = glm::min(low_m, p), high_m = glm::max(high_m, p);
    }
};

/// Around the rooms; around all there is where there are none.
Bounds bounds_of_rooms(const Scene& scene) {
    Bounds rooms, all;
    for (const Polyhedron& p : scene.polyhedra) {
        for (const PolyhedronFace& face : polyhedron_faces(p)) {
            all.include(face.vertices_m);
            if (p.effect == Effect::carve) rooms.include(face.vertices_m);
        }
    }
    for (const SurfacePolygon& p : scene.polygons) {
        all.include(p.vertices_m);
        if (p.side == Environment::indoor) rooms.include(p.vertices_m);
    }
    return rooms.empty() ? all : rooms;
}

/// Refuses keys that mean nothing in this kind of view.
void refuse_keys(const SceneObject& object, std::initializer_list<std::string_view> keys, std::string_view why) {
    for (const std::string_view key : keys)
        if (const auto found = object.find(key)) found->refuse(std::string(why));
}

JsonValue required(const SceneObject& object, std::string_view key) {
    const auto found = object.find(key);
    if (!found) object.refuse(fmt::format("the key \"{}\" is missing (it must be given here)", key));
    return *found;
}

/// Eye, target and up of a view that looks from one place to another.
void read_direction_of_view(const SceneObject& object, const JsonValue& value, View& view) {
    view.from_m = read_position(required(object, "from"));
    view.to_m = read_position(required(object, "to"));
    const double distance_m = glm::length(view.to_m - view.from_m);
    if (distance_m < shortest_m)
        object.at("to").refuse("the view looks at its own place (\"to\" must differ from \"from\")");
    const auto up = object.find("up");
    if (up) view.up = read_direction(*up);
    const double sine = glm::length(glm::cross(view.to_m - view.from_m, view.up)) / distance_m;
    if (sine >= 1e-6) return;  // else the camera's axes would be rounding noise
    if (!up && view.kind == ViewKind::fisheye) {
        view.up = {0, 1, 0};
    } else {
        up.value_or(value).refuse(
            "\"up\" points along the view (it must point aside, e.g. [0, 1, 0] when looking down)");
    }
}

/// Frames a parallel view of the rooms whose cut plane goes through `on_plane_m`; forward: into what stays.
void frame_rooms(const SceneObject& object, const Scene& scene, const dvec3& on_plane_m, const dvec3& forward, View& view) {
    const Bounds rooms = bounds_of_rooms(scene);
    if (rooms.empty()) object.refuse("the scene has nothing that could be cut (polyhedra or polygons)");
    view.kind = ViewKind::parallel;
    view.cut_planes.push_back({on_plane_m, -forward});
    const dvec3 right = glm::cross(forward, view.up), half_m = 0.5 * (rooms.high_m - rooms.low_m);
    const dvec3 centre_m = 0.5 * (rooms.low_m + rooms.high_m);
    const double width_m = 2 * glm::dot(half_m, glm::abs(right)), height_m = 2 * glm::dot(half_m, glm::abs(view.up));
    const auto own_width_m = object.find("width_m");
    const double frame_m = frame_margin * std::max(width_m, height_m);
    view.width_m = own_width_m ? read_number(*own_width_m, width_range) : width_m + 2 * frame_m;
    if (!object.has("height")) {
        const double rows = std::round(view.width * (height_m + 2 * frame_m) / (width_m + 2 * frame_m));
        view.height = static_cast<int>(std::clamp(rows, 1.0, pixels.high));
    }
    // From a little before the plane, so that the plane is what cuts.
    const dvec3 on_plane = centre_m + glm::dot(forward, on_plane_m - centre_m) * forward;
    view.from_m = on_plane - forward;
    view.to_m = on_plane;
}

void read_plan(const SceneObject& object, const Scene& scene, View& view) {
    view.up = {0, 1, 0};
    frame_rooms(object, scene, {0, 0, read_number(required(object, "z"), coordinate_range)}, {0, 0, -1}, view);
}

void read_section(const SceneObject& object, const Scene& scene, View& view) {
    const JsonValue line = required(object, "line");
    const std::vector<JsonValue> ends = read_list(line, "two points [x, y]");
    if (ends.size() != 2) line.refuse(fmt::format("the list has {} values (2 are needed: points [x, y])", ends.size()));
    std::array<dvec3, 2> points_m;
    for (std::size_t k = 0; k < 2; ++k) {
        const auto xy = read_numbers<2>(ends[k], "x, y", {coordinate_range, coordinate_range});
        points_m[k] = {xy[0], xy[1], 0};
    }
    const dvec3 along = points_m[1] - points_m[0];
    if (glm::length(along) < shortest_m) line.refuse("the line has no length (its two points must differ)");
    view.up = {0, 0, 1};
    frame_rooms(object, scene, points_m[0], glm::normalize(glm::cross(view.up, along)), view);
}

std::vector<CutPlane> read_cut_planes(const JsonValue& value) {
    constexpr std::size_t most = 16;
    std::vector<CutPlane> planes;
    for (const JsonValue& item : read_list(value, "planes")) {
        const SceneObject object(item, scene_keys::cut_plane);
        planes.push_back({read_position(object.at("point")), read_direction(object.at("normal"))});
    }
    if (planes.size() > most) value.refuse(fmt::format("the list has {} planes (at most {})", planes.size(), most));
    return planes;
}

}  // namespace

View read_view(const JsonValue& value, const std::string& id, const Scene& scene) {
    const SceneObject object(value, scene_keys::view);
    View view;
    view.id = id;
    KindWord kind = KindWord::perspective;
    if (const auto word = object.find("kind")) {
        kind = read_word<KindWord>(*word, {{"perspective", KindWord::perspective}, {"parallel", KindWord::parallel},
                                           {"fisheye", KindWord::fisheye}, {"panorama", KindWord::panorama},
                                           {"plan", KindWord::plan}, {"section", KindWord::section}});
    }
    if (const auto planes = object.find("cut_planes")) view.cut_planes = read_cut_planes(*planes);
    if (kind == KindWord::fisheye) view.width = 1024;
    view.width = read_integer(object, "width", pixels, view.width);
    if (kind == KindWord::fisheye) view.height = view.width;
    if (kind == KindWord::panorama) view.height = std::max(1, view.width / 2);
    view.height = read_integer(object, "height", pixels, view.height);

    if (kind != KindWord::plan) refuse_keys(object, {"z"}, "only a plan has a height (\"kind\" is \"plan\")");
    if (kind != KindWord::section) refuse_keys(object, {"line"}, "only a section has a line (\"kind\" is \"section\")");
    if (kind != KindWord::fisheye) refuse_keys(object, {"projection"}, "only a fisheye has a projection (\"kind\" is \"fisheye\")");
    switch (kind) {
        case KindWord::perspective:
            refuse_keys(object, {"width_m"},
                        "a perspective view has no width in metres (\"fov_deg\" says how much it shows, or \"kind\" is \"parallel\")");
            view.field_of_view_rad = radians_from_degrees(read_number(object, "fov_deg", {1.0, 170.0, "degrees"}, 70.0));
            break;
        case KindWord::parallel: {
            view.kind = ViewKind::parallel;
            refuse_keys(object, {"fov_deg"}, "a parallel view has no angle (\"width_m\" says how much it shows)");
            const auto width_m = object.find("width_m");
            if (!width_m) object.refuse("the parallel view has no \"width_m\" (how many metres its picture is wide)");
            view.width_m = read_number(*width_m, width_range);
            break;
        }
        case KindWord::fisheye:
            view.kind = ViewKind::fisheye;
            refuse_keys(object, {"width_m"}, "a fisheye has no width in metres (\"fov_deg\" says how much it shows)");
            view.field_of_view_rad = radians_from_degrees(read_number(object, "fov_deg", {1.0, 180.0, "degrees"}, 180.0));
            if (const auto projection = object.find("projection")) {
                view.projection = read_word<FisheyeProjection>(
                    *projection, {{"equidistant", FisheyeProjection::equidistant}, {"equal_area", FisheyeProjection::equal_area}});
            }
            break;
        case KindWord::panorama:
            view.kind = ViewKind::panorama;
            refuse_keys(object, {"width_m", "fov_deg"}, "a panorama shows everything around (it has neither width nor angle)");
            break;
        case KindWord::plan:
            refuse_keys(object, {"from", "to", "up", "fov_deg"}, "a plan is framed by the scene (\"z\" says where it cuts)");
            read_plan(object, scene, view);
            break;
        case KindWord::section:
            refuse_keys(object, {"from", "to", "up", "fov_deg"}, "a section is framed by the scene (\"line\" says where it cuts)");
            read_section(object, scene, view);
            break;
    }
    if (kind != KindWord::plan && kind != KindWord::section) read_direction_of_view(object, value, view);

    if (!view.cut_planes.empty()) view.see_through = SeeThrough::backs;
    if (const auto through = object.find("see_through")) {
        view.see_through = read_word<SeeThrough>(
            *through, {{"nothing", SeeThrough::nothing}, {"backs", SeeThrough::backs}, {"walls", SeeThrough::walls}});
    }
    view.samples = read_integer(object, "samples", {1, 16}, view.samples);
    if (const auto quality = object.find("quality")) {
        view.quality = read_word<PictureQuality>(
            *quality, {{"interpolated", PictureQuality::interpolated}, {"gather", PictureQuality::gather}});
    }
    view.picture = scene.picture;
    if (const auto own = object.find("picture")) read_picture(*own, view.picture);
    const double megapixels = 1e-6 * view.width * view.height;
    if (megapixels > most_megapixels) {
        value.refuse(fmt::format("the picture has {} x {} pixels, {:.1f} million (at most {:.0f} million)",
                                 view.width, view.height, megapixels, most_megapixels));
    }
    return view;
}

}  // namespace naturel
