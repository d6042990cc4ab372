#include "cli/plan_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <span>

#include "cli/orientation.h"
#include "cli/storeys.h"
#include "cli/svg_sheet.h"
#include "core/sensors.h"

namespace naturel {
namespace {

using glm::dvec2;
using glm::dvec3;

// A sheet in landscape format A4 holds the figure, its margins and the legend.
constexpr dvec2 largest_figure_mm{200.0, 150.0};
constexpr double margin_mm = 10.0, header_mm = 24.0, legend_mm = 58.0;

// Around the figure, for labels that find no place inside.
constexpr double label_margin_mm = 12.0;

// Smaller things are not drawn or labelled: they could not be seen.
constexpr double smallest_cell_mm = 0.4, smallest_labelled_mm2 = 2.0;

// Walls below this share of all walls of a floor are left out unless the sun shines on them.
constexpr double smallest_wall_share = 0.02;

// Size of the names of walls and windows.
constexpr double name_mm = 2.1;

// How far behind the inner side of a wall its window may be: deeper reveals than 1.5 m are rooms.
constexpr double deepest_reveal_m = 1.5;

/// Everything that the sheets of a building share.
struct Context {
    const ZoneReport& report;
    const PatchGrid& grid;
    std::vector<std::vector<PatchId>> patches;  ///< [face]
    std::vector<Sensor> sensors;
    double largest_sun_lx = 0.0;
    std::size_t floor_count = 0;
};

/// One floor among them, numbered from 1.
struct Floor {
    const Storey& storey;
    std::size_t number;
};

/// How a plane of the world lies on the sheet.
struct PaperMap {
    dvec3 origin_m{};  ///< appears at at_mm
    dvec3 right{1, 0, 0}, up{0, 1, 0};
    dvec2 at_mm{};
    double mm_per_m = 1.0;

    dvec2 to_paper(const dvec3& point_m) const {
        const dvec3 d = point_m - origin_m;
        return at_mm + mm_per_m * dvec2{glm::dot(d, right), -glm::dot(d, up)};
    }
    dvec3 to_world(const dvec2& point_mm) const {
        const dvec2 d = (point_mm - at_mm) / mm_per_m;
        return origin_m + d.x * right - d.y * up;
    }
};

struct Extent {
    dvec2 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

