#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "cli/base64.h"
#include "tests/catch.h"
#include "tests/cli/packed.h"
#include "tests/cli/program.h"
#include "tests/cli/tables.h"

using namespace naturel::tests;

namespace {

using Json = nlohmann::json;
using Place = std::array<double, 3>;

/// The small room without views, its grid refined so that the corners of small patches lie on the edges of large ones.
const std::map<std::string, std::string>& files() {
    static const std::map<std::string, std::string> written = [] {
        const TemporaryFolder folder;
        std::string scene(small_room);
        scene.replace(scene.find("\"views\""), std::string::npos, "\"views\": []}");
        const std::string grid = "\"spacing_m\": 1}";
        scene.replace(scene.find(grid), grid.size(), "\"spacing_m\": 0.8, \"refine\": {\"levels\": 2, \"contrast\": 0.3}}");
        write(folder / "room.json", scene);
        const Outcome outcome =
            run_naturel({"run", (folder / "room.json").string(), "--out", (folder / "out").string(), "--backend", "hemicube",
                         "--cells", "32", "--no-error-estimate", "--no-report"});
        if (outcome.exit_code != 0) throw std::runtime_error(outcome.errors);
        return files_below(folder / "out/hemicube");
    }();
    return written;
}

/// A binary glTF file taken apart.
struct Glb {
    Json json;
    std::string binary;

    explicit Glb(const std::string& bytes) {
        REQUIRE(bytes.substr(0, 4) == "glTF");
        REQUIRE(number_at<std::uint32_t>(bytes, 4) == 2);
        REQUIRE(number_at<std::uint32_t>(bytes, 8) == bytes.size());
        const std::size_t length = number_at<std::uint32_t>(bytes, 12);
        REQUIRE(bytes.substr(16, 4) == "JSON");
        REQUIRE(length % 4 == 0);
        json = Json::parse(bytes.substr(20, length));
        const std::size_t binary_length = number_at<std::uint32_t>(bytes, 20 + length);
        REQUIRE(bytes.substr(24 + length, 4) == std::string("BIN\0", 4));
        REQUIRE(28 + length + binary_length == bytes.size());
        binary = bytes.substr(28 + length);
    }

    /// The numbers of an accessor, component by component.
    std::vector<double> numbers(std::size_t accessor) const {
        const Json& a = json["accessors"][accessor];
        const Json& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
        const std::size_t components = a["type"] == "VEC3" ? 3 : 1, count = a["count"];
        const std::size_t stride = view.value("byteStride", 4 * components), offset = a["byteOffset"];
        // The rules of glTF 2.0, section 3.6.2.4.
        CHECK(offset % 4 == 0);
        CHECK((offset + view["byteOffset"].get<std::size_t>()) % 4 == 0);
        CHECK(stride % 4 == 0);
        REQUIRE(count > 0);
        REQUIRE(offset + stride * (count - 1) + 4 * components <= view["byteLength"].get<std::size_t>());
        std::vector<double> values;
        for (std::size_t k = 0; k < count; ++k)
            for (std::size_t c = 0; c < components; ++c) {
                const std::size_t at = view["byteOffset"].get<std::size_t>() + offset + k * stride + 4 * c;
                values.push_back(a["componentType"] == 5125 ? static_cast<double>(number_at<std::uint32_t>(binary, at))
                                                            : static_cast<double>(number_at<float>(binary, at)));
            }
        return values;
    }
};

Place place_at(const std::vector<double>& numbers, std::size_t k) {
    return {numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]};
}
Place minus(const Place& a, const Place& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Place cross(const Place& a, const Place& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double length(const Place& a) { return std::hypot(a[0], a[1], a[2]); }

/// v turned by a unit quaternion (x, y, z, w): v + 2 q x (q x v + w v).
Place turned(const std::vector<double>& q, const Place& v) {
    const Place axis{q[0], q[1], q[2]}, once = cross(axis, v);
    const Place twice = cross(axis, {once[0] + q[3] * v[0], once[1] + q[3] * v[1], once[2] + q[3] * v[2]});
    return {v[0] + 2 * twice[0], v[1] + 2 * twice[1], v[2] + 2 * twice[2]};
}

}  // namespace

TEST_CASE("base64 gives the examples of RFC 4648", "[cli][mesh]") {
    for (const auto& [plain, coded] : std::vector<std::pair<std::string, std::string>>{
             {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}, {"fooba", "Zm9vYmE="}, {"foobar", "Zm9vYmFy"}, {"\xff\xfe", "//4="}})
        CHECK(naturel::base64(plain) == coded);
}

TEST_CASE("scene.glb keeps the rules of glTF", "[cli][mesh]") {
    const Glb glb(files().at("scene.glb"));
    const Json& json = glb.json;
    CHECK(json["asset"]["version"] == "2.0");
    CHECK(json["extensionsUsed"] == Json{"KHR_materials_unlit"});
    CHECK(json["buffers"][0]["byteLength"] == glb.binary.size());
    std::size_t end = 0;
    for (const Json& view : json["bufferViews"]) {
        CHECK(view["byteOffset"].get<std::size_t>() == end);
        end = view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>();
    }
    CHECK(end == glb.binary.size());
    std::set<std::string> names;
    for (const Json& mesh : json["meshes"]) {
        INFO(mesh["name"]);
        CHECK(names.insert(mesh["name"]).second);
        const Json& primitive = mesh["primitives"][0];
        CHECK(primitive["material"].get<std::size_t>() < json["materials"].size());
        const std::size_t count = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()]["count"];
        for (const auto& [name, accessor] : primitive["attributes"].items()) {
            INFO(name);
            CHECK(json["accessors"][accessor.get<std::size_t>()]["count"] == count);
            const std::vector<double> values = glb.numbers(accessor);
            for (const double value : values) {
                if (!std::isfinite(value)) FAIL_CHECK("not finite");
                if (name == "COLOR_0" && !(value >= 0.0 && value <= 1.0)) FAIL_CHECK("a colour outside [0, 1]");
                if (name[0] == '_' && value < 0.0) FAIL_CHECK("negative light");
            }
            if (name != "POSITION") continue;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                double low = values[axis], high = low;
                for (std::size_t k = axis; k < values.size(); k += 3)
                    low = std::min(low, values[k]), high = std::max(high, values[k]);
                CHECK(json["accessors"][accessor.get<std::size_t>()]["min"][axis].get<double>() == low);
                CHECK(json["accessors"][accessor.get<std::size_t>()]["max"][axis].get<double>() == high);
            }
        }
        const std::vector<double> indices = glb.numbers(primitive["indices"]);
        CHECK(indices.size() % 3 == 0);
        for (const double index : indices)
            if (!(index < static_cast<double>(count))) FAIL_CHECK("an index beyond the vertices");
    }
    CHECK(names.contains("room/bottom"));
    CHECK(names.contains("window/opening"));
    CHECK(names.contains("building/top"));
}

