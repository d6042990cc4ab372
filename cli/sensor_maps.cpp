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

// Windows farther from the rooms at the height of a map are not theirs.
constexpr double deepest_reveal_m = 1.5;

/// What is further above or below belongs to other floors.
bool is_on_storey(const Aperture& aperture, double z_m) {
    constexpr double storey_m = 3.0;
    return std::abs(aperture.centroid_m.z - z_m) < storey_m;
}

/// What a map shows.
struct Shown {
    std::string folder, words, unit;
    std::vector<double> values;  ///< [sensors of the set]; NaN in solid
    Statistics statistics;
};

/// The sensors of a set.
struct Cells {
    const SensorSet& set;
    std::size_t number = 0;  ///< of the set
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

std::string hex_colour(const Rgb8& colour) { return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]); }

std::string fill(const Rgb8& colour) { return fmt::format("fill=\"{}\"", hex_colour(colour)); }

/// Dark signs on bright colours and the other way round.
bool is_bright(const ColourScale& scale, double value) { return scale.place(value) > 0.6; }

/// Above everything else: the value of a line of equal value.
struct LevelLabel {
    dvec2 centre_mm;
    PaperBox box;
    std::string text;
};

PaperBox box_of_text(const dvec2& centre_mm, std::string_view text, double size_mm) {
    const dvec2 half{0.5 * text_width_mm(text, size_mm), 0.5 * size_mm};
    return {centre_mm - half, centre_mm + half};
}

bool overlap(const PaperBox& a, const PaperBox& b) {
    return a.low_mm.x < b.high_mm.x && b.low_mm.x < a.high_mm.x && a.low_mm.y < b.high_mm.y && b.low_mm.y < a.high_mm.y;
}

/// The lattice of the sensors of one room: rooms have their own.
struct Lattice {
    dvec2 first_m{};
    int columns = 0, rows = 0;
    std::vector<double> field{};  ///< [columns x rows], NaN where there is no sensor
    std::vector<std::size_t> sensors{};  ///< of the set
    std::vector<glm::ivec2> places{};    ///< [sensors] column and row
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
        Lattice lattice{.first_m = extent_m.low, .columns = steps(extent_m.size().x) + 1, .rows = steps(extent_m.size().y) + 1};
        lattice.field.assign(static_cast<std::size_t>(lattice.columns) * static_cast<std::size_t>(lattice.rows),
                             std::numeric_limits<double>::quiet_NaN());
        for (const std::size_t k : inside) {
            const dvec2 from_first = dvec2(cells.sensors[k]->point.position_m) - lattice.first_m;
            const glm::ivec2 place{steps(from_first.x), steps(from_first.y)};
            lattice.field[static_cast<std::size_t>(place.y * lattice.columns + place.x)] = values[k];
            lattice.places.push_back(place);
        }
        lattice.sensors = std::move(inside);
        lattices.push_back(std::move(lattice));
    }
    return lattices;
}

/// Values to be written at the sensors.
struct MapNumbers {
    struct Number {
        std::size_t sensor = 0;  ///< of the set
        dvec2 centre_mm{};
        PaperBox box{};
        std::string text{};
    };
    std::vector<Number> list{};
    double size_mm = 2.1;
    int step = 1;  ///< all of them, or every second, third ... of each row and column
};