    void add(const dvec2& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    dvec2 size() const { return high - low; }
};

void append_polygon(std::string& data, std::span<const dvec3> polygon, const PaperMap& map) {
    char command = 'M';
    for (const dvec3& vertex : polygon) {
        const dvec2 at = map.to_paper(vertex);
        data += fmt::format("{}{} {}", command, millimetres(at.x), millimetres(at.y));
        command = 'L';
    }
    data += 'Z';
}

std::string path_of(const Region& region, const PlaneFrame& plane, const PaperMap& map) {
    std::string data;
    std::vector<dvec3> polygon;
    for (const Ring& ring : region) {
        polygon.clear();
        for (const PlanePoint& point : ring)
            polygon.push_back(plane.to_world(point));
        append_polygon(data, polygon, map);
    }
    return data;
}

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

/// The colours of the gradient in svg_sheet.cpp between 0 and 1.
std::string sun_colour(double share) {
    constexpr std::array<dvec3, 3> stops{dvec3{255, 240, 194}, dvec3{253, 184, 77}, dvec3{232, 105, 11}};
    const double t = 2.0 * std::clamp(share, 0.0, 1.0);
    const std::size_t k = t < 1.0 ? 0 : 1;
    const dvec3 colour = glm::round(glm::mix(stops[k], stops[k + 1], t - static_cast<double>(k)));
    return fmt::format("fill=\"#{:02x}{:02x}{:02x}\"", static_cast<int>(colour.x), static_cast<int>(colour.y),
                       static_cast<int>(colour.z));
}

/// Three significant digits, thousands apart: "31 400 lx".
std::string lux_words(double lx) {
    if (lx < 100.0) return fmt::format("{:.3g} lx", lx);
    const double step = std::pow(10.0, std::floor(std::log10(lx)) - 2.0);
    std::string digits = fmt::format("{:.0f}", std::round(lx / step) * step);
    for (std::size_t k = digits.size(); k > 3;) {
        k -= 3;
        digits.insert(k, "\xc2\xa0");  // a space that does not break
    }
    return digits + " lx";
}

double luminous_lx(const Context& context, const Sunspot& spot) {
    return context.report.primaries.luminous(spot.illuminance_lx);
}

std::string metres(double m) {
    return fmt::format("{:.2f} m", std::round(m * 100.0) / 100.0 + 0.0);
}

/// A face with its zones and grid.
void draw_face(SvgSheet& sheet, const Context& context, FaceId id, const PaperMap& map) {
    const Face& face = context.report.building.faces[index(id)];
    sheet.open_group("surface", face.name);
    const std::string outline = path_of(face.region, face.plane, map);
    sheet.path("face", outline);
    const std::string umbra = path_of(context.report.zones.umbra[index(id)], face.plane, map);
    sheet.path("umbra", umbra);
    sheet.path("umbra-strokes", umbra);
    for (const Sunspot& spot : context.report.zones.sunspots[index(id)]) {
        const std::string data = path_of(spot.region, face.plane, map);
        sheet.path("sun", data, sun_colour(luminous_lx(context, spot) / context.largest_sun_lx));
        sheet.path("sun-dots", data);
    }
    if (context.report.scene.grid.spacing_m * map.mm_per_m >= smallest_cell_mm) {
        std::string cells;
        for (const PatchId patch : context.patches[index(id)])
            append_polygon(cells, context.grid.polygon_of(patch), map);
        sheet.path("grid", cells);
    }
    sheet.path("outline", outline);
    sheet.close_group();
}

dvec2 centroid(const Ring& ring) {
    double area = 0.0;
    dvec2 moment{};
    const auto vertex = [&](std::size_t k) {
        const PlanePoint& p = ring[k % ring.size()];
        // Relative to the first corner: nanometres of a whole site squared would lose digits.
        return dvec2{static_cast<double>(p.X - ring[0].X), static_cast<double>(p.Y - ring[0].Y)};
    };
    for (std::size_t k = 0; k < ring.size(); ++k) {
        const dvec2 a = vertex(k), b = vertex(k + 1);
        const double cross = a.x * b.y - b.x * a.y;
        area += cross;
        moment += cross * (a + b) / 3.0;
    }
    return dvec2{static_cast<double>(ring[0].X), static_cast<double>(ring[0].Y)} + moment / area;
}

/// A piece of text that belongs to a part of a plane.
struct SunLabel {
    std::string text;
    Region region;  ///< what is seen of the sunspot
    PlaneFrame plane;
    PaperMap map;
};

/// Writes illuminances into their sunspots where they fit, else beside them with a leader.
void draw_sun_labels(SvgSheet& sheet, const std::vector<SunLabel>& labels, LabelPlacer& placer) {
    constexpr double size_mm = 2.4;
    // A label should not lie in a sunspot that it does not belong to; on other text it cannot be read.
    constexpr double sunspot_weight = 0.25;
    struct Outside {
        const SunLabel* label;
        dvec2 tip_mm;
    };
    std::vector<Outside> outside;
    for (const SunLabel& label : labels) {
        if (area_m2(label.region) * label.map.mm_per_m * label.map.mm_per_m < smallest_labelled_mm2) continue;
        std::vector<Ring> parts = convex_parts(label.region);
        if (parts.empty()) continue;
        for (const Ring& part : parts) {
            Extent extent;
            for (const PlanePoint& p : part)
                extent.add(label.map.to_paper(label.plane.to_world(p)));
            placer.avoid({extent.low, extent.high}, sunspot_weight);
        }
        std::ranges::stable_sort(parts, [](const Ring& a, const Ring& b) { return area_m2(a) > area_m2(b); });
        const dvec2 half = 0.5 * dvec2{text_width_mm(label.text, size_mm) + 0.8, size_mm + 0.6};
        const auto middle_of = [&](const Ring& part) {
            const dvec2 c = centroid(part);
            return label.map.to_paper(label.plane.to_world({std::llround(c.x), std::llround(c.y)}));
        };
        bool written = false;
        for (const Ring& part : parts) {
            const dvec2 middle = middle_of(part);
            Ring box;
            for (const dvec2& corner : {dvec2{-1, 1}, dvec2{1, 1}, dvec2{1, -1}, dvec2{-1, -1}})
                box.push_back(label.plane.to_plane(label.map.to_world(middle + half * corner)));
            if (!ClipperLib::Orientation(box)) ClipperLib::ReversePath(box);
            if (!subtract({box}, label.region).empty()) continue;
            sheet.label("lx", middle + dvec2{0.0, 0.36 * size_mm}, label.text);
            placer.avoid({middle - half, middle + half});
            written = true;
            break;
        }
        if (written) continue;
        outside.push_back({&label, middle_of(parts.front())});
    }
    for (const auto& [label, tip] : outside) {
        const dvec2 size{text_width_mm(label->text, size_mm) + 0.8, size_mm + 0.6};
        const PaperBox box = placer.place_beside(tip, size);
        const dvec2 end = glm::clamp(tip, box.low_mm, box.high_mm);
        sheet.line("leader", tip, end);
        sheet.dot("tip", tip, 0.35);
        sheet.label("lx", {0.5 * (box.low_mm.x + box.high_mm.x), box.high_mm.y - 0.7}, label->text);
    }
}

void draw_header(SvgSheet& sheet, const Context& context, const Floor& floor, const std::string& what, double scale) {
    const Scene& scene = context.report.scene;
    sheet.text("title", {margin_mm, margin_mm + 4.0}, scene.name);
    sheet.text("subtitle", {margin_mm, margin_mm + 9.2},
               fmt::format("{}, floor {} of {} at z = {}, scale 1:{:g}", what, floor.number, context.floor_count,
                           metres(floor.storey.floor_m), scale));
    sheet.text("subtitle", {margin_mm, margin_mm + 13.4}, sun_words(context.report));
}

/// Bars of a round length, black and white in turn.
void draw_scale_bar(SvgSheet& sheet, const dvec2& at_mm, double mm_per_m) {
    double length_m = 1e-6;
    for (double decade = 1e-6; decade < 1e9; decade *= 10.0)
        for (const double step : {1.0, 2.0, 4.0})
            if (decade * step * mm_per_m <= 42.0) length_m = decade * step;
    for (int k = 0; k < 4; ++k) {
        const double low = 0.25 * k * length_m * mm_per_m, high = 0.25 * (k + 1) * length_m * mm_per_m;
        sheet.rectangle(k % 2 == 0 ? "black" : "white", {at_mm + dvec2{low, 0.0}, at_mm + dvec2{high, 1.2}});
    }
    for (const double share : {0.0, 0.5, 1.0})
        sheet.text("small middle", at_mm + dvec2{share * length_m * mm_per_m, 4.0},
                   fmt::format("{:g}{}", share * length_m, share == 1.0 ? " m" : ""));
}

/// A compass: the arrow points north, the disc stands where the sun does.
void draw_compass(SvgSheet& sheet, const Context& context, const dvec2& centre_mm) {
    constexpr double radius_mm = 7.0;
    const double north = -context.report.scene.north_rad;  // from the model's +y axis, clockwise
    const auto towards = [&](double azimuth_rad, double distance_mm) {
        return centre_mm + distance_mm * dvec2{std::sin(azimuth_rad), -std::cos(azimuth_rad)};
    };
    sheet.open_group("compass", "north and sun");
    std::string circle = fmt::format("M{0} {1}a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0 -{3} 0Z", millimetres(centre_mm.x - radius_mm),
                                     millimetres(centre_mm.y), millimetres(radius_mm), millimetres(2.0 * radius_mm));
    sheet.path("rule", circle);
    const dvec2 tip = towards(north, radius_mm), left = towards(north + 2.6, 0.55 * radius_mm),
                right = towards(north - 2.6, 0.55 * radius_mm);
    const auto triangle = [&](const dvec2& a, const dvec2& b) {
        return fmt::format("M{} {}L{} {}L{} {}Z", millimetres(tip.x), millimetres(tip.y), millimetres(a.x),
                           millimetres(a.y), millimetres(b.x), millimetres(b.y));
    };
    sheet.path("black", triangle(left, centre_mm));
    sheet.path("white", triangle(right, centre_mm));
    sheet.text("middle", towards(north, radius_mm + 2.2) + dvec2{0.0, 0.9}, "N");
    if (context.report.sun) {
        const double azimuth = context.report.scene.sun->azimuth_rad;
        sheet.line("leader", towards(azimuth, radius_mm), centre_mm);
        sheet.dot("disc", towards(azimuth, radius_mm), 1.5);
    }
    sheet.close_group();
}

/// What the signs mean, from a point downwards.
class Legend {
public:
    Legend(SvgSheet& sheet, const dvec2& at_mm) : sheet_(sheet), at_mm_(at_mm) {}

