#include "cli/glb_writer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "cli/json_text.h"
#include "cli/little_endian.h"
#include "core/colour.h"
#include "core/errors.h"

namespace naturel {
namespace {

using Json = nlohmann::ordered_json;

// Numbers of the glTF 2.0 specification.
constexpr int component_float = 5126, component_uint32 = 5125;
constexpr int array_buffer = 34962, element_array_buffer = 34963;
constexpr std::uint32_t glb_magic = 0x46546C67, glb_version = 2, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;

/// A corner of a triangle: of a patch, or its middle.
struct Vertex {
    glm::dvec3 position_m;
    SurfaceLight light;
};

/// A face as triangles.
struct FaceTriangles {
    std::vector<Vertex> vertices;
    std::vector<std::uint32_t> indices;
};

/// Triangles have the middle of their patch as a corner, where the value is interpolated as in pictures: a diagonal would show.
FaceTriangles triangles_of(const PatchGrid& grid, const SurfaceMesh& mesh, std::size_t first_patch, std::size_t end_patch) {
    FaceTriangles face;
    std::unordered_map<std::uint32_t, std::uint32_t> number;
    const auto corner = [&](std::uint32_t vertex) {
        const auto [found, is_new] = number.try_emplace(vertex, static_cast<std::uint32_t>(face.vertices.size()));
        if (is_new) face.vertices.push_back({mesh.positions_m[vertex], mesh.light[vertex]});
        return found->second;
    };
    for (std::size_t p = first_patch; p < end_patch; ++p) {
        const auto outline = mesh.outline_of(p);
        if (outline.size() == 3) {
            for (const std::uint32_t vertex : outline) face.indices.push_back(corner(vertex));
            continue;
        }
        const auto middle = static_cast<std::uint32_t>(face.vertices.size());
        face.vertices.push_back({grid.patches[p].centroid_m, mesh.centre_light[p]});
        for (std::size_t k = 0; k < outline.size(); ++k)
            for (const std::uint32_t index : {middle, corner(outline[k]), corner(outline[(k + 1) % outline.size()])})
                face.indices.push_back(index);
    }
    return face;
}

/// A file in the making: arrays of one kind share a view of the buffer.
class GlbBuilder {
public:
    GlbBuilder(const Result& result, const SurfaceMesh& mesh) : result_(result), mesh_(mesh) {
        if (mesh.positions_m.empty()) return;
        // Far from the origin single precision would move corners: places are told from the middle of the scene.
        glm::dvec3 low = mesh.positions_m.front(), high = low;
        for (const glm::dvec3& place : mesh.positions_m) low = glm::min(low, place), high = glm::max(high, place);
        middle_m_ = glm::round(0.5 * (low + high));
    }

    std::string file() {
        const PatchGrid& grid = result_.grid;
        const auto group = [&](const char* name, std::size_t first, std::size_t last, int material) {
            const double white_cd_m2 = white_of_patches_cd_m2(result_, mesh_, first, last);
            Json children = Json::array();
            for (std::size_t p = first, end = 0; p < last; p = end) {
                end = p;
                while (end < last && grid.patches[end].face == grid.patches[p].face) ++end;
                children.push_back(add_face(triangles_of(grid, mesh_, p, end),
                                            result_.building.faces[index(grid.patches[p].face)].name, material, white_cd_m2));
            }
            if (children.empty()) return;
            nodes_.push_back({{"name", name}, {"children", std::move(children)}});
            if (material != window) nodes_.back()["extras"] = {{"white_cd_m2", white_cd_m2}};
            groups_.push_back(nodes_.size() - 1);
        };
        group("indoor", 0, grid.indoor_patch_count, surface);
        group("windows", grid.indoor_patch_count, grid.gather_patch_count, window);
        group("outdoor", grid.gather_patch_count, grid.patches.size(), outdoor_surface);
        return assemble();
    }

private:
    enum MaterialNumber { surface, outdoor_surface, window };

