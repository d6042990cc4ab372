#include "cli/vtp_writer.h"

#include <fmt/format.h>

#include <cstdint>

#include "cli/base64.h"
#include "cli/little_endian.h"
#include "core/units.h"

namespace naturel {
namespace {

/// Declarations of arrays, and behind them what they hold.
class VtpBuilder {
public:
    std::string head;

    /// type, number: of VTK and of C++.
    template <class Number>
    void array(std::string_view type, std::string_view name, const std::vector<Number>& values, int components = 1) {
        head += fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n",
                            type, name, components, appended_.size());
        append(bytes_of(std::span<const Number>(values)));
    }

    /// Texts of a field, each ended by a zero.
    void texts(std::string_view name, const std::vector<std::string>& values) {
        std::string bytes;
        for (const std::string& value : values) bytes += value + '\0';
        head += fmt::format("<Array type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"appended\" offset=\"{}\"/>\n", name,
                            values.size(), appended_.size());
        append(bytes);
    }

    std::string_view appended() const { return appended_; }

private:
    void append(std::string_view bytes) {
        std::string block;
        append_bytes(block, static_cast<std::uint64_t>(bytes.size()));
        block += bytes;
        appended_ += base64(block);
    }

    std::string appended_;
};

/// The light of points or cells, one array per component.
void add_light(VtpBuilder& file, const Result& result, std::span<const SurfaceLight> light) {
    const auto values = [&](std::string_view name, const auto& value_of) {
        std::vector<float> numbers;
        numbers.reserve(light.size());
        for (const SurfaceLight& place : light) numbers.push_back(static_cast<float>(value_of(place)));
        file.array("Float32", name, numbers);
    };
    values("total_lx", [](const SurfaceLight& place) { return place.illuminance_lx(); });
    values("sky_lx", [](const SurfaceLight& place) { return place.parts.sky_lx; });
    values("sun_lx", [](const SurfaceLight& place) { return place.parts.sun_lx; });
    values("erc_ground_lx", [](const SurfaceLight& place) { return place.parts.erc_ground_lx; });
    values("erc_buildings_lx", [](const SurfaceLight& place) { return place.parts.erc_buildings_lx; });
    values("irc_lx", [](const SurfaceLight& place) { return place.parts.irc_lx; });
    if (result.solution.outdoors.horizontal_illuminance().value > 0.0)
        values("daylight_factor_percent", [](const SurfaceLight& place) { return place.daylight_factor_percent; });
    values("exitance_lm_m2", [&](const SurfaceLight& place) { return pi * result.primaries.luminous(place.luminance_cd_m2); });
    std::vector<float> bands;
    bands.reserve(3 * light.size());
    for (const SurfaceLight& place : light)
        for (const double value : {place.total_lx.r, place.total_lx.g, place.total_lx.b}) bands.push_back(static_cast<float>(value));
    file.array("Float32", "total_rgb_lx", bands, 3);
}

}  // namespace

std::string scene_vtp(const Result& result, const SurfaceMesh& mesh) {
    const PatchGrid& grid = result.grid;
    const std::size_t cells = grid.gather_patch_count;
    // Outdoor patches come last, and so do their corners.
    std::size_t points = grid.nodes.size();
    for (std::size_t k = 0; k < mesh.first[cells]; ++k) points = std::max(points, std::size_t{mesh.outlines[k]} + 1);

    std::vector<std::int32_t> patch, face, is_window;
    for (std::size_t p = 0; p < cells; ++p) {
        patch.push_back(static_cast<std::int32_t>(p));
        face.push_back(static_cast<std::int32_t>(index(grid.patches[p].face)));
        is_window.push_back(p >= grid.indoor_patch_count);
    }
    std::vector<std::string> names;
    for (const Face& each : result.building.faces) names.push_back(each.name);
    std::vector<double> coordinates;
    for (std::size_t v = 0; v < points; ++v)
        for (int axis = 0; axis < 3; ++axis) coordinates.push_back(mesh.positions_m[v][axis]);
    const std::vector<std::int32_t> connectivity(mesh.outlines.begin(), mesh.outlines.begin() + mesh.first[cells]);
    const std::vector<std::int32_t> offsets(mesh.first.begin() + 1, mesh.first.begin() + 1 + static_cast<std::ptrdiff_t>(cells));

    VtpBuilder file;
    file.head =
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n";
    file.texts("naturel", {NATUREL_VERSION});
    file.texts("scene", {result.scene.name});
    file.texts("scene_sha256", {result.scene.source_sha256});
    file.texts("backend", {std::string(result.visibility.name())});
    file.texts("face_names", names);
    file.head += fmt::format("</FieldData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
                             "NumberOfPolys=\"{}\">\n<PointData Scalars=\"total_lx\">\n",
                             points, cells);
    add_light(file, result, {mesh.light.data(), points});
    file.head += "</PointData>\n<CellData Scalars=\"total_lx\">\n";
    file.array("Int32", "patch", patch);
    file.array("Int32", "face", face);
    file.array("Int32", "is_window", is_window);
    add_light(file, result, {mesh.patch_light.data(), cells});
    file.head += "</CellData>\n<Points>\n";
    file.array("Float64", "Points", coordinates, 3);
    file.head += "</Points>\n<Polys>\n";
    file.array("Int32", "connectivity", connectivity);
    file.array("Int32", "offsets", offsets);
    return file.head + "</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"base64\">\n_" + std::string(file.appended()) +
           "\n</AppendedData>\n</VTKFile>\n";
}

}  // namespace naturel