TEST_CASE("scene.glb stands upright where the scene is, and shows what the tables say", "[cli][mesh]") {
    const Glb glb(files().at("scene.glb"));
    const Json& root = glb.json["nodes"][glb.json["scenes"][0]["nodes"][0].get<std::size_t>()];
    const auto rotation = root["rotation"].get<std::vector<double>>();
    const auto translation = root["translation"].get<Place>();
    // glTF: y is up, and the right hand rule keeps x east, z south. Single precision within 4 m: 2.4e-7 m.
    constexpr double rounding_m = 1e-6;
    CHECK(length(minus(turned(rotation, {0, 0, 1}), {0, 1, 0})) < 1e-12);
    CHECK(length(minus(turned(rotation, {1, 0, 0}), {1, 0, 0})) < 1e-12);

    const auto nodes = lines_of(files().at("nodes.csv"));
    constexpr std::array attributes{"_SKY", "_SUN", "_ERC", "_IRC", "_ILLUMINANCE"};  // in the order of the columns
    std::map<std::string, std::vector<std::pair<Place, std::array<double, attributes.size()>>>> nodes_of;
    for (std::size_t k = 1; k < nodes.size(); ++k) {
        const auto cells = cells_of(nodes[k]);
        const Place scene{std::stod(cells[2]), std::stod(cells[3]), std::stod(cells[4])};
        auto& [place, light_lx] = nodes_of[cells[1]].emplace_back();
        place = {scene[0], scene[2], -scene[1]};
        for (std::size_t a = 0; a < attributes.size(); ++a) light_lx[a] = std::stod(cells[8 + a]);
    }
    std::map<std::string, double> area_of;
    const auto patches = lines_of(files().at("patches.csv"));
    for (std::size_t k = 1; k < patches.size(); ++k) area_of[cells_of(patches[k])[1]] += std::stod(cells_of(patches[k])[2]);

    std::size_t found = 0;
    for (const Json& mesh : glb.json["meshes"]) {
        const std::string name = mesh["name"];
        if (!area_of.contains(name)) continue;
        INFO(name);
        const Json& primitive = mesh["primitives"][0];
        const auto positions = glb.numbers(primitive["attributes"]["POSITION"]), indices = glb.numbers(primitive["indices"]);
        std::array<std::vector<double>, attributes.size()> values;
        for (std::size_t a = 0; a < attributes.size(); ++a) values[a] = glb.numbers(primitive["attributes"][attributes[a]]);
        double area_m2 = 0.0;
        for (std::size_t k = 0; k < indices.size(); k += 3) {
            const auto corner = [&](std::size_t i) { return place_at(positions, static_cast<std::size_t>(indices[k + i])); };
            area_m2 += 0.5 * length(cross(minus(corner(1), corner(0)), minus(corner(2), corner(0))));
        }
        CHECK(std::abs(area_m2 - area_of[name]) < 1e-5);
        for (const auto& [place, light_lx] : nodes_of[name]) {
            bool there = false;
            for (std::size_t v = 0; v < values[0].size() && !there; ++v) {
                const Place local = turned(rotation, place_at(positions, v));
                const Place world{local[0] + translation[0], local[1] + translation[1], local[2] + translation[2]};
                // Beside a sunspot several vertices share the place.
                there = length(minus(world, place)) < rounding_m;
                for (std::size_t a = 0; a < attributes.size(); ++a) there = there && std::abs(values[a][v] - light_lx[a]) <= 1e-6 * light_lx.back();
            }
            if (!there) FAIL_CHECK("no vertex has place and value of a node");
            ++found;
        }
    }
    CHECK(found == nodes.size() - 1);
}