    template <class Draw>
    void item(std::string_view words, const Draw& draw) {
        draw(PaperBox{at_mm_, at_mm_ + dvec2{8.0, 4.0}});
        sheet_.text("", at_mm_ + dvec2{10.5, 2.9}, words);
        at_mm_.y += 6.0;
    }
    void line(std::string_view words) {
        sheet_.text("", at_mm_ + dvec2{0.0, 2.9}, words);
        at_mm_.y += 4.2;
    }
    void skip(double mm) { at_mm_.y += mm; }
    const dvec2& at_mm() const { return at_mm_; }

private:
    SvgSheet& sheet_;
    dvec2 at_mm_;
};

void add_zone_items(SvgSheet& sheet, const Context& context, Legend& legend) {
    if (context.largest_sun_lx > 0.0) {
        const dvec2 at = legend.at_mm();
        const PaperBox bar{at, at + dvec2{42.0, 4.0}};
        sheet.rectangle("sun", bar, "fill=\"url(#lux)\"");
        sheet.rectangle("sun-dots", bar);
        sheet.text("small", {bar.low_mm.x, bar.high_mm.y + 2.8}, "0");
        sheet.text("small middle", {bar.high_mm.x, bar.high_mm.y + 2.8}, lux_words(context.largest_sun_lx));
        legend.skip(8.0);
        legend.line("sunspot: sun straight through a window");
        legend.skip(2.0);
    }
    legend.item("umbra zone: no window is seen", [&](const PaperBox& box) {
        sheet.rectangle("umbra", box);
        sheet.rectangle("umbra-strokes", box);
        sheet.rectangle("outline", box);
    });
    legend.item("sees a window, not the sun", [&](const PaperBox& box) {
        sheet.rectangle("face", box);
        sheet.rectangle("outline", box);
    });
}

void add_grid_item(SvgSheet& sheet, const Context& context, Legend& legend, double mm_per_m) {
    const double spacing_m = context.report.scene.grid.spacing_m;
    if (spacing_m * mm_per_m < smallest_cell_mm) {
        legend.line(fmt::format("grid of {:g} m: too fine to be drawn", spacing_m));
        return;
    }
    legend.item(fmt::format("calculation grid, cells up to {:g} m", spacing_m), [&](const PaperBox& box) {
        sheet.rectangle("face", box);
        for (const double x : {2.0, 4.0, 6.0})
            sheet.line("grid", box.low_mm + dvec2{x, 0.0}, box.low_mm + dvec2{x, 4.0});
        sheet.line("grid", box.low_mm + dvec2{0.0, 2.0}, box.low_mm + dvec2{8.0, 2.0});
    });
}

ZoneSizes sizes_of(const Context& context, const std::vector<FaceId>& faces) {
    ZoneSizes sum;
    for (const FaceId face : faces) {
        const ZoneSizes sizes = zone_sizes(context.report, face);
        sum.area_m2 += sizes.area_m2;
        sum.sunspot_m2 += sizes.sunspot_m2;
        sum.umbra_m2 += sizes.umbra_m2;
    }
    return sum;
}

void add_sizes(Legend& legend, std::string_view what, const ZoneSizes& sizes) {
    legend.line(fmt::format("{}: {:.2f} m\xc2\xb2", what, sizes.area_m2));
    legend.line(fmt::format("sunspots {:.2f} m\xc2\xb2, umbra {:.2f} m\xc2\xb2", sizes.sunspot_m2, sizes.umbra_m2));
}

std::string finish(const SvgSheet& sheet, const Context& context, const Floor& floor, const dvec2& size_mm,
                   const std::string& what, const ZoneSizes& sizes) {
    return sheet.finish(size_mm, fmt::format("{}: {}, floor {}", context.report.scene.name, what, floor.number),
                        fmt::format("{} of floor {} at z = {}, drawn to scale: sunspots of {:.2f} m\xc2\xb2 and umbra zones of "
                                    "{:.2f} m\xc2\xb2 on surfaces of {:.2f} m\xc2\xb2; {}.",
                                    what, floor.number, metres(floor.storey.floor_m), sizes.sunspot_m2, sizes.umbra_m2,
                                    sizes.area_m2, sun_words(context.report)));
}

/// Apertures: where they are cut, as a window's double line; what is higher or lower, dashed.
void draw_apertures(SvgSheet& sheet, const Context& context, const Storey& storey, const PaperMap& map,
                    LabelPlacer& placer, const PaperBox& frame) {
    const Building& building = context.report.building;
    for (const ApertureId id : storey.apertures) {
        const Aperture& aperture = building.apertures[index(id)];
        sheet.open_group("aperture", aperture.name);
        for (const FacetId part : aperture.facets) {
            const std::vector<dvec3>& polygon = building.facets[index(part)].vertices_m;
            const std::vector<dvec3> ends = cut_at_height(polygon, storey.cut_m);
            if (ends.size() != 2) {
                std::string data;
                append_polygon(data, polygon, map);
                sheet.path("window-above", data);
                continue;
            }
            const dvec2 a = map.to_paper(ends[0]), b = map.to_paper(ends[1]);
            sheet.line("window-gap", a, b);
            sheet.line("window", a, b);
        }
        const dvec2 middle = map.to_paper(aperture.centroid_m);
        const dvec2 outwards = dvec2{-aperture.normal.x, aperture.normal.y};
        const dvec2 half = 0.5 * dvec2{text_width_mm(aperture.name, name_mm), 2.6};
        // The name stands on the outside of a window in a wall, and in the middle of a rooflight.
        const bool upright = std::abs(aperture.normal.z) < 0.3;
        const dvec2 at = upright ? middle + outwards * (half + dvec2{1.6}) : middle;
        const dvec2 centre = glm::clamp(at, frame.low_mm + half, glm::max(frame.low_mm + half, frame.high_mm - half));
        sheet.label("window-name", centre + dvec2{0.0, 0.8}, aperture.name);
        placer.avoid({centre - half, centre + half});
        sheet.close_group();
    }
}

std::string draw_plan(const Context& context, const Floor& floor) {
    const auto& [report, grid, patches, sensors, largest_sun_lx, floor_count] = context;
    const Storey& storey = floor.storey;
    const PlaneFrame plan = plan_frame(storey.cut_m);
    const Region indoor = indoor_air_at_height(report.scene, storey.cut_m);

    Extent extent_m;
    for (const Ring& ring : indoor)
        for (const PlanePoint& p : ring)
            extent_m.add(dvec2(plan.to_world(p)));
    const auto add_facets = [&](const auto& wanted) {
        for (const Facet& facet : report.building.facets)
            if (wanted(facet))
                for (const dvec3& v : facet.vertices_m)
                    extent_m.add(dvec2(v));
    };
    add_facets([&](const Facet& facet) { return std::ranges::find(storey.levels, facet.face) != storey.levels.end(); });
    for (const ApertureId id : storey.apertures)
        add_facets([&](const Facet& facet) { return facet.face == report.building.apertures[index(id)].face; });
    if (!(extent_m.size().x > 0.0 && extent_m.size().y > 0.0)) return {};
    // What is around the rooms: the thickness of the walls.
    const double around_m = 0.06 * std::max(extent_m.size().x, extent_m.size().y);
    extent_m.low -= around_m;
    extent_m.high += around_m;

    const double scale = usual_scale(extent_m.size(), largest_figure_mm);
    const double mm_per_m = 1000.0 / scale;
    const dvec2 corner_mm{margin_mm + label_margin_mm, margin_mm + header_mm};
    const dvec2 figure_mm = mm_per_m * extent_m.size();
    const PaperMap map{.origin_m = {extent_m.low.x, extent_m.high.y, storey.cut_m}, .at_mm = corner_mm, .mm_per_m = mm_per_m};
    const PaperBox frame{corner_mm - label_margin_mm, corner_mm + figure_mm + label_margin_mm};

    SvgSheet sheet;
    draw_header(sheet, context, floor, "Plan", scale);

    Ring rectangle;
    for (const dvec2& p : {extent_m.low, {extent_m.high.x, extent_m.low.y}, extent_m.high, {extent_m.low.x, extent_m.high.y}})
        rectangle.push_back(plan.to_plane({p.x, p.y, storey.cut_m}));
    const Region solid = solid_at_height(report.scene, storey.cut_m, rectangle);

    // From below upwards; the section lies over what is below it and under what is above it.
    const auto height_of = [&](FaceId face) { return report.building.faces[index(face)].plane.origin_m.z; };
    const auto draw_levels = [&](bool above) {
        for (const FaceId face : storey.levels)
            if ((height_of(face) > storey.cut_m) == above) draw_face(sheet, context, face, map);
    };
    draw_levels(false);
    sheet.open_group("section", fmt::format("section at z = {}", metres(storey.cut_m)));
    sheet.path("cut", path_of(solid, plan, map));
    if (solid.empty()) sheet.path("room", path_of(indoor, plan, map));
    sheet.close_group();
    draw_levels(true);

    LabelPlacer placer(frame);
    draw_apertures(sheet, context, storey, map, placer, frame);

    std::size_t sensor_count = 0;
    sheet.open_group("sensors", "sensors");
    for (const Sensor& sensor : sensors) {
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
            labels.push_back({lux_words(luminous_lx(context, spot)), std::move(seen), plan, map});
        }
    }
    draw_sun_labels(sheet, labels, placer);

