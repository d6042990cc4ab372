#include "cli/drawing_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

namespace naturel {
namespace {

using glm::dvec2;
using glm::dvec3;

// Smaller things are not drawn or labelled: they could not be seen.
constexpr double smallest_cell_mm = 0.4, smallest_labelled_mm2 = 2.0;

/// The colours of the gradient in svg_sheet.cpp between 0 and 1.
std::string sun_colour(double share) {
    constexpr std::array<dvec3, 3> stops{dvec3{255, 240, 194}, dvec3{253, 184, 77}, dvec3{232, 105, 11}};
    const double t = 2.0 * std::clamp(share, 0.0, 1.0);
    const std::size_t k = t < 1.0 ? 0 : 1;
    const dvec3 colour = glm::round(glm::mix(stops[k], stops[k + 1], t - static_cast<double>(k)));
    return fmt::format("fill=\"#{:02x}{:02x}{:02x}\"", static_cast<int>(colour.x), static_cast<int>(colour.y),
                       static_cast<int>(colour.z));
}

PlaneExtent paper_extent(const Ring& ring, const SunLabel& label) {
    PlaneExtent extent;
    for (const PlanePoint& p : ring)
        extent.add(label.map.to_paper(label.plane.to_world(p)));
    return extent;
}

dvec2 centroid_on_paper(const Ring& ring, const SunLabel& label) {
    double area = 0.0;
    dvec2 moment{};
    const dvec2 first = label.map.to_paper(label.plane.to_world(ring[0]));
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) {
        const dvec2 a = label.map.to_paper(label.plane.to_world(ring[k])) - first;
        const dvec2 b = label.map.to_paper(label.plane.to_world(ring[k + 1])) - first;
        const double cross = a.x * b.y - b.x * a.y;
        area += cross;
        moment += cross * (a + b) / 3.0;
    }
    return first + moment / area;
}

/// Where a box of a given size lies inside a sunspot, as near to a point as possible.
std::optional<dvec2> place_inside(const SunLabel& label, const dvec2& size_mm, const dvec2& wanted_mm) {
    PlaneExtent extent;
    for (const Ring& ring : label.region) {
        const PlaneExtent one = paper_extent(ring, label);
        extent.add(one.low);
        extent.add(one.high);
    }
    if (extent.size().x < size_mm.x || extent.size().y < size_mm.y) return {};
    constexpr int steps = 12;
    std::vector<dvec2> centres{wanted_mm};
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; j <= steps; ++j)
            centres.push_back(extent.low + 0.5 * size_mm +
                              dvec2{i, j} / static_cast<double>(steps) * (extent.size() - size_mm));
    std::ranges::stable_sort(centres, {}, [&](const dvec2& c) { return glm::distance(c, wanted_mm); });
    for (const dvec2& centre : centres) {
        Ring box;
        for (const dvec2& corner : {dvec2{-0.5, 0.5}, dvec2{0.5, 0.5}, dvec2{0.5, -0.5}, dvec2{-0.5, -0.5}})
            box.push_back(label.plane.to_plane(label.map.to_world(centre + corner * size_mm)));
        if (!ClipperLib::Orientation(box)) ClipperLib::ReversePath(box);
        if (subtract({box}, label.region).empty()) return centre;
    }
    return {};
}

}  // namespace

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

std::string lux_text(double lx) {
    if (lx < 100.0) return fmt::format("{:.3g} lx", lx);
    const double step = std::pow(10.0, std::floor(std::log10(lx)) - 2.0);
    std::string digits = fmt::format("{:.0f}", std::round(lx / step) * step);
    for (std::size_t k = digits.size(); k > 3;) {
        k -= 3;
        digits.insert(k, "\xc2\xa0");  // a space that does not break
    }
    return digits + " lx";
}

double luminous_lx(const DrawingContext& context, const Sunspot& spot) {
    return context.report.primaries.luminous(spot.illuminance_lx);
}

std::string metres_text(double m) {
    return fmt::format("{:.2f} m", std::round(m * 100.0) / 100.0 + 0.0);
}

