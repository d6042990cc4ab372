#include "cli/sensor_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cli/drawing_parts.h"
#include "cli/file_stems.h"
#include "core/false_colour.h"
#include "core/isolines.h"
#include "core/sky_models.h"
#include "core/tone_mapping.h"

namespace naturel {
namespace {

using glm::dvec2;
using glm::dvec3;

// A sheet in landscape format A4 holds the figure, its margins and the legend.
constexpr dvec2 largest_map_mm{200.0, 145.0};

// More cells than this could not be told apart on the sheet.
constexpr std::size_t most_cells = 50000;

/// What a map shows.
struct Shown {
    std::string folder, words, unit;
    std::vector<double> values;  ///< [sensors of the set]; NaN in solid
    Statistics statistics;
};

/// The sensors of a set.
struct Cells {
    const SensorSet& set;
    std::vector<const Sensor*> sensors;
    double spacing_m = 0.0;

    dvec3 corner_m(std::size_t k, double right, double up) const {
        return sensors[k]->point.position_m + 0.5 * spacing_m * dvec3{right, up, 0.0};
    }
};

std::string value_text(double value) {
    if (value >= 9.95) return fmt::format("{:.0f}", value);
    return value >= 0.995 ? fmt::format("{:.1f}", value) : fmt::format("{:.2f}", value);
}

std::string hex_colour(const Rgb8& colour) {
    return fmt::format("fill=\"#{:02x}{:02x}{:02x}\"", colour[0], colour[1], colour[2]);
}

/// Dark signs on bright colours and the other way round.
bool is_bright(const ColourScale& scale, double value) { return scale.place(value) > 0.6; }

/// The lattice of the sensors of one room: rooms have their own.
struct Lattice {
    dvec2 first_m{};
    int columns = 0, rows = 0;
    std::vector<double> field;  ///< [columns x rows], NaN where there is no sensor
};

std::vector<Lattice> lattices_of(const Cells& cells, const std::vector<double>& values, const Region& indoor, const PlaneFrame& plan) {
    std::vector<Lattice> lattices;
    for (const Region& room : rooms_of(indoor, *cells.set.grid)) {
        std::vector<std::size_t> inside;
        PlaneExtent extent_m;
        for (std::size_t k = 0; k < values.size(); ++k) {
            const dvec3& position_m = cells.sensors[k]->point.position_m;
            if (!contains(room, plan.to_plane(position_m))) continue;
            inside.push_back(k);
            extent_m.add(dvec2(position_m));
        }
        if (inside.empty()) continue;
        const auto steps = [&](double length_m) { return static_cast<int>(std::lround(length_m / cells.spacing_m)); };
        // Of points that are far apart and not in rows.
        constexpr double most_lattice_points = 4e6;
        if (extent_m.size().x * extent_m.size().y > most_lattice_points * cells.spacing_m * cells.spacing_m) continue;
        Lattice lattice{extent_m.low, steps(extent_m.size().x) + 1, steps(extent_m.size().y) + 1, {}};
        lattice.field.assign(static_cast<std::size_t>(lattice.columns) * static_cast<std::size_t>(lattice.rows),
                             std::numeric_limits<double>::quiet_NaN());
        for (const std::size_t k : inside) {
            const dvec2 from_first = dvec2(cells.sensors[k]->point.position_m) - lattice.first_m;
            lattice.field[static_cast<std::size_t>(steps(from_first.y) * lattice.columns + steps(from_first.x))] = values[k];
        }
        lattices.push_back(std::move(lattice));
    }
    return lattices;
}

void draw_isolines(SvgSheet& sheet, const std::vector<Lattice>& lattices, const ColourScale& scale, const PaperMap& map,
                   const Cells& cells, std::string_view unit) {
    constexpr int most_levels = 9;
    constexpr double shortest_labelled_mm = 12.0;
    for (const double level : scale.round_values(most_levels)) {
        if (level <= 0.0 || level >= scale.maximum() * (1.0 - 1e-9)) continue;
        const bool bright = is_bright(scale, level);
        sheet.open_group("isolines", fmt::format("{} {}", round_text(level), unit));
        std::vector<dvec2> longest;
        double longest_mm = 0.0;
        for (const Lattice& lattice : lattices) {
            for (const Isoline& line : isolines(lattice.field, lattice.columns, lattice.rows, level)) {
                std::string data;
                std::vector<dvec2> points;
                double length_mm = 0.0;
                for (const dvec2& p : line.points) {
                    const dvec2 at_m = lattice.first_m + cells.spacing_m * p;
                    points.push_back(map.to_paper({at_m.x, at_m.y, map.origin_m.z}));
                    if (points.size() > 1) length_mm += glm::distance(points.back(), points[points.size() - 2]);
                    data += fmt::format("{}{} {}", points.size() == 1 ? 'M' : 'L', millimetres(points.back().x), millimetres(points.back().y));
                }
                if (line.closed) data += 'Z';
                sheet.path(bright ? "isoline on-bright" : "isoline", data);
                if (length_mm > longest_mm) longest_mm = length_mm, longest = std::move(points);
            }
        }
        if (longest_mm >= shortest_labelled_mm) {
            const std::size_t middle = longest.size() / 2;
            sheet.label("small middle", 0.5 * (longest[middle - 1] + longest[middle]) + dvec2{0.0, 0.75}, round_text(level));
        }
        sheet.close_group();
    }
}

void draw_windows(SvgSheet& sheet, const Building& building, double z_m, const PaperMap& map, const PaperBox& frame) {
    constexpr double storey_m = 3.0;  // what is further above or below belongs to other floors
    sheet.open_group("apertures", "windows");
    for (const Aperture& aperture : building.apertures) {
        bool cut = false;
        for (const FacetId part : aperture.facets) {
            const std::vector<dvec3> ends = cut_at_height(building.facets[index(part)].vertices_m, z_m);
            if (ends.size() != 2) continue;
            sheet.line("window-gap", map.to_paper(ends[0]), map.to_paper(ends[1]));
            sheet.line("window", map.to_paper(ends[0]), map.to_paper(ends[1]));
            cut = true;
        }
        const dvec2 middle = map.to_paper(aperture.centroid_m);
        const bool near = std::abs(aperture.centroid_m.z - z_m) < storey_m && middle == glm::clamp(middle, frame.low_mm, frame.high_mm);
        const Face& face = building.faces[index(aperture.face)];
        if (!cut && near) sheet.path("window-above", path_of(face.region, face.plane, map));
    }
    sheet.close_group();
}

void draw_legend(SvgSheet& sheet, const Shown& shown, const ColourScale& scale, SheetLegend& legend) {
    constexpr double bar_mm = 60.0, bar_width_mm = 6.0;
    constexpr int steps = 60;
    legend.line(fmt::format("{}, {}", shown.words, shown.unit));
    legend.skip(1.5);
    const dvec2 top = legend.at_mm();
    for (int k = 0; k < steps; ++k) {
        const double y = top.y + bar_mm * k / steps;
        // Rows overlap a little: readers leave hairlines between neighbours.
        sheet.rectangle("bar", {{top.x, y}, {top.x + bar_width_mm, std::min(top.y + bar_mm, y + 1.2 * bar_mm / steps)}},
                        hex_colour(viridis(1.0 - (k + 0.5) / steps)));
    }
    sheet.rectangle("outline", {top, top + dvec2{bar_width_mm, bar_mm}});
    for (const double value : scale.round_values(9)) {
        const double y = top.y + bar_mm * (1.0 - scale.place(value));
        sheet.line("rule", {top.x + bar_width_mm, y}, {top.x + bar_width_mm + 1.2, y});
        sheet.text("", {top.x + bar_width_mm + 2.2, y + 0.9}, round_text(value));
    }
    legend.skip(bar_mm + 4.0);
    const Statistics& s = shown.statistics;
    legend.line(fmt::format("mean {} {}", value_text(s.mean), shown.unit));
    legend.line(fmt::format("least {}, largest {} {}", value_text(s.min), value_text(s.max), shown.unit));
    if (s.mean > 0.0) legend.line(fmt::format("uniformity {:.2f} (least over mean)", s.min / s.mean));
}

std::string draw_map(const Result& result, const Cells& cells, const Shown& shown) {
    const Scene& scene = result.scene;
    const double z_m = cells.set.grid->z_m;
    const PlaneFrame plan = plan_frame(z_m);
    const Region indoor = indoor_air_at_height(scene, z_m);

    PlaneExtent extent_m;
    for (const Ring& ring : indoor)
        for (const PlanePoint& p : ring) extent_m.add(dvec2(plan.to_world(p)));
    for (std::size_t k = 0; k < shown.values.size(); ++k) {
        extent_m.add(dvec2(cells.corner_m(k, -1, -1)));
        extent_m.add(dvec2(cells.corner_m(k, 1, 1)));
    }
    // What is around the rooms: the thickness of the walls.
    const double around_m = 0.06 * std::max(extent_m.size().x, extent_m.size().y);
    extent_m.low -= around_m;
    extent_m.high += around_m;
    const double paper_scale = usual_scale(extent_m.size(), largest_map_mm), mm_per_m = 1000.0 / paper_scale;
    const dvec2 corner_mm{margin_mm, margin_mm + header_mm}, figure_mm = mm_per_m * extent_m.size();
    const PaperBox frame{corner_mm, corner_mm + figure_mm};
    const PaperMap map{.origin_m = {extent_m.low.x, extent_m.high.y, z_m}, .at_mm = corner_mm, .mm_per_m = mm_per_m};

    std::vector<double> known;
    std::ranges::copy_if(shown.values, std::back_inserter(known), [](double value) { return std::isfinite(value); });
    // As in pictures: a spot of sun would leave one colour to the rest of the room.
    const double bright = white_luminance_cd_m2(known, {});
    const ColourScale scale(ColourScaleKind::linear, round_maximum({&bright, 1}));

    SvgSheet sheet;
    sheet.text("title", {margin_mm, margin_mm + 4.0}, scene.name);
    sheet.text("subtitle", {margin_mm, margin_mm + 9.2},
               fmt::format("{} at \"{}\", z = {}, scale 1:{:g}", shown.words, cells.set.id, metres_text(z_m), paper_scale));
    const OutdoorLight& outdoors = result.solution.outdoors;
    sheet.text("subtitle", {margin_mm, margin_mm + 13.4},
               fmt::format("sky {}, {:.0f} lx outdoors{}; backend {}", sky_model(scene.sky).name, outdoors.horizontal_illuminance().value,
                           outdoors.direct_normal_illuminance_lx > 0.0 ? fmt::format(", sun {:.0f} lx", outdoors.direct_normal_illuminance_lx)
                                                                       : std::string(),
                           result.visibility.name()));

    Ring rectangle;
    for (const dvec2& p : {extent_m.low, {extent_m.high.x, extent_m.low.y}, extent_m.high, {extent_m.low.x, extent_m.high.y}})
        rectangle.push_back(plan.to_plane({p.x, p.y, z_m}));
    const Region solid = solid_at_height(scene, z_m, rectangle);
    sheet.open_group("section", fmt::format("section at z = {}", metres_text(z_m)));
    sheet.path("cut", path_of(solid, plan, map));
    sheet.path("face", path_of(indoor, plan, map));
    sheet.close_group();

    sheet.open_group("cells", shown.words);
    for (std::size_t k = 0; k < shown.values.size(); ++k) {
        if (!std::isfinite(shown.values[k])) continue;
        Ring cell;
        for (const dvec2& c : {dvec2{-1, -1}, dvec2{1, -1}, dvec2{1, 1}, dvec2{-1, 1}}) cell.push_back(plan.to_plane(cells.corner_m(k, c.x, c.y)));
        sheet.path("cell", path_of(intersect({cell}, indoor), plan, map), hex_colour(scale.colour(shown.values[k])));
    }
    sheet.close_group();
    sheet.path("room", path_of(indoor, plan, map));
    draw_windows(sheet, result.building, z_m, map, frame);
    draw_isolines(sheet, lattices_of(cells, shown.values, indoor, plan), scale, map, cells, shown.unit);

    std::size_t longest = 0;
    for (const double value : known) longest = std::max(longest, value_text(value).size());
    const std::string widest(longest, '0');
    const double cell_mm = cells.spacing_m * mm_per_m;
    const bool fits = text_width_mm(widest, 2.1) < 0.95 * cell_mm && cell_mm > 2.5;
    if (fits || (text_width_mm(widest, 1.4) < 0.95 * cell_mm && cell_mm > 1.7)) {
        sheet.open_group("values", "values at the sensors");
        for (std::size_t k = 0; k < shown.values.size(); ++k) {
            if (!std::isfinite(shown.values[k])) continue;
            sheet.text(fmt::format("value{}{}", fits ? "" : " little", is_bright(scale, shown.values[k]) ? "" : " on-dark"),
                       map.to_paper(cells.sensors[k]->point.position_m) + dvec2{0.0, fits ? 0.75 : 0.5}, value_text(shown.values[k]));
        }
        sheet.close_group();
    }

    SheetLegend legend(sheet, {frame.high_mm.x + 8.0, corner_mm.y});
    draw_compass(sheet, scene, outdoors.direct_normal_illuminance_lx > 0.0, legend.at_mm() + dvec2{10.0, 4.0});
    legend.skip(20.0);
    draw_scale_bar(sheet, legend.at_mm(), mm_per_m);
    legend.skip(9.0);
    draw_legend(sheet, shown, scale, legend);
    legend.line(fmt::format("{} points every {}, {} in solid (blank)", shown.values.size(), metres_text(cells.spacing_m),
                            shown.values.size() - known.size()));

    const dvec2 size{legend.at_mm().x + legend_mm + margin_mm, std::max(frame.high_mm.y, legend.at_mm().y) + margin_mm};
    return sheet.finish(size, fmt::format("{}: {} at {}", scene.name, shown.words, cells.set.id),
                        fmt::format("Plan of the sensors \"{}\" at z = {} in false colour: {} from {} to {} {}, mean {} {}.", cells.set.id,
                                    metres_text(z_m), shown.words, value_text(shown.statistics.min), value_text(shown.statistics.max),
                                    shown.unit, value_text(shown.statistics.mean), shown.unit));
}

}  // namespace

std::vector<Region> rooms_of(const Region& indoor, const SensorGrid& grid) {
    return connected_parts(grid.margin_m > 0.0 ? offset(indoor, -grid.margin_m) : indoor);
}

std::vector<SensorMap> draw_sensor_maps(const Result& result, const std::vector<SensorSetStatistics>& sets) {
    std::vector<std::string> ids;
    for (const SensorSet& set : result.scene.sensors) ids.push_back(set.id);
    const std::vector<std::string> stems = file_stems(ids);
    std::vector<SensorMap> maps;
    for (std::size_t s = 0; s < sets.size(); ++s) {
        const SensorSet& set = result.scene.sensors[s];
        if (!set.grid || !sets[s].illuminance_lx || sets[s].points > most_cells) continue;
        Cells cells{.set = set, .sensors = {}, .spacing_m = set.grid->spacing_m};
        Shown illuminance{"illuminance", "illuminance", "lx", {}, *sets[s].illuminance_lx};
        Shown factor{"daylight_factor", "daylight factor", "%", {}, sets[s].daylight_factor_percent.value_or(Statistics{})};
        for (std::size_t k = 0; k < result.solution.sensors.size(); ++k) {
            const Sensor& sensor = result.solution.sensors[k];
            if (sensor.set != s) continue;
            const PointIlluminance& point = result.solution.sensor_values[k];
            constexpr double none = std::numeric_limits<double>::quiet_NaN();
            const bool solid = sensor.medium == Medium::solid;
            cells.sensors.push_back(&sensor);
            illuminance.values.push_back(solid ? none : result.primaries.luminous(point.total_lx()));
            factor.values.push_back(solid ? none : daylight_factor_percent(result, point).value_or(none));
        }
        const auto add = [&](const Shown& shown) {
            maps.push_back({fmt::format("sensors/{}/{}.svg", shown.folder, stems[s]), draw_map(result, cells, shown)});
        };
        add(illuminance);
        if (sets[s].daylight_factor_percent) add(factor);
    }
    return maps;
}

}  // namespace naturel
