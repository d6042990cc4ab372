#include "cli/csv_writer.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <vector>

#include "cli/csv_table.h"
#include "core/parallel.h"

namespace naturel {
namespace {

/// Position, normal and the columns of add_values().
const std::string point_columns =
    "x_m,y_m,z_m,nx,ny,nz,sky_lx,sun_lx,erc_lx,irc_lx,total_lx,total_r_lx,total_g_lx,total_b_lx,"
    "daylight_factor_percent";

void add_values(CsvTable& table, const Result& result, const PointIlluminance& point) {
    const Primaries& primaries = result.primaries;
    table.cell(primaries.luminous(point.direct.sky_lx))
        .cell(primaries.luminous(point.direct.sun_lx))
        .cell(primaries.luminous(point.direct.outdoor_lx.total()))
        .cell(primaries.luminous(point.indirect_lx.total()))
        .cell(primaries.luminous(point.total_lx()))
        .cell(point.total_lx())
        .cell(daylight_factor_percent(result, point));
}

/// What the ERC is made of: after all other columns, whose order is fixed.
const std::string erc_columns = ",erc_ground_lx,erc_buildings_lx";

void add_erc(CsvTable& table, const Result& result, const DirectIlluminance& direct) {
    const Components parts = components_of(result.primaries, direct, {});
    table.cell(parts.erc_ground_lx).cell(parts.erc_buildings_lx);
}

/// As many empty cells: where there is no light to speak of, 0 lx would be a value.
void add_no_values(CsvTable& table) {
    constexpr int value_columns = 9;
    for (int k = 0; k < value_columns; ++k)
        table.cell(std::string_view());
}

std::string_view word(Medium medium) {
    switch (medium) {
        case Medium::solid:
            return "solid";
        case Medium::indoor_air:
            return "indoor_air";
        case Medium::outdoor_air:
            return "outdoor_air";
    }
    return {};
}

/// A table whose row k is made by add_row(table, k), many rows at a time on several threads.
template <class AddRow>
std::string in_parallel(const std::string& header, std::size_t rows, const AddRow& add_row) {
    constexpr std::size_t rows_per_block = 128;  // about 30 kB of text
    std::vector<std::string> blocks((rows + rows_per_block - 1) / rows_per_block);
    parallel_for(blocks.size(), 1, [&](std::size_t b) {
        CsvTable table;
        const std::size_t end = std::min(rows, (b + 1) * rows_per_block);
        for (std::size_t k = b * rows_per_block; k < end; ++k) add_row(table, k);
        blocks[b] = std::move(table).take();
    });
    std::string text = header + '\n';
    for (const std::string& block : blocks) text += block;
    return text;
}

}  // namespace

std::string sensors_csv(const Result& result) {
    return in_parallel("id,set," + point_columns + ",medium" + erc_columns, result.solution.sensors.size(), [&](CsvTable& table, std::size_t k) {
        const Sensor& sensor = result.solution.sensors[k];
        table.cell(std::string_view(sensor.id)).cell(std::string_view(result.scene.sensors[sensor.set].id));
        table.cell(sensor.point.position_m).cell(sensor.point.normal);
        if (sensor.medium == Medium::solid)
            add_no_values(table);
        else
            add_values(table, result, result.solution.sensor_values[k]);
        table.cell(word(sensor.medium));
        if (sensor.medium == Medium::solid)
            table.cell(std::string_view()).cell(std::string_view());
        else
            add_erc(table, result, result.solution.sensor_values[k].direct);
        table.end_row();
    });
}

std::string nodes_csv(const Result& result) {
    return in_parallel("id,face," + point_columns + erc_columns, result.grid.nodes.size(), [&](CsvTable& table, std::size_t k) {
        const Node& node = result.grid.nodes[k];
        const Face& face = result.building.faces[index(node.face)];
        table.cell(k).cell(std::string_view(face.name)).cell(node.position_m).cell(face.normal);
        add_values(table, result, result.solution.nodes[k]);
        add_erc(table, result, result.solution.nodes[k].direct);
        table.end_row();
    });
}

std::string patches_csv(const Result& result) {
    const std::string header =
        "id,face,area_m2,x_m,y_m,z_m,nx,ny,nz,reflectance_r,reflectance_g,reflectance_b,sky_lx,sun_lx,erc_lx,irc_lx,"
        "total_lx,total_r_lx,total_g_lx,total_b_lx,exitance_lm_m2,exitance_r_lm_m2,exitance_g_lm_m2,exitance_b_lm_m2" +
        erc_columns;
    return in_parallel(header, result.grid.gather_patch_count, [&](CsvTable& table, std::size_t k) {
        const Patch& patch = result.grid.patches[k];
        const Face& face = result.building.faces[index(patch.face)];
        const Band3 reflectance =
            face.aperture
                ? result.scene.glazings[index(result.building.apertures[index(*face.aperture)].glazing)]
                      .inner_reflectance
                : result.scene.materials[index(face.material)].reflectance;
        const DirectIlluminance& direct = result.solution.patch_components[k];
        const Band3 indirect_lx = result.solution.radiosity.indirect_illuminance_lx[k].total();
        const Band3 total_lx = result.solution.patch_direct_lx[k].total() + indirect_lx;
        const Band3 exitance_lm_m2 = result.solution.radiosity.exitance_lm_m2[k].total();
        const Primaries& primaries = result.primaries;
        table.cell(k)
            .cell(std::string_view(face.name))
            .cell(patch.area_m2)
            .cell(patch.centroid_m)
            .cell(patch.normal);
        table.cell(reflectance)
            .cell(primaries.luminous(direct.sky_lx))
            .cell(primaries.luminous(direct.sun_lx))
            .cell(primaries.luminous(direct.outdoor_lx.total()))
            .cell(primaries.luminous(indirect_lx))
            .cell(primaries.luminous(total_lx))
            .cell(total_lx)
            .cell(primaries.luminous(exitance_lm_m2))
            .cell(exitance_lm_m2);
        add_erc(table, result, direct);
        table.end_row();
    });
}

}  // namespace naturel