void draw_face(SvgSheet& sheet, const DrawingContext& context, FaceId id, const PaperMap& map) {
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

void draw_sun_labels(SvgSheet& sheet, const std::vector<SunLabel>& labels, LabelPlacer& placer) {
    constexpr double size_mm = 2.4;
    // A label should not lie in a sunspot that it does not belong to; on other text it cannot be read.
    constexpr double sunspot_weight = 0.25;
    // More leaders than these would hide what they explain: the largest sunspots get them.
    constexpr std::size_t most_leaders = 12;
    struct Outside {
        const SunLabel* label;
        dvec2 tip_mm, size_mm;
        double area_mm2;
    };
    std::vector<Outside> outside;
    for (const SunLabel& label : labels) {
        const double area_mm2 = area_m2(label.region) * label.map.mm_per_m * label.map.mm_per_m;
        const std::vector<Ring> parts = convex_parts(label.region);
        if (area_mm2 < smallest_labelled_mm2 || parts.empty()) continue;
        for (const Ring& part : parts) {
            const PlaneExtent extent = paper_extent(part, label);
            placer.avoid({extent.low, extent.high}, sunspot_weight);
        }
        const dvec2 size{text_width_mm(label.text, size_mm) + 0.8, size_mm + 0.6};
        const Ring& largest =
            *std::ranges::max_element(parts, {}, [](const Ring& part) { return area_m2(part); });
        const dvec2 middle = centroid_on_paper(largest, label);
        if (const auto centre = place_inside(label, size, middle)) {
            sheet.label("lx", *centre + dvec2{0.0, 0.36 * size_mm}, label.text);
            placer.avoid({*centre - 0.5 * size, *centre + 0.5 * size});
        } else {
            outside.push_back({&label, middle, size, area_mm2});
        }
    }
    std::ranges::stable_sort(outside, std::greater<>(), &Outside::area_mm2);
    outside.resize(std::min(outside.size(), most_leaders));
    for (const Outside& spot : outside) {
        const PaperBox box = placer.place_beside(spot.tip_mm, spot.size_mm);
        sheet.line("leader", spot.tip_mm, glm::clamp(spot.tip_mm, box.low_mm, box.high_mm));
        sheet.dot("tip", spot.tip_mm, 0.35);
        sheet.label("lx", {0.5 * (box.low_mm.x + box.high_mm.x), box.high_mm.y - 0.7}, spot.label->text);
    }
}

void draw_header(SvgSheet& sheet, const DrawingContext& context, const DrawnFloor& floor,
                 const std::string& what, double scale) {
    const Scene& scene = context.report.scene;
    sheet.text("title", {margin_mm, margin_mm + 4.0}, scene.name);
    sheet.text("subtitle", {margin_mm, margin_mm + 9.2},
               fmt::format("{}, floor {} of {} at z = {}, scale 1:{:g}", what, floor.number,
                           context.floor_count, metres_text(floor.storey.floor_m), scale));
    sheet.text("subtitle", {margin_mm, margin_mm + 13.4}, sun_words(context.report));
}

void draw_compass(SvgSheet& sheet, const Scene& scene, bool with_sun, const dvec2& centre_mm) {
    constexpr double radius_mm = 7.0;
    const double north = -scene.north_rad;  // from the model's +y axis, clockwise
    const auto towards = [&](double azimuth_rad, double distance_mm) {
        return centre_mm + distance_mm * dvec2{std::sin(azimuth_rad), -std::cos(azimuth_rad)};
    };
    sheet.open_group("compass", "north and sun");
    const std::string circle = fmt::format("M{0} {1}a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0 -{3} 0Z",
                                           millimetres(centre_mm.x - radius_mm), millimetres(centre_mm.y),
                                           millimetres(radius_mm), millimetres(2.0 * radius_mm));
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
    if (with_sun) {
        const double azimuth = scene.sun->azimuth_rad;
        sheet.line("leader", towards(azimuth, radius_mm), centre_mm);
        sheet.dot("disc", towards(azimuth, radius_mm), 1.5);
    }
    sheet.close_group();
}

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

void add_zone_items(SvgSheet& sheet, const DrawingContext& context, SheetLegend& legend) {
    if (context.largest_sun_lx > 0.0) {
        const dvec2 at = legend.at_mm();
        const PaperBox bar{at, at + dvec2{42.0, 4.0}};
        sheet.rectangle("sun", bar, "fill=\"url(#lux)\"");
        sheet.rectangle("sun-dots", bar);
        sheet.text("small", {bar.low_mm.x, bar.high_mm.y + 2.8}, "0");
        sheet.text("small middle", {bar.high_mm.x, bar.high_mm.y + 2.8}, lux_text(context.largest_sun_lx));
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

void add_grid_item(SvgSheet& sheet, const DrawingContext& context, SheetLegend& legend, double mm_per_m) {
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

ZoneSizes zone_sizes_of(const DrawingContext& context, const std::vector<FaceId>& faces) {
    ZoneSizes sum;
    for (const FaceId face : faces) {
        const ZoneSizes sizes = zone_sizes(context.report, face);
        sum.area_m2 += sizes.area_m2;
        sum.sunspot_m2 += sizes.sunspot_m2;
        sum.umbra_m2 += sizes.umbra_m2;
    }
    return sum;
}

void add_sizes(SheetLegend& legend, std::string_view what, const ZoneSizes& sizes) {
    legend.line(fmt::format("{}: {:.2f} m\xc2\xb2", what, sizes.area_m2));
    legend.line(
        fmt::format("sunspots {:.2f} m\xc2\xb2, umbra {:.2f} m\xc2\xb2", sizes.sunspot_m2, sizes.umbra_m2));
}

std::string finish_sheet(const SvgSheet& sheet, const DrawingContext& context, const DrawnFloor& floor,
                         const dvec2& size_mm, const std::string& what, const ZoneSizes& sizes) {
    return sheet.finish(
        size_mm, fmt::format("{}: {}, floor {}", context.report.scene.name, what, floor.number),
        fmt::format(
            "{} of floor {} at z = {}, drawn to scale: sunspots of {:.2f} m\xc2\xb2 and umbra zones of "
            "{:.2f} m\xc2\xb2 on surfaces of {:.2f} m\xc2\xb2; {}.",
            what, floor.number, metres_text(floor.storey.floor_m), sizes.sunspot_m2, sizes.umbra_m2,
            sizes.area_m2, sun_words(context.report)));
}

}  // namespace naturel
