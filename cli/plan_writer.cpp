#include "cli/plan_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace naturel {
namespace {

using glm::dvec2;
using glm::dvec3;

// A sheet in landscape format A4 holds the figure, its margins and the legend.
constexpr dvec2 largest_figure_mm{200.0, 150.0};

/// The same region in another plane, by orthogonal projection.
Region region_in(const PlaneFrame& target, const Region& region, const PlaneFrame& plane) {
    Region result;
    for (const Ring& ring : region) {
        Ring& moved = result.emplace_back();
        for (const PlanePoint& point : ring)
            moved.push_back(target.to_plane(plane.to_world(point)));
    }
    return result;
}

/// Apertures: where they are cut, as a window's double line; what is higher or lower, dashed.
void draw_apertures(SvgSheet& sheet, const DrawingContext& context, const Storey& storey, const PaperMap& map,
                    LabelPlacer& placer, const PaperBox& frame) {
    const Building& building = context.report.building;
    for (const ApertureId id : storey.apertures) {
        const Aperture& aperture = building.apertures[index(id)];
        sheet.open_group("aperture", aperture.name);
        bool cut = false;
        for (const FacetId part : aperture.facets) {
            const std::vector<dvec3> ends =
                cut_at_height(building.facets[index(part)].vertices_m, storey.cut_m);
            if (ends.size() != 2) continue;
            const dvec2 a = map.to_paper(ends[0]), b = map.to_paper(ends[1]);
            sheet.line("window-gap", a, b);
            sheet.line("window", a, b);
            cut = true;
        }
        if (!cut) {
            const Face& face = building.faces[index(aperture.face)];
            sheet.path("window-above", path_of(face.region, face.plane, map));
        }
        const dvec2 middle = map.to_paper(aperture.centroid_m);
        const dvec2 outwards = dvec2{-aperture.normal.x, aperture.normal.y};
        const dvec2 half = 0.5 * dvec2{text_width_mm(aperture.name, name_mm), 2.6};
        // The name stands on the outside of a window in a wall, and in the middle of a rooflight.
        const bool upright = std::abs(aperture.normal.z) < 0.3;
        const dvec2 at = upright ? middle + outwards * (half + dvec2{1.6}) : middle;
        const dvec2 centre =
            glm::clamp(at, frame.low_mm + half, glm::max(frame.low_mm + half, frame.high_mm - half));
        sheet.label("window-name", centre + dvec2{0.0, 0.8}, aperture.name);
        placer.avoid({centre - half, centre + half});
        sheet.close_group();
    }
}

}  // namespace