    std::size_t add_face(const FaceTriangles& face, const std::string& name, int material, double white_cd_m2) {
        Json attributes{{"POSITION", add_positions(face)}};
        if (material != window) attributes["COLOR_0"] = add_colours(face, white_cd_m2);
        attributes["_LUMINANCE"] = add_values(
            face, [&](const SurfaceLight& light) { return result_.primaries.luminous(light.luminance_cd_m2); });
        if (material != outdoor_surface) {
            attributes["_ILLUMINANCE"] = add_values(face, [](const SurfaceLight& light) { return light.illuminance_lx(); });
            attributes["_SKY"] = add_values(face, [](const SurfaceLight& light) { return light.parts.sky_lx; });
            attributes["_SUN"] = add_values(face, [](const SurfaceLight& light) { return light.parts.sun_lx; });
            attributes["_ERC"] = add_values(face, [](const SurfaceLight& light) {
                return light.parts.erc_ground_lx + light.parts.erc_buildings_lx;
            });
            attributes["_IRC"] = add_values(face, [](const SurfaceLight& light) { return light.parts.irc_lx; });
            attributes["_DAYLIGHT_FACTOR"] =
                add_values(face, [](const SurfaceLight& light) { return light.daylight_factor_percent; });
        }
        accessors_.push_back({{"bufferView", 0},
                              {"byteOffset", indices_.size()},
                              {"componentType", component_uint32},
                              {"count", face.indices.size()},
                              {"type", "SCALAR"}});
        indices_ += bytes_of(std::span<const std::uint32_t>(face.indices));
        meshes_.push_back({{"name", name},
                           {"primitives",
                            Json::array({{{"attributes", attributes}, {"indices", accessors_.size() - 1}, {"material", material}}})}});
        nodes_.push_back({{"name", name}, {"mesh", meshes_.size() - 1}});
        return nodes_.size() - 1;
    }

    std::size_t add_positions(const FaceTriangles& face) {
        std::array<float, 3> low{}, high{};
        const std::size_t offset = vectors_.size();
        for (std::size_t v = 0; v < face.vertices.size(); ++v)
            for (int axis = 0; axis < 3; ++axis) {
                const auto value = static_cast<float>(face.vertices[v].position_m[axis] - middle_m_[axis]);
                const auto k = static_cast<std::size_t>(axis);
                low[k] = v == 0 ? value : std::min(low[k], value);
                high[k] = v == 0 ? value : std::max(high[k], value);
                append_bytes(vectors_, value);
            }
        const std::size_t accessor = add_accessor(1, offset, face.vertices.size(), "VEC3");
        accessors_[accessor]["min"] = low;
        accessors_[accessor]["max"] = high;
        return accessor;
    }

    std::size_t add_colours(const FaceTriangles& face, double white_cd_m2) {
        const std::size_t offset = vectors_.size();
        for (const Vertex& vertex : face.vertices) {
            const glm::dvec3 colour = linear_srgb(result_.primaries, 1.0 / white_cd_m2 * vertex.light.luminance_cd_m2);
            for (int channel = 0; channel < 3; ++channel)
                append_bytes(vectors_, static_cast<float>(std::clamp(colour[channel], 0.0, 1.0)));
        }
        return add_accessor(1, offset, face.vertices.size(), "VEC3");
    }

    template <class ValueOf>
    std::size_t add_values(const FaceTriangles& face, const ValueOf& value_of) {
        const std::size_t offset = scalars_.size();
        for (const Vertex& vertex : face.vertices) append_bytes(scalars_, static_cast<float>(value_of(vertex.light)));
        return add_accessor(2, offset, face.vertices.size(), "SCALAR");
    }

    std::size_t add_accessor(int view, std::size_t offset, std::size_t count, const char* type) {
        accessors_.push_back({{"bufferView", view},
                              {"byteOffset", offset},
                              {"componentType", component_float},
                              {"count", count},
                              {"type", type}});
        return accessors_.size() - 1;
    }