    Legend legend(sheet, {frame.high_mm.x + 4.0, corner_mm.y});
    draw_compass(sheet, context, legend.at_mm() + dvec2{10.0, 4.0});
    legend.skip(22.0);
    draw_scale_bar(sheet, legend.at_mm(), mm_per_m);
    legend.skip(9.0);
    add_zone_items(sheet, context, legend);
    legend.item(fmt::format("solid, cut at z = {}", metres(storey.cut_m)),
                [&](const PaperBox& box) { sheet.rectangle("cut", box); });
    legend.item("window, cut", [&](const PaperBox& box) {
        sheet.line("window", box.low_mm + dvec2{0.0, 2.0}, box.low_mm + dvec2{8.0, 2.0});
    });
    legend.item("window above or below the cut", [&](const PaperBox& box) { sheet.rectangle("window-above", box); });
    add_grid_item(sheet, context, legend, mm_per_m);
    if (sensor_count > 0)
        legend.item(fmt::format("sensors: {}", sensor_count),
                    [&](const PaperBox& box) { sheet.dot("sensor", box.low_mm + dvec2{4.0, 2.0}, 0.4); });
    legend.skip(2.0);
    const ZoneSizes sizes = sizes_of(context, storey.levels);
    add_sizes(legend, "Level surfaces", sizes);