/// As many as do not run into one another.
MapNumbers numbers_that_fit(const Shown& shown, const Cells& cells, const std::vector<Lattice>& lattices, const PaperMap& map) {
    // Side by side, numbers want a gap of about the width of a digit.
    constexpr double most_of_cell = 0.75, little_mm = 1.4, least_rows = 1.2;
    MapNumbers numbers;
    std::size_t longest = 0;
    for (const double value : shown.values)
        if (std::isfinite(value)) longest = std::max(longest, value_text(value).size());
    if (longest == 0) return numbers;
    const double cell_mm = cells.spacing_m * map.mm_per_m;
    const auto step_for = [&](double size_mm) {
        const std::string widest(longest, '0');
        const double needed_mm = std::max(text_width_mm(widest, size_mm) / most_of_cell, least_rows * size_mm);
        return std::max(1, static_cast<int>(std::ceil(needed_mm / cell_mm - 1e-9)));
    };
    if (step_for(numbers.size_mm) > 1 && step_for(little_mm) == 1) numbers.size_mm = little_mm;
    numbers.step = step_for(numbers.size_mm);
    const auto add = [&](std::size_t k) {
        if (!std::isfinite(shown.values[k])) return;
        const dvec2 centre = map.to_paper(cells.sensors[k]->point.position_m);
        std::string text = value_text(shown.values[k]);
        const PaperBox box = box_of_text(centre, text, numbers.size_mm);
        numbers.list.push_back({k, centre, box, std::move(text)});
    };
    if (numbers.step == 1) {
        for (std::size_t k = 0; k < shown.values.size(); ++k) add(k);
        return numbers;
    }
    for (const Lattice& lattice : lattices) {
        const glm::ivec2 first{std::min(numbers.step / 2, (lattice.columns - 1) / 2), std::min(numbers.step / 2, (lattice.rows - 1) / 2)};
        for (std::size_t n = 0; n < lattice.sensors.size(); ++n)
            if (lattice.places[n] % numbers.step == first) add(lattice.sensors[n]);
    }
    return numbers;
}

/// The place after a share of the length of a line.
dvec2 place_along(const std::vector<dvec2>& points_mm, double length_mm, double share) {
    double left_mm = share * length_mm;
    for (std::size_t k = 1; k < points_mm.size(); ++k) {
        const double step_mm = glm::distance(points_mm[k - 1], points_mm[k]);
        if (left_mm <= step_mm && step_mm > 0.0) return glm::mix(points_mm[k - 1], points_mm[k], left_mm / step_mm);
        left_mm -= step_mm;
    }
    return points_mm.back();
}

/// A place for the value of a line near its middle: away from other labels and, where possible, from numbers.
std::optional<LevelLabel> place_label(const std::vector<dvec2>& points_mm, double length_mm, const std::string& text,
                                      const std::vector<LevelLabel>& labels, const MapNumbers& numbers) {
    constexpr double between_labels_mm = 0.5;
    constexpr int steps = 20;
    std::optional<LevelLabel> over_number;
    for (int k = 0; k < steps - 1; ++k) {
        // 0.5, 0.45, 0.55, 0.4 ...
        const double share = 0.5 + (k % 2 == 0 ? 0.5 : -0.5) * (k + k % 2) / steps;
        const dvec2 centre = place_along(points_mm, length_mm, share);
        PaperBox box = box_of_text(centre, text, name_mm);
        box.low_mm -= between_labels_mm;
        box.high_mm += between_labels_mm;
        const auto is_in_way = [&](const auto& other) { return overlap(other.box, box); };
        if (std::ranges::any_of(labels, is_in_way)) continue;
        if (std::ranges::none_of(numbers.list, is_in_way)) return LevelLabel{centre, box, text};
        if (!over_number) over_number = LevelLabel{centre, box, text};
    }
    return over_number;
}

/// Draws the lines and finds places for their values: on every long line, where there is room.
std::vector<LevelLabel> draw_isolines(SvgSheet& sheet, const std::vector<Lattice>& lattices, const ColourScale& scale, const PaperMap& map,
                                      const Cells& cells, const MapNumbers& numbers, std::string_view unit) {
    constexpr int most_levels = 9;
    constexpr double shortest_labelled_mm = 12.0;
    std::vector<LevelLabel> labels;
    for (const double level : scale.round_values(most_levels)) {
        if (level <= 0.0 || level >= scale.maximum() * (1.0 - 1e-9)) continue;
        const bool bright = is_bright(scale, level);
        const std::string text = round_text(level);
        sheet.open_group("isolines", fmt::format("{} {}", text, unit));
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
                if (length_mm < shortest_labelled_mm) continue;
                if (auto label = place_label(points, length_mm, text, labels, numbers)) labels.push_back(std::move(*label));
            }
        }
        sheet.close_group();
    }
    return labels;
}

