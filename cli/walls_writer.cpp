#include "cli/walls_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/orientation.h"

namespace naturel {
namespace {

using glm::dvec2;
using glm::dvec3;

// Walls below this share of all walls of a floor are left out unless the sun shines on them.
constexpr double smallest_wall_share = 0.02;

// How far behind the inner side of a wall its window may be: deeper reveals than 1.5 m are rooms.
constexpr double deepest_reveal_m = 1.5;

/// A wall as it is seen from the room.
struct Elevation {
    FaceId face{};
    PaperMap map;          ///< scale and place come later
    PlaneExtent extent_m;  ///< along map.right and map.up from map.origin_m; upright walls: map.up is z
    bool upright = true;
};

Elevation elevation_of(const Building& building, FaceId id) {
    const Face& face = building.faces[index(id)];
    const dvec3& n = face.normal;
    Elevation elevation{.face = id, .map = {}, .extent_m = {}, .upright = std::abs(n.z) < 1e-6};
    elevation.map.up = glm::normalize(dvec3{0, 0, 1} - n.z * n);
    elevation.map.right = glm::cross(elevation.map.up, n);
    for (const Ring& ring : face.region)
        for (const PlanePoint& p : ring) {
            const dvec3 v = face.plane.to_world(p);
            elevation.extent_m.add({glm::dot(v, elevation.map.right), glm::dot(v, elevation.map.up)});
        }
    return elevation;
}

/// Windows behind the openings of a wall.
void draw_windows(SvgSheet& sheet, const Building& building, const Elevation& elevation) {
    const Face& face = building.faces[index(elevation.face)];
    Ring corners;
    for (const Ring& ring : face.region)
        corners.insert(corners.end(), ring.begin(), ring.end());
    const Region whole{convex_hull(std::move(corners))};
    for (const Aperture& aperture : building.apertures) {
        const double behind_m = glm::dot(face.plane.origin_m - aperture.centroid_m, face.normal);
        if (glm::dot(aperture.normal, face.normal) < 1.0 - 1e-6 || behind_m < -1e-6 ||
            behind_m > deepest_reveal_m)
            continue;
        for (const FacetId part : aperture.facets) {
            Ring ring;
            for (const dvec3& v : building.facets[index(part)].vertices_m)
                ring.push_back(face.plane.to_plane(v));
            if (!ClipperLib::Orientation(ring)) ClipperLib::ReversePath(ring);
            sheet.path("glass", path_of(without_slivers(subtract(intersect({ring}, whole), face.region)),
                                        face.plane, elevation.map));
        }
    }
}

/// The way a wall looks; of slopes with their tilt.
std::string looks(const DrawingContext& context, const Face& face) {
    const double north_rad = context.report.scene.north_rad;
    return "looks " + (std::abs(face.normal.z) < 1e-6 ? compass_word(face.normal, north_rad)
                                                      : orientation(face.normal, north_rad));
}

/// Rows of elevations, each with the width that its names need.
struct RowOfElevations {
    std::vector<Elevation> elevations;
    std::vector<double> left_mm;  ///< of each, from the left of the row
    double width_mm = 0.0;
    PlaneExtent heights_m;  ///< in y
};

std::vector<RowOfElevations> lay_out(const DrawingContext& context, std::vector<Elevation> elevations, double mm_per_m,
                         double row_mm) {
    std::vector<RowOfElevations> rows;
    for (Elevation& elevation : elevations) {
        const Face& face = context.report.building.faces[index(elevation.face)];
        // Walls that meet at an edge stand side by side; their names may need more room.
        const double wall_mm = elevation.extent_m.size().x * mm_per_m;
        const double words_mm = text_width_mm(face.name, name_mm),
                     looks_mm = text_width_mm(looks(context, face), name_mm);
        const double cell_mm = std::max({wall_mm, words_mm + 3.0, looks_mm + 3.0});
        if (rows.empty() || rows.back().width_mm + cell_mm > row_mm) rows.emplace_back();
        RowOfElevations& row = rows.back();
        if (!elevation.upright) {
            // Slopes are shown in their true size, from their lowest edge.
            const double low_m = elevation.extent_m.low.y;
            const double lowest_z_m =
                low_m * elevation.map.up.z + face.normal.z * glm::dot(face.plane.origin_m, face.normal);
            elevation.map.origin_m += (low_m - lowest_z_m) * elevation.map.up;
            elevation.extent_m.low.y -= low_m - lowest_z_m;
            elevation.extent_m.high.y -= low_m - lowest_z_m;
        }
        row.left_mm.push_back(row.width_mm + 0.5 * (cell_mm - wall_mm));
        row.width_mm += cell_mm;
        row.heights_m.add(elevation.extent_m.low);
        row.heights_m.add(elevation.extent_m.high);
        row.elevations.push_back(std::move(elevation));
    }
    return rows;
}

}  // namespace

std::string draw_walls(const DrawingContext& context, const DrawnFloor& floor) {
    const ZoneReport& report = context.report;
    const ZoneSizes all = zone_sizes_of(context, floor.storey.walls);
    std::vector<Elevation> elevations;
    std::vector<FaceId> shown;
    dvec2 largest_m{};
    for (const FaceId face : floor.storey.walls) {
        const ZoneSizes sizes = zone_sizes(report, face);
        if (sizes.sunspot_m2 == 0.0 && sizes.area_m2 < smallest_wall_share * all.area_m2) continue;
        elevations.push_back(elevation_of(report.building, face));
        shown.push_back(face);
        largest_m = glm::max(largest_m, elevations.back().extent_m.size());
    }
    if (elevations.empty()) return {};

    constexpr double row_mm = 250.0, row_height_mm = 90.0, names_mm = 13.0;
    const double scale = usual_scale({largest_m.x * 2.0, largest_m.y}, {row_mm, row_height_mm});
    const double mm_per_m = 1000.0 / scale;
    std::vector<RowOfElevations> rows = lay_out(context, std::move(elevations), mm_per_m, row_mm);

    SvgSheet sheet;
    draw_header(sheet, context, floor, "Walls unrolled, seen from the room, clockwise", scale);
    const double left_mm = margin_mm + label_margin_mm;
    double top_mm = margin_mm + header_mm;
    double width_mm = 0.0;
    for (const RowOfElevations& row : rows)
        width_mm = std::max(width_mm, row.width_mm);

    for (RowOfElevations& row : rows) {
        const double height_mm = mm_per_m * row.heights_m.size().y;
        const PaperBox frame{{left_mm - label_margin_mm, top_mm - 6.0},
                             {left_mm + width_mm + 2.0, top_mm + height_mm + 1.0}};
        LabelPlacer placer(frame);
        std::vector<SunLabel> labels;
        for (std::size_t k = 0; k < row.elevations.size(); ++k) {
            Elevation& elevation = row.elevations[k];
            const Face& face = report.building.faces[index(elevation.face)];
            PaperMap& map = elevation.map;
            map.mm_per_m = mm_per_m;
            map.at_mm = {left_mm + row.left_mm[k] - mm_per_m * elevation.extent_m.low.x,
                         top_mm + mm_per_m * row.heights_m.high.y};
            draw_windows(sheet, report.building, elevation);
            draw_face(sheet, context, elevation.face, map);
            const double middle_mm = left_mm + row.left_mm[k] + 0.5 * mm_per_m * elevation.extent_m.size().x;
            sheet.text("name", {middle_mm, top_mm + height_mm + 4.0}, face.name);
            sheet.text("name", {middle_mm, top_mm + height_mm + 6.8}, looks(context, face));
            for (const Sunspot& spot : report.zones.sunspots[index(elevation.face)])
                labels.push_back({lux_text(luminous_lx(context, spot)), spot.region, face.plane, map});
        }
        for (const double z_m : {floor.storey.floor_m, floor.storey.cut_m}) {
            if (z_m < row.heights_m.low.y - 1e-9 || z_m > row.heights_m.high.y + 1e-9) continue;
            const double y_mm = top_mm + mm_per_m * (row.heights_m.high.y - z_m);
            sheet.line("level", {left_mm - 2.0, y_mm}, {left_mm + row.width_mm, y_mm});
            sheet.text("small", {margin_mm, y_mm + 0.7}, metres_text(z_m));
            placer.avoid({{margin_mm, y_mm - 1.5}, {left_mm - 2.0, y_mm + 1.5}});
        }
        draw_sun_labels(sheet, labels, placer);
        top_mm += height_mm + names_mm;
    }

    SheetLegend legend(sheet, {left_mm + width_mm + 8.0, margin_mm + header_mm});
    draw_scale_bar(sheet, legend.at_mm(), mm_per_m);
    legend.skip(9.0);
    add_zone_items(sheet, context, legend);
    legend.item("window", [&](const PaperBox& box) { sheet.rectangle("glass", box); });
    add_grid_item(sheet, context, legend, mm_per_m);
    legend.skip(2.0);
    const ZoneSizes sizes = zone_sizes_of(context, shown);
    add_sizes(legend, "Surfaces shown", sizes);
    if (shown.size() < floor.storey.walls.size())
        legend.line(
            fmt::format("{} small ones without sun left out", floor.storey.walls.size() - shown.size()));

    const dvec2 size{legend.at_mm().x + legend_mm + margin_mm,
                     std::max(top_mm, legend.at_mm().y) + margin_mm};
    return finish_sheet(sheet, context, floor, size, "Unrolled walls", sizes);
}

}  // namespace naturel