    std::string assemble() {
        // x east, y north, z up -> x east, y up, z south.
        nodes_.push_back({{"name", result_.scene.name},
                          {"rotation", {-std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)}},
                          {"translation", {middle_m_.x, middle_m_.z, -middle_m_.y}}});
        if (!groups_.empty()) nodes_.back()["children"] = groups_;
        const auto unlit = [](const char* name, const Json& colour) {
            return Json{{"name", name},
                        {"pbrMetallicRoughness", {{"baseColorFactor", colour}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
                        {"extensions", {{"KHR_materials_unlit", Json::object()}}}};
        };
        Json glass = unlit("window", {0.6, 0.8, 0.9, 0.25});
        glass["alphaMode"] = "BLEND";
        glass["doubleSided"] = true;
        Json gltf{{"asset", {{"version", "2.0"}, {"generator", "naturel " NATUREL_VERSION}}},
                  {"extensionsUsed", {"KHR_materials_unlit"}},
                  {"scene", 0},
                  {"scenes", Json::array({{{"name", result_.scene.name}, {"nodes", {nodes_.size() - 1}}}})},
                  {"nodes", nodes_},
                  {"materials", {unlit("indoor surface", {1, 1, 1, 1}), unlit("outdoor surface", {1, 1, 1, 1}), glass}}};
        if (!meshes_.empty()) {
            gltf["meshes"] = std::move(meshes_);
            gltf["accessors"] = std::move(accessors_);
            const std::size_t length = indices_.size() + vectors_.size() + scalars_.size();
            gltf["buffers"] = Json::array({{{"byteLength", length}}});
            gltf["bufferViews"] = {
                {{"buffer", 0}, {"byteOffset", 0}, {"byteLength", indices_.size()}, {"target", element_array_buffer}},
                {{"buffer", 0}, {"byteOffset", indices_.size()}, {"byteLength", vectors_.size()}, {"byteStride", 12}, {"target", array_buffer}},
                {{"buffer", 0},
                 {"byteOffset", indices_.size() + vectors_.size()},
                 {"byteLength", scalars_.size()},
                 {"byteStride", 4},
                 {"target", array_buffer}}};
        }
        std::string text = json_line(gltf);
        text.resize((text.size() + 3) / 4 * 4, ' ');

        const std::string_view parts[]{indices_, vectors_, scalars_};  // each a whole number of 4-byte words
        std::size_t binary = 0;
        for (const std::string_view part : parts) binary += part.size();
        const std::size_t header = 12, chunk_header = 8;
        const std::size_t length = header + chunk_header + text.size() + (binary > 0 ? chunk_header + binary : 0);
        NATUREL_EXPECT(length <= 0xffff'ffffu);  // ten million cells make less than 3 GB
        std::string bytes;
        bytes.reserve(length);
        for (const std::size_t word : {std::size_t{glb_magic}, std::size_t{glb_version}, length, text.size(), std::size_t{json_chunk}})
            append_bytes(bytes, static_cast<std::uint32_t>(word));
        bytes += text;
        if (binary > 0) {
            append_bytes(bytes, static_cast<std::uint32_t>(binary));
            append_bytes(bytes, binary_chunk);
            for (const std::string_view part : parts) bytes += part;
        }
        return bytes;
    }

    const Result& result_;
    const SurfaceMesh& mesh_;
    glm::dvec3 middle_m_{};
    Json nodes_ = Json::array(), meshes_ = Json::array(), accessors_ = Json::array();
    std::vector<std::size_t> groups_;
    std::string indices_, vectors_, scalars_;
};

}  // namespace

std::string scene_glb(const Result& result, const SurfaceMesh& mesh) {
    return GlbBuilder(result, mesh).file();
}

}  // namespace naturel