void draw_windows(SvgSheet& sheet, const std::vector<MapWindow>& windows, const PaperMap& map) {
    sheet.open_group("apertures", "windows");
    for (const MapWindow& window : windows) {
        for (const std::vector<dvec3>& ends : window.cuts)
            for (const char* css_class : {"window-gap", "window"}) sheet.line(css_class, map.to_paper(ends[0]), map.to_paper(ends[1]));
        for (const std::vector<dvec3>& outline : window.outlines) {
            std::string data;
            append_polygon(data, outline, map);
            for (const char* css_class : {"window-above-gap", "window-above"}) {
                if (outline.size() == 2) sheet.line(css_class, map.to_paper(outline[0]), map.to_paper(outline[1]));
                else sheet.path(css_class, data);
            }
        }
    }
    sheet.close_group();
}

/// Writes numbers where no label of a line is.
void draw_values(SvgSheet& sheet, const Shown& shown, const MapNumbers& numbers, const ColourScale& scale, const std::vector<LevelLabel>& labels) {
    sheet.open_group("values", "values at the sensors");
    for (const MapNumbers::Number& number : numbers.list) {
        if (std::ranges::any_of(labels, [&](const LevelLabel& label) { return overlap(label.box, number.box); })) continue;
        const double value = shown.values[number.sensor];
        const std::string css_class = fmt::format("value{}{}", numbers.size_mm < 2.0 ? " little" : "", is_bright(scale, value) ? "" : " on-dark");
        const dvec2 at = number.centre_mm + dvec2{0.0, 0.36 * numbers.size_mm};
        // The ground of the number, in the colour of its cell: lines of equal value do not strike it through.
        sheet.text("ground " + css_class, at, number.text, fmt::format("stroke=\"{}\"", hex_colour(scale.colour(value))));
        sheet.text(css_class, at, number.text);
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
                        fill(viridis(1.0 - (k + 0.5) / steps)));
    }
    sheet.rectangle("outline", {top, top + dvec2{bar_width_mm, bar_mm}});
    // Both ends are always told; a value just beside would run into their labels.
    constexpr double least_gap = 3.5 / bar_mm;
    const auto tick = [&](double place, std::string_view text) {
        const double y = top.y + bar_mm * (1.0 - place);
        sheet.line("rule", {top.x + bar_width_mm, y}, {top.x + bar_width_mm + 1.2, y});
        sheet.text("tick", {top.x + bar_width_mm + 2.2, y + 0.9}, text);
    };
    tick(0.0, round_text(scale.value_at(0.0)));
    for (const double value : scale.round_values(9))
        if (scale.place(value) > least_gap && scale.place(value) < 1.0 - least_gap) tick(scale.place(value), round_text(value));
    const bool clipped = shown.statistics.max > scale.maximum() * (1.0 + 1e-9);
    tick(1.0, (clipped ? "\u2265 " : "") + round_text(scale.maximum()));
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

    const PlaneExtent extent_m = map_extent(result, cells.number, indoor);
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
        sheet.path("cell", path_of(intersect({cell}, indoor), plan, map), fill(scale.colour(shown.values[k])));
    }
    sheet.close_group();
    sheet.path("room", path_of(indoor, plan, map));
    draw_windows(sheet, map_windows(result.building, z_m, extent_m), map);
    const std::vector<Lattice> lattices = lattices_of(cells, shown.values, indoor, plan);
    const MapNumbers numbers = numbers_that_fit(shown, cells, lattices, map);
    const std::vector<LevelLabel> labels = draw_isolines(sheet, lattices, scale, map, cells, numbers, shown.unit);
    draw_values(sheet, shown, numbers, scale, labels);
    sheet.open_group("levels", "values of the lines");
    for (const LevelLabel& label : labels) sheet.label("small middle", label.centre_mm + dvec2{0.0, 0.36 * name_mm}, label.text);
    sheet.close_group();

    SheetLegend legend(sheet, {frame.high_mm.x + 8.0, corner_mm.y});
    draw_compass(sheet, scene, outdoors.direct_normal_illuminance_lx > 0.0, legend.at_mm() + dvec2{10.0, 4.0});
    legend.skip(20.0);
    draw_scale_bar(sheet, legend.at_mm(), mm_per_m);
    legend.skip(9.0);
    draw_legend(sheet, shown, scale, legend);
    legend.line(fmt::format("{} points every {}, {} in solid (blank)", shown.values.size(), metres_text(cells.spacing_m),
                            shown.values.size() - known.size()));
    if (numbers.step > 1) legend.line(fmt::format("numbers at one sensor in {} x {}", numbers.step, numbers.step));

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

