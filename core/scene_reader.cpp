#include "core/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <unordered_set>

#include "core/errors.h"
#include "core/json_document.h"
#include "core/material_reader.h"
#include "core/picture_reader.h"
#include "core/polyhedra.h"
#include "core/scene_keys.h"
#include "core/scene_sources.h"
#include "core/scene_values.h"
#include "core/simple_polygon.h"
#include "core/sky_reader.h"
#include "core/units.h"
#include "core/view_reader.h"

namespace naturel {
namespace {

using glm::dvec3;

/// More sensors than this would fill the memory of a large machine, whatever the method.
constexpr double most_points = 1e7;

constexpr Range spacing_range{0.001, 1000.0, "m"};

/// Ids that must differ from each other.
class UniqueIds {
public:
    std::string read(const JsonValue& value) {
        const std::string& id = read_id(value);
        if (!seen_.insert(id).second)
            value.refuse(fmt::format("the id {} is already taken (choose another)", in_quotes(id)));
        return id;
    }

private:
    std::unordered_set<std::string> seen_;
};

OutdoorOptions read_outdoors(const JsonValue& value) {
    const SceneObject object(value, scene_keys::outdoors);
    OutdoorOptions outdoors;
    outdoors.interreflections = read_integer(object, "interreflections", {0, 100}, outdoors.interreflections);
    return outdoors;
}

/// Number of a face named by role or by number from 1.
std::size_t read_face(const JsonValue& key, PolyhedronKind kind) {
    const std::vector<std::string_view> roles = face_roles(kind);
    std::vector<std::string> numbers;
    for (std::size_t i = 0; i < roles.size(); ++i)
        numbers.push_back(std::to_string(i + 1));
    std::vector<std::string_view> known;
    for (std::size_t i = 0; i < roles.size(); ++i) {
        if (key.text() == roles[i] || key.text() == numbers[i]) return i;
        known.push_back(roles[i]);
    }
    known.insert(known.end(), numbers.begin(), numbers.end());
    key.refuse(fmt::format("there is no face {} {}", in_quotes(key.text()), suggestion(key.text(), known)));
}

/// A name of a surface or of a glazing, or a list with one of each.
FaceFinish read_finish(const JsonValue& value, const MaterialNames& names, Effect effect) {
    const std::vector<JsonValue> items = value.kind() == JsonKind::list ? value.items() : std::vector{value};
    FaceFinish finish;
    for (const JsonValue& item : items) {
        if (names.glazings.contains(read_text(item))) {
            if (effect == Effect::fill)
                item.refuse("a filled polyhedron opens no aperture (glazings belong to carved ones)");
            if (finish.glazing) item.refuse("this is the second glazing of the face (one at most)");
            finish.glazing = read_glazing_name(item, names);
        } else {
            if (finish.material) item.refuse("this is the second material of the face (one at most)");
            finish.material = read_material_name(item, names);
        }
    }
    if (items.empty()) value.refuse("the list is empty (a material, a glazing, or one of each)");
    return finish;
}

void check_solid(const JsonValue& vertices, const Polyhedron& p) {
    const std::array<dvec3, 3> edges{p.vertices_m[1] - p.vertices_m[0], p.vertices_m[2] - p.vertices_m[0],
                                     p.vertices_m[3] - p.vertices_m[0]};
    double largest_base_m2 = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (glm::length(edges[i]) < shortest_m) {
            vertices.refuse(
                fmt::format("{}: vertices 0 and {} coincide (the three edges from vertex 0 need a length)",
                            in_quotes(p.id), i + 1));
        }
        largest_base_m2 = std::max(largest_base_m2, glm::length(glm::cross(edges[i], edges[(i + 1) % 3])));
    }
    const double thickness_m = std::abs(glm::dot(glm::cross(edges[0], edges[1]), edges[2])) / largest_base_m2;
    if (!(thickness_m >= shortest_m)) {
        vertices.refuse(fmt::format(
            "{} is flat: its four vertices lie in one plane (the edges from vertex 0 must span a volume)",
            in_quotes(p.id)));
    }
}

Polyhedron read_polyhedron(const JsonValue& value, const MaterialNames& names, UniqueIds& ids) {
    const SceneObject object(value, scene_keys::polyhedron);
    Polyhedron p;
    p.id = ids.read(object.at("id"));
    p.kind = read_word<PolyhedronKind>(object.at("kind"), {{"parallelepiped", PolyhedronKind::parallelepiped},
                                                           {"prism", PolyhedronKind::prism},
                                                           {"tetrahedron", PolyhedronKind::tetrahedron}});
    p.effect = read_word<Effect>(object.at("effect"), {{"fill", Effect::fill}, {"carve", Effect::carve}});
    p.material = read_material_name(object.at("material"), names);
    if (const auto glazing = object.find("glazing")) {
        if (p.effect == Effect::fill)
            glazing->refuse("a filled polyhedron opens no aperture (glazings belong to carved ones)");
        p.glazing = read_glazing_name(*glazing, names);
    }

    const JsonValue vertices = object.at("vertices");
    const std::vector<JsonValue> corners = read_list(vertices, "4 points");
    if (corners.size() != p.vertices_m.size()) {
        vertices.refuse(fmt::format(
            "{} has {} vertices (a polyhedron is given by 4: an origin and the ends of its three edges)",
            in_quotes(p.id), corners.size()));
    }
    for (std::size_t i = 0; i < corners.size(); ++i)
        p.vertices_m[i] = read_position(corners[i]);
    check_solid(vertices, p);

    if (const auto faces = object.find("faces")) {
        for (const auto& [key, finish] : read_table(*faces, "faces and materials")) {
            FaceFinish& face = p.faces[read_face(key, p.kind)];
            if (face.material || face.glazing)
                key.refuse("this face is named twice, by role and by number (once is enough)");
            face = read_finish(finish, names, p.effect);
        }
    }
    return p;
}

struct Rings {
    std::vector<dvec3> vertices_m;
    std::vector<std::vector<dvec3>> holes_m;
};

std::vector<dvec3> read_ring(const JsonValue& value) {
    std::vector<dvec3> ring;
    for (const JsonValue& point : read_list(value, "points"))
        ring.push_back(read_position(point));
    return ring;
}

Rings read_rings(const SceneObject& object, const std::string& id) {
    Rings rings{.vertices_m = read_ring(object.at("vertices")), .holes_m = {}};
    const std::vector<JsonValue> holes = read_list(object, "holes", "outlines");
    for (const JsonValue& hole : holes)
        rings.holes_m.push_back(read_ring(hole));
    if (const auto fault = find_polygon_fault(rings.vertices_m, rings.holes_m)) {
        const JsonValue& at = fault->hole ? holes[*fault->hole] : object.at("vertices");
        at.refuse(fmt::format("{}: {}", in_quotes(id), fault->text));
    }
    return rings;
}

SurfacePolygon read_polygon(const JsonValue& value, const MaterialNames& names, UniqueIds& ids) {
    const SceneObject object(value, scene_keys::polygon);
    SurfacePolygon polygon;
    polygon.id = ids.read(object.at("id"));
    polygon.material = read_material_name(object.at("material"), names);
    if (const auto side = object.find("side")) {
        polygon.side = read_word<Environment>(
            *side, {{"indoor", Environment::indoor}, {"outdoor", Environment::outdoor}});
    }
    if (const auto two_sided = object.find("two_sided")) polygon.two_sided = read_boolean(*two_sided);
    Rings rings = read_rings(object, polygon.id);
    polygon.vertices_m = std::move(rings.vertices_m);
    polygon.holes_m = std::move(rings.holes_m);
    return polygon;
}

AperturePolygon read_aperture(const JsonValue& value, const MaterialNames& names, UniqueIds& ids) {
    const SceneObject object(value, scene_keys::aperture);
    AperturePolygon aperture;
    aperture.id = ids.read(object.at("id"));
    if (const auto glazing = object.find("material")) aperture.glazing = read_glazing_name(*glazing, names);
    Rings rings = read_rings(object, aperture.id);
    aperture.vertices_m = std::move(rings.vertices_m);
    aperture.holes_m = std::move(rings.holes_m);
    return aperture;
}

void read_geometry(const SceneObject& root, const MaterialNames& names, Scene& scene) {
    const std::vector<JsonValue> polyhedra = read_list(root, "polyhedra", "polyhedra");
    const std::vector<JsonValue> polygons = read_list(root, "polygons", "polygons");
    const std::vector<JsonValue> apertures = read_list(root, "apertures", "apertures");
    if (polyhedra.empty() && polygons.empty()) {
        root.refuse("the scene has no geometry (at least one polyhedron or polygon is needed)");
    }
    UniqueIds ids;
    for (const JsonValue& value : polyhedra)
        scene.polyhedra.push_back(read_polyhedron(value, names, ids));
    for (const JsonValue& value : polygons)
        scene.polygons.push_back(read_polygon(value, names, ids));
    for (const JsonValue& value : apertures)
        scene.apertures.push_back(read_aperture(value, names, ids));
}

GridOptions read_grid(const JsonValue& value, GridOptions grid) {
    const SceneObject object(value, scene_keys::grid);
    grid.spacing_m = read_number(object, "spacing_m", spacing_range, grid.spacing_m);
    grid.outdoor_spacing_m = read_number(object, "outdoor_spacing_m", spacing_range, grid.outdoor_spacing_m);
    if (const auto zones = object.find("zones")) grid.zones = read_boolean(*zones);
    grid.sliver_area = read_number(object, "sliver_area", {0.0, 0.5}, grid.sliver_area);
    grid.sliver_aspect = read_number(object, "sliver_aspect", {4.0, 1e6}, grid.sliver_aspect);
    if (const auto value_of_refine = object.find("refine")) {
        const SceneObject refine(*value_of_refine, scene_keys::refine);
        grid.refine.levels = read_integer(refine, "levels", {0, 4}, grid.refine.levels);
        grid.refine.contrast = read_number(refine, "contrast", {0.01, 1.0}, grid.refine.contrast);
    }
    return grid;
}

DirectOptions read_direct(const JsonValue& value, DirectOptions direct) {
    const SceneObject object(value, scene_keys::direct);
    if (const auto method = object.find("method")) {
        direct.method = read_word<DirectMethod>(
            *method, {{"article", DirectMethod::article}, {"adaptive", DirectMethod::adaptive}});
    }
    direct.tolerance = read_number(object, "tolerance", {1e-6, 0.5}, direct.tolerance);
    return direct;
}

SensorPoint read_sensor_point(const JsonValue& value) {
    const std::vector<JsonValue> items = read_list(value, "x, y, z, nx, ny, nz");
    if (items.size() == 3) return {.position_m = read_position(value)};
    constexpr Range c = coordinate_range;
    const auto [x, y, z, nx, ny, nz] =
        read_numbers<6>(value, "x, y, z, and nx, ny, nz unless upwards", {c, c, c, c, c, c});
    const dvec3 normal(nx, ny, nz);
    const double length = glm::length(normal);
    if (length < shortest_m) value.refuse("the normal nx, ny, nz has no length (it must point somewhere)");
    return {.position_m = {x, y, z}, .normal = normal / length};
}

/// Counts the points of sensor grids as if nothing were cut away, and stops what no memory could hold.
class PointBudget {
public:
    void spend(const JsonValue& at, double area_m2, double spacing_m) {
        points_ += area_m2 / (spacing_m * spacing_m);
        if (points_ > most_points) {
            at.refuse(fmt::format("up to here the sensor grids have about {:.2g} points (at most {:.2g}: make "
                                  "their spacing_m larger)",
                                  points_, most_points));
        }
    }

private:
    double points_ = 0.0;
};

/// Upper limit of the floor area of the indoor air: the shadows that what encloses it casts on the ground.
double indoor_shadow_m2(const Scene& scene) {
    const auto shadow_m2 = [](std::vector<dvec3> ring) {
        for (dvec3& p : ring)
            p.z = 0.0;
        return polygon_area_m2(ring);
    };
    double area_m2 = 0.0;
    for (const Polyhedron& p : scene.polyhedra) {
        if (p.effect == Effect::fill) continue;
        for (const PolyhedronFace& face : polyhedron_faces(p)) {
            if (face.outward.z > 0.0) area_m2 += shadow_m2(face.vertices_m);
        }
    }
    for (const SurfacePolygon& p : scene.polygons) {
        if (p.side == Environment::indoor) area_m2 += shadow_m2(p.vertices_m);
    }
    return area_m2;
}

SensorGrid read_sensor_grid(const JsonValue& value, double indoor_area_m2, PointBudget& budget) {
    const SceneObject object(value, scene_keys::sensor_grid);
    SensorGrid grid;
    grid.z_m = read_number(object, "z", coordinate_range, grid.z_m);
    grid.spacing_m = read_number(object, "spacing_m", spacing_range, grid.spacing_m);
    grid.margin_m = read_number(object, "margin_m", {0.0, 1000.0, "m"}, grid.margin_m);
    budget.spend(value, indoor_area_m2, grid.spacing_m);
    return grid;
}

SensorSet read_sensors(const JsonValue& value, UniqueIds& ids, double indoor_area_m2, PointBudget& budget) {
    const SceneObject object(value, scene_keys::sensor);
    SensorSet set;
    set.id = ids.read(object.at("id"));
    const auto grid = object.find("grid"), points = object.find("points");
    if (grid.has_value() == points.has_value()) {
        object.refuse(fmt::format("{} of grid and points {} given (exactly one is needed)",
                                  grid ? "both" : "neither", grid ? "are" : "is"));
    }
    if (grid) set.grid = read_sensor_grid(*grid, indoor_area_m2, budget);
    if (points) {
        for (const JsonValue& point : read_list(*points, "points"))
            set.points.push_back(read_sensor_point(point));
        if (set.points.empty()) points->refuse("the list is empty (at least one point is needed)");
    }
    return set;
}

void check_version(const JsonValue& value) {
    if (value.kind() != JsonKind::number || value.number() != 1.0) {
        value.refuse(fmt::format("{} is not a known version of the scene format (1 would be right)",
                                 value.describe()));
    }
}

Scene read_document(const JsonDocument& document, SideFiles& files, const SceneDefaults& defaults) {
    const SceneObject root(document.root(), scene_keys::scene);
    check_version(root.at("naturel"));

    Scene scene;
    scene.name = std::filesystem::path(document.file_name()).stem().string();
    if (const auto name = root.find("name")) scene.name = read_name(*name);
    for (const std::string_view key : {"description", "$schema"}) {
        if (const auto text = root.find(key)) read_text(*text);
    }
    if (const auto primaries = root.find("primaries")) scene.primaries = read_primaries(*primaries);
    const Primaries primaries(scene.primaries);
    if (const auto ground = root.find("ground")) scene.ground = read_ground(*ground, primaries);
    if (const auto outdoors = root.find("outdoors")) scene.outdoors = read_outdoors(*outdoors);
    const auto grid = root.find("grid"), direct = root.find("direct");
    scene.grid = grid ? read_grid(*grid, defaults.grid) : defaults.grid;
    scene.direct = direct ? read_direct(*direct, defaults.direct) : defaults.direct;
    const MaterialNames names = read_materials(root.at("materials"), files, scene);
    read_geometry(root, names, scene);
    const SkyAndSun light = read_sky_and_sun(root, primaries, files);
    scene.sky = light.sky;
    scene.sun = light.sun;
    scene.north_rad = light.north_rad;
    UniqueIds sensor_ids, view_ids;
    PointBudget sensor_budget;
    const double indoor_area_m2 = indoor_shadow_m2(scene);
    for (const JsonValue& value : read_list(root, "sensors", "sensor sets")) {
        scene.sensors.push_back(read_sensors(value, sensor_ids, indoor_area_m2, sensor_budget));
    }
    if (const auto value = root.find("picture")) read_picture(*value, scene.picture);
    for (const JsonValue& value : read_list(root, "views", "views"))
        scene.views.push_back(read_view(value, view_ids.read(SceneObject(value, scene_keys::view).at("id")), scene));
    return scene;
}

Scene read_text_and_files(std::string_view text, const std::string& file_name, SideFiles& files, const SceneDefaults& defaults) {
    const JsonDocument document(std::string(text), file_name);
    Scene scene = read_document(document, files, defaults);
    scene.source_sha256 = files.sha256_with(text);
    return scene;
}

}  // namespace