    const dvec2 size{legend.at_mm().x + legend_mm + margin_mm,
                     std::max(frame.high_mm.y, legend.at_mm().y) + margin_mm};
    return finish(sheet, context, floor, size, "Plan", sizes);
}

/// A wall as it is seen from the room.
struct Elevation {
    FaceId face{};
    PaperMap map;        ///< scale and place come later
    Extent extent_m;     ///< along map.right and map.up from map.origin_m; upright walls: map.up is z
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
        if (glm::dot(aperture.normal, face.normal) < 1.0 - 1e-6 || behind_m < -1e-6 || behind_m > deepest_reveal_m) continue;
        for (const FacetId part : aperture.facets) {
            Ring ring;
            for (const dvec3& v : building.facets[index(part)].vertices_m)
                ring.push_back(face.plane.to_plane(v));
            if (!ClipperLib::Orientation(ring)) ClipperLib::ReversePath(ring);
            sheet.path("glass", path_of(without_slivers(subtract(intersect({ring}, whole), face.region)), face.plane,
                                        elevation.map));
        }
    }
}

/// The way a wall looks; of slopes with their tilt.
std::string looks(const Context& context, const Face& face) {
    const double north_rad = context.report.scene.north_rad;
    return "looks " + (std::abs(face.normal.z) < 1e-6 ? compass_word(face.normal, north_rad)
                                                      : orientation(face.normal, north_rad));
}

/// Rows of elevations, each with the width that its names need.
struct Row {
    std::vector<Elevation> elevations;
    std::vector<double> left_mm;  ///< of each, from the left of the row
    double width_mm = 0.0;
    Extent heights_m;  ///< in y
};

std::vector<Row> lay_out(const Context& context, std::vector<Elevation> elevations, double mm_per_m, double row_mm) {
    std::vector<Row> rows;
    for (Elevation& elevation : elevations) {
        const Face& face = context.report.building.faces[index(elevation.face)];
        // Walls that meet at an edge stand side by side; their names may need more room.
        const double wall_mm = elevation.extent_m.size().x * mm_per_m;
        const double words_mm = text_width_mm(face.name, name_mm),
                     looks_mm = text_width_mm(looks(context, face), name_mm);
        const double cell_mm = std::max({wall_mm, words_mm + 3.0, looks_mm + 3.0});
        if (rows.empty() || rows.back().width_mm + cell_mm > row_mm) rows.emplace_back();
        Row& row = rows.back();
        if (!elevation.upright) {
            // Slopes are shown in their true size, from their lowest edge.
            const double low_m = elevation.extent_m.low.y;
            const double lowest_z_m = low_m * elevation.map.up.z + face.normal.z * glm::dot(face.plane.origin_m, face.normal);
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

std::string draw_walls(const Context& context, const Floor& floor) {
    const ZoneReport& report = context.report;
    const ZoneSizes all = sizes_of(context, floor.storey.walls);
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
    std::vector<Row> rows = lay_out(context, std::move(elevations), mm_per_m, row_mm);

    SvgSheet sheet;
    draw_header(sheet, context, floor, "Walls unrolled, seen from the room, clockwise", scale);
    const double left_mm = margin_mm + label_margin_mm;
    double top_mm = margin_mm + header_mm;
    double width_mm = 0.0;
    for (const Row& row : rows)
        width_mm = std::max(width_mm, row.width_mm);

    for (Row& row : rows) {
        const double height_mm = mm_per_m * row.heights_m.size().y;
        const PaperBox frame{{left_mm - label_margin_mm, top_mm - 6.0}, {left_mm + width_mm + 2.0, top_mm + height_mm + 1.0}};
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
            sheet.text("name", {middle_mm, top_mm + height_mm + 6.8},
                       looks(context, face));
            for (const Sunspot& spot : report.zones.sunspots[index(elevation.face)])
                labels.push_back({lux_words(luminous_lx(context, spot)), spot.region, face.plane, map});
        }
        for (const double z_m : {floor.storey.floor_m, floor.storey.cut_m}) {
            if (z_m < row.heights_m.low.y - 1e-9 || z_m > row.heights_m.high.y + 1e-9) continue;
            const double y_mm = top_mm + mm_per_m * (row.heights_m.high.y - z_m);
            sheet.line("level", {left_mm - 2.0, y_mm}, {left_mm + row.width_mm, y_mm});
            sheet.text("small", {margin_mm, y_mm + 0.7}, metres(z_m));
        }
        draw_sun_labels(sheet, labels, placer);
        top_mm += height_mm + names_mm;
    }

    Legend legend(sheet, {left_mm + width_mm + 8.0, margin_mm + header_mm});
    draw_scale_bar(sheet, legend.at_mm(), mm_per_m);
    legend.skip(9.0);
    add_zone_items(sheet, context, legend);
    legend.item("window", [&](const PaperBox& box) { sheet.rectangle("glass", box); });
    add_grid_item(sheet, context, legend, mm_per_m);
    legend.skip(2.0);
    const ZoneSizes sizes = sizes_of(context, shown);
    add_sizes(legend, "Surfaces shown", sizes);
    if (shown.size() < floor.storey.walls.size())
        legend.line(fmt::format("{} small ones without sun left out", floor.storey.walls.size() - shown.size()));

    const dvec2 size{legend.at_mm().x + legend_mm + margin_mm, std::max(top_mm, legend.at_mm().y) + margin_mm};
    return finish(sheet, context, floor, size, "Unrolled walls", sizes);
}

}  // namespace

std::vector<Drawing> draw_zones(const ZoneReport& report, const PatchGrid& grid) {
    const std::vector<Storey> storeys = find_storeys(report.scene, report.building);
    Context context{.report = report,
                    .grid = grid,
                    .patches = std::vector<std::vector<PatchId>>(report.building.faces.size()),
                    .sensors = place_sensors(report.scene, report.building),
                    .floor_count = storeys.size()};
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p)
        context.patches[index(grid.patches[p].face)].push_back(make_id<PatchId>(p));
    for (const std::vector<Sunspot>& spots : report.zones.sunspots)
        for (const Sunspot& spot : spots)
            context.largest_sun_lx = std::max(context.largest_sun_lx, luminous_lx(context, spot));

    std::vector<Drawing> drawings;
    for (std::size_t k = 0; k < storeys.size(); ++k) {
        const Floor floor{storeys[k], k + 1};
        const auto add = [&](const char* what, std::string svg) {
            if (!svg.empty()) drawings.push_back({fmt::format("floor_{}_{}.svg", k + 1, what), std::move(svg)});
        };
        add("plan", draw_plan(context, floor));
        add("walls", draw_walls(context, floor));
    }
    return drawings;
}

}  // namespace naturel