std::string draw_plan(const DrawingContext& context, const DrawnFloor& floor) {
    const ZoneReport& report = context.report;
    const Storey& storey = floor.storey;
    const PlaneFrame plan = plan_frame(storey.cut_m);
    const Region indoor = indoor_air_at_height(report.scene, storey.cut_m);

    PlaneExtent extent_m;
    for (const Ring& ring : indoor)
        for (const PlanePoint& p : ring)
            extent_m.add(dvec2(plan.to_world(p)));
    const auto add_facets = [&](const auto& wanted) {
        for (const Facet& facet : report.building.facets)
            if (wanted(facet))
                for (const dvec3& v : facet.vertices_m)
                    extent_m.add(dvec2(v));
    };
    add_facets([&](const Facet& facet) {
        return std::ranges::find(storey.levels, facet.face) != storey.levels.end();
    });
    for (const ApertureId id : storey.apertures)
        add_facets(
            [&](const Facet& facet) { return facet.face == report.building.apertures[index(id)].face; });
    if (!(extent_m.size().x > 0.0 && extent_m.size().y > 0.0)) return {};
    // What is around the rooms: the thickness of the walls.
    const double around_m = 0.06 * std::max(extent_m.size().x, extent_m.size().y);
    extent_m.low -= around_m;
    extent_m.high += around_m;

    const double scale = usual_scale(extent_m.size(), largest_figure_mm);
    const double mm_per_m = 1000.0 / scale;
    const dvec2 corner_mm{margin_mm + label_margin_mm, margin_mm + header_mm};
    const dvec2 figure_mm = mm_per_m * extent_m.size();
    const PaperMap map{.origin_m = {extent_m.low.x, extent_m.high.y, storey.cut_m},
                       .at_mm = corner_mm,
                       .mm_per_m = mm_per_m};
    const PaperBox frame{corner_mm - label_margin_mm, corner_mm + figure_mm + label_margin_mm};

    SvgSheet sheet;
    draw_header(sheet, context, floor, "Plan", scale);

    Ring rectangle;
    for (const dvec2& p :
         {extent_m.low, {extent_m.high.x, extent_m.low.y}, extent_m.high, {extent_m.low.x, extent_m.high.y}})
        rectangle.push_back(plan.to_plane({p.x, p.y, storey.cut_m}));
    const Region solid = solid_at_height(report.scene, storey.cut_m, rectangle);

    // From below upwards; the section lies over what is below it and under what is above it.
    const auto height_of = [&](FaceId face) { return report.building.faces[index(face)].plane.origin_m.z; };
    const auto draw_levels = [&](bool above) {
        for (const FaceId face : storey.levels)
            if ((height_of(face) > storey.cut_m) == above) draw_face(sheet, context, face, map);
    };
    draw_levels(false);
    sheet.open_group("section", fmt::format("section at z = {}", metres_text(storey.cut_m)));
    sheet.path("cut", path_of(solid, plan, map));
    if (solid.empty()) sheet.path("room", path_of(indoor, plan, map));
    sheet.close_group();
    draw_levels(true);

    LabelPlacer placer(frame);
    draw_apertures(sheet, context, storey, map, placer, frame);

    std::size_t sensor_count = 0;
    sheet.open_group("sensors", "sensors");
    for (const Sensor& sensor : context.sensors) {
        const dvec3& position_m = sensor.point.position_m;
        const bool of_storey = position_m.z >= storey.floor_m - 1e-6 && position_m.z < storey.ceiling_m;
        const dvec2 at = map.to_paper(position_m);
        const bool on_sheet = at == glm::clamp(at, corner_mm, corner_mm + figure_mm);
        if (sensor.medium != Medium::indoor_air || !of_storey || !on_sheet) continue;
        sheet.dot("sensor", at, 0.28);
        ++sensor_count;
    }
    sheet.close_group();

    // What is seen of each sunspot from above.
    std::vector<SunLabel> labels;
    for (auto level = storey.levels.begin(); level != storey.levels.end(); ++level) {
        const Face& face = report.building.faces[index(*level)];
        for (const Sunspot& spot : report.zones.sunspots[index(*level)]) {
            Region seen = region_in(plan, spot.region, face.plane);
            if (height_of(*level) <= storey.cut_m) seen = subtract(seen, solid);
            Region covers;
            for (auto higher = level + 1; higher != storey.levels.end(); ++higher) {
                if (height_of(*higher) <= height_of(*level)) continue;
                const Face& cover = report.building.faces[index(*higher)];
                std::ranges::move(region_in(plan, cover.region, cover.plane), std::back_inserter(covers));
            }
            seen = subtract(seen, covers);
            labels.push_back({lux_text(luminous_lx(context, spot)), std::move(seen), plan, map});
        }
    }
    draw_sun_labels(sheet, labels, placer);

    SheetLegend legend(sheet, {frame.high_mm.x + 4.0, corner_mm.y});
    draw_compass(sheet, report.scene, report.sun.has_value(), legend.at_mm() + dvec2{10.0, 4.0});
    legend.skip(22.0);
    draw_scale_bar(sheet, legend.at_mm(), mm_per_m);
    legend.skip(9.0);
    add_zone_items(sheet, context, legend);
    if (!solid.empty())
        legend.item(fmt::format("solid, cut at z = {}", metres_text(storey.cut_m)),
                    [&](const PaperBox& box) { sheet.rectangle("cut", box); });
    legend.item("window, cut", [&](const PaperBox& box) {
        sheet.line("window", box.low_mm + dvec2{0.0, 2.0}, box.low_mm + dvec2{8.0, 2.0});
    });
    legend.item("window above or below the cut",
                [&](const PaperBox& box) { sheet.rectangle("window-above", box); });
    add_grid_item(sheet, context, legend, mm_per_m);
    if (sensor_count > 0)
        legend.item(fmt::format("sensors: {}", sensor_count), [&](const PaperBox& box) {
            sheet.dot("sensor", box.low_mm + dvec2{4.0, 2.0}, 0.4);
        });
    legend.skip(2.0);
    const ZoneSizes sizes = zone_sizes_of(context, storey.levels);
    add_sizes(legend, "Level surfaces", sizes);

    const dvec2 size{legend.at_mm().x + legend_mm + margin_mm,
                     std::max(frame.high_mm.y, legend.at_mm().y) + margin_mm};
    return finish_sheet(sheet, context, floor, size, "Plan", sizes);
}

}  // namespace naturel