std::string read_json_file(const std::filesystem::path& file, std::string_view kind) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) {
        throw InputError(file.string(), fmt::format("there is no such {} file (check the path)", kind));
    }
    if (std::filesystem::is_directory(status)) {
        throw InputError(file.string(), fmt::format("this is a directory (a {} file is needed)", kind));
    }
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw InputError(file.string(), fmt::format("the {} file cannot be opened (check its permissions)", kind));
    // One byte more than a document may have: an endless file is refused like a long one.
    std::string text;
    std::array<char, 1 << 16> block;
    while (text.size() <= JsonDocument::max_bytes && stream.read(block.data(), block.size()).gcount() > 0) {
        text.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    }
    if (stream.bad())
        throw InputError(file.string(), fmt::format("the {} file cannot be read to its end (check the disk)", kind));
    return text;
}

Scene read_scene_text(std::string_view text, const std::string& file_name, const SceneDefaults& defaults) {
    SideFiles files(std::filesystem::path(file_name).parent_path());
    return read_text_and_files(text, file_name, files, defaults);
}

Scene read_scene_sources(std::span<const SourceFile> sources, const SceneDefaults& defaults) {
    NATUREL_EXPECT(!sources.empty());
    SideFiles files({}, sources.subspan(1));
    return read_text_and_files(sources.front().text, sources.front().name, files, defaults);
}

Scene read_scene_with_sources(const std::filesystem::path& file, const SceneDefaults& defaults, std::vector<SourceFile>& sources) {
    SideFiles files(file.parent_path());
    std::string text = read_json_file(file, "scene");
    Scene scene = read_text_and_files(text, file.string(), files, defaults);
    sources = files.sources();
    sources.insert(sources.begin(), {file.filename().string(), std::move(text)});
    return scene;
}

Scene read_scene(const std::filesystem::path& file, const SceneDefaults& defaults) {
    return read_scene_text(read_json_file(file, "scene"), file.string(), defaults);
}

}  // namespace naturel