PlaneExtent map_extent(const Result& result, std::size_t set_number, const Region& indoor) {
    const SensorGrid& grid = *result.scene.sensors[set_number].grid;
    const PlaneFrame plan = plan_frame(grid.z_m);
    PlaneExtent rooms_m;
    for (const Ring& ring : indoor)
        for (const PlanePoint& p : ring) rooms_m.add(dvec2(plan.to_world(p)));
    for (const Sensor& sensor : result.solution.sensors) {
        if (sensor.set != set_number) continue;
        rooms_m.add(dvec2(sensor.point.position_m) - 0.5 * grid.spacing_m);
        rooms_m.add(dvec2(sensor.point.position_m) + 0.5 * grid.spacing_m);
    }
    PlaneExtent extent_m = rooms_m;
    for (const Aperture& aperture : result.building.apertures) {
        const dvec2 middle_m(aperture.centroid_m);
        if (!is_on_storey(aperture, grid.z_m) ||
            glm::distance(middle_m, glm::clamp(middle_m, rooms_m.low, rooms_m.high)) > deepest_reveal_m)
            continue;
        for (const FacetId part : aperture.facets)
            for (const dvec3& corner_m : result.building.facets[index(part)].vertices_m) extent_m.add(dvec2(corner_m));
    }
    const double margin_m = 0.06 * std::max(extent_m.size().x, extent_m.size().y);
    extent_m.low -= margin_m;
    extent_m.high += margin_m;
    return extent_m;
}

std::vector<MapWindow> map_windows(const Building& building, double z_m, const PlaneExtent& extent_m) {
    constexpr double upright_m = 1e-4;
    std::vector<MapWindow> windows;
    for (const Aperture& aperture : building.apertures) {
        MapWindow window;
        for (const FacetId part : aperture.facets) {
            std::vector<dvec3> ends = cut_at_height(building.facets[index(part)].vertices_m, z_m);
            if (ends.size() == 2) window.cuts.push_back(std::move(ends));
        }
        const dvec2 middle_m(aperture.centroid_m);
        if (window.cuts.empty() && is_on_storey(aperture, z_m) && middle_m == glm::clamp(middle_m, extent_m.low, extent_m.high)) {
            const Face& face = building.faces[index(aperture.face)];
            for (const Ring& ring : face.region) {
                std::vector<dvec3> outline;
                for (const PlanePoint& p : ring) {
                    const dvec3 corner_m = face.plane.to_world(p);
                    outline.push_back({corner_m.x, corner_m.y, z_m});
                }
                // An upright pane is a line: drawn there and back, its dashes would cover one another's gaps.
                const auto far = [&](const dvec3& from) {
                    return *std::ranges::max_element(outline, {}, [&](const dvec3& corner) { return glm::distance(corner, from); });
                };
                const dvec3 a = far(outline.front()), b = far(a);
                const auto off_m = [&](const dvec3& corner) { return glm::length(glm::cross(corner - a, b - a)) / glm::distance(a, b); };
                if (glm::distance(a, b) > 0.0 && std::ranges::all_of(outline, [&](const dvec3& corner) { return off_m(corner) < upright_m; }))
                    outline = {a, b};
                window.outlines.push_back(std::move(outline));
            }
        }
        if (!window.cuts.empty() || !window.outlines.empty()) windows.push_back(std::move(window));
    }
    return windows;
}

std::vector<SensorMap> draw_sensor_maps(const Result& result, const std::vector<SensorSetStatistics>& sets) {
    std::vector<std::string> ids;
    for (const SensorSet& set : result.scene.sensors) ids.push_back(set.id);
    const std::vector<std::string> stems = file_stems(ids);
    std::vector<SensorMap> maps;
    for (std::size_t s = 0; s < sets.size(); ++s) {
        const SensorSet& set = result.scene.sensors[s];
        if (!set.grid || !sets[s].illuminance_lx || sets[s].points > most_cells) continue;
        Cells cells{.set = set, .number = s, .sensors = {}, .spacing_m = set.grid->spacing_m};
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