TEST_CASE("patches of a face share their corners: no corner of one lies on the edge of another", "[cli][mesh]") {
    const Glb glb(files().at("scene.glb"));
    for (const Json& mesh : glb.json["meshes"]) {
        INFO(mesh["name"]);
        const Json& primitive = mesh["primitives"][0];
        const auto positions = glb.numbers(primitive["attributes"]["POSITION"]), indices = glb.numbers(primitive["indices"]);
        std::size_t cracks = 0;
        for (std::size_t k = 0; k < indices.size(); ++k) {
            const std::size_t next = k % 3 == 2 ? k - 2 : k + 1;
            const Place a = place_at(positions, static_cast<std::size_t>(indices[k]));
            const Place edge = minus(place_at(positions, static_cast<std::size_t>(indices[next])), a);
            for (std::size_t v = 0; v < positions.size() / 3; ++v) {
                const Place d = minus(place_at(positions, v), a);
                const double along = (d[0] * edge[0] + d[1] * edge[1] + d[2] * edge[2]) / length(edge);
                // A micrometre: single precision within 4 m.
                if (along > 1e-5 && along < length(edge) - 1e-5 && length(cross(d, edge)) / length(edge) < 1e-6) ++cracks;
            }
        }
        CHECK(cracks == 0);
    }
}

TEST_CASE("scene.vtp holds the tables of patches and nodes", "[cli][mesh]") {
    const std::string& file = files().at("scene.vtp");
    const std::size_t appended = file.find("<AppendedData encoding=\"base64\">\n_");
    REQUIRE(appended != std::string::npos);
    const std::size_t data = file.find('_', appended) + 1;
    /// The bytes of an array below an element: of points or of cells.
    const auto bytes_of = [&](const std::string& parent, const std::string& name) {
        const std::size_t begin = file.find("<" + parent), end = file.find("</" + parent + ">");
        std::smatch found;
        const std::string part = file.substr(begin, end - begin);
        REQUIRE(std::regex_search(part, found, std::regex("Name=\"" + name + "\"[^>]* offset=\"([0-9]+)\"")));
        const std::size_t offset = data + std::stoul(found[1]);
        const auto size = number_at<std::uint64_t>(from_base64(file.substr(offset, 12)), 0);
        return from_base64(file.substr(offset, (size + 8 + 2) / 3 * 4)).substr(8);
    };
    const auto check = [&](const std::string& parent, const std::string& table, const std::string& name, std::size_t column) {
        INFO(parent << " " << name);
        const std::string bytes = bytes_of(parent, name);
        const auto rows = lines_of(files().at(table));
        REQUIRE(cells_of(rows[0])[column] == name);
        for (std::size_t k = 1; k < rows.size(); ++k) {
            const double expected = std::stod(cells_of(rows[k])[column]);
            // Single precision.
            if (std::abs(number_at<float>(bytes, 4 * (k - 1)) - expected) > 1e-6 * expected) FAIL_CHECK("row " << k);
        }
    };
    check("PointData", "nodes.csv", "total_lx", 12);
    check("PointData", "nodes.csv", "daylight_factor_percent", 16);
    check("PointData", "nodes.csv", "erc_ground_lx", 17);
    check("CellData", "patches.csv", "irc_lx", 15);
    check("CellData", "patches.csv", "total_lx", 16);
    check("CellData", "patches.csv", "exitance_lm_m2", 20);

    const std::size_t cells = lines_of(files().at("patches.csv")).size() - 1;
    const std::string offsets = bytes_of("Polys", "offsets"), connectivity = bytes_of("Polys", "connectivity"),
                      points = bytes_of("Points", "Points");
    REQUIRE(offsets.size() == 4 * cells);
    for (std::size_t k = 0; k < cells; ++k)
        if (number_at<std::int32_t>(offsets, 4 * k) < (k == 0 ? 0 : number_at<std::int32_t>(offsets, 4 * (k - 1))) + 3)
            FAIL_CHECK("a polygon with fewer than three corners");
    CHECK(number_at<std::int32_t>(offsets, 4 * (cells - 1)) * 4 == static_cast<std::int32_t>(connectivity.size()));
    for (std::size_t k = 0; k < connectivity.size(); k += 4)
        if (number_at<std::int32_t>(connectivity, k) >= static_cast<std::int32_t>(points.size() / 24)) FAIL_CHECK("a corner beyond the points");
}
