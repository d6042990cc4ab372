#pragma once
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "cli/storeys.h"
#include "cli/svg_sheet.h"
#include "cli/zone_writer.h"
#include "core/patch_grid.h"
#include "core/sensors.h"

namespace naturel {

// What the drawings of a floor share: its plan (cli/plan_writer.h) and its walls (cli/walls_writer.h).

inline constexpr double margin_mm = 10.0, header_mm = 24.0, legend_mm = 58.0;

/// Around a figure, for labels that find no place inside.
inline constexpr double label_margin_mm = 12.0;

/// Size of the names of walls and windows.
inline constexpr double name_mm = 2.1;

/// Everything that the sheets of a building share.
struct DrawingContext {
    const ZoneReport& report;
    const PatchGrid& grid;
    std::vector<std::vector<PatchId>> patches;  ///< [face]
    std::vector<Sensor> sensors;
    double largest_sun_lx = 0.0;
    std::size_t floor_count = 0;
};

/// One floor among them, numbered from 1.
struct DrawnFloor {
    const Storey& storey;
    std::size_t number;
};

/// How a plane of the world lies on the sheet.
struct PaperMap {
    glm::dvec3 origin_m{};  ///< appears at at_mm
    glm::dvec3 right{1, 0, 0}, up{0, 1, 0};
    glm::dvec2 at_mm{};
    double mm_per_m = 1.0;

    glm::dvec2 to_paper(const glm::dvec3& point_m) const {
        const glm::dvec3 d = point_m - origin_m;
        return at_mm + mm_per_m * glm::dvec2{glm::dot(d, right), -glm::dot(d, up)};
    }
    glm::dvec3 to_world(const glm::dvec2& point_mm) const {
        const glm::dvec2 d = (point_mm - at_mm) / mm_per_m;
        return origin_m + d.x * right - d.y * up;
    }
};

/// The smallest upright rectangle around points of a plane.
struct PlaneExtent {
    glm::dvec2 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

    void add(const glm::dvec2& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    glm::dvec2 size() const { return high - low; }
};

/// Data of an SVG path.
void append_polygon(std::string& data, std::span<const glm::dvec3> polygon, const PaperMap& map);
std::string path_of(const Region& region, const PlaneFrame& plane, const PaperMap& map);

/// Three significant digits, thousands apart: "31 400 lx".
std::string lux_text(double lx);
std::string metres_text(double m);
double luminous_lx(const DrawingContext& context, const Sunspot& spot);

/// A face with its zones and grid.
void draw_face(SvgSheet& sheet, const DrawingContext& context, FaceId id, const PaperMap& map);

/// A piece of text that belongs to a part of a plane.
struct SunLabel {
    std::string text;
    Region region;  ///< what is seen of the sunspot
    PlaneFrame plane;
    PaperMap map;
};

/// Writes illuminances into their sunspots where they fit, else beside them with a leader.
void draw_sun_labels(SvgSheet& sheet, const std::vector<SunLabel>& labels, LabelPlacer& placer);

void draw_header(SvgSheet& sheet, const DrawingContext& context, const DrawnFloor& floor,
                 const std::string& what, double scale);

/// A compass: the arrow points north, the disc stands where the sun does.
void draw_compass(SvgSheet& sheet, const Scene& scene, bool with_sun, const glm::dvec2& centre_mm);

/// Bars of a round length, black and white in turn.
void draw_scale_bar(SvgSheet& sheet, const glm::dvec2& at_mm, double mm_per_m);

/// What the signs mean, from a point downwards.
class SheetLegend {
public:
    SheetLegend(SvgSheet& sheet, const glm::dvec2& at_mm) : sheet_(sheet), at_mm_(at_mm) {}

    template <class Draw>
    void item(std::string_view words, const Draw& draw) {
        draw(PaperBox{at_mm_, at_mm_ + glm::dvec2{8.0, 4.0}});
        sheet_.text("", at_mm_ + glm::dvec2{10.5, 2.9}, words);
        at_mm_.y += 6.0;
    }
    void line(std::string_view words) {
        sheet_.text("", at_mm_ + glm::dvec2{0.0, 2.9}, words);
        at_mm_.y += 4.2;
    }
    void skip(double mm) { at_mm_.y += mm; }
    const glm::dvec2& at_mm() const { return at_mm_; }

private:
    SvgSheet& sheet_;
    glm::dvec2 at_mm_;
};

void add_zone_items(SvgSheet& sheet, const DrawingContext& context, SheetLegend& legend);
void add_grid_item(SvgSheet& sheet, const DrawingContext& context, SheetLegend& legend, double mm_per_m);
void add_sizes(SheetLegend& legend, std::string_view what, const ZoneSizes& sizes);

/// Of several faces together.
ZoneSizes zone_sizes_of(const DrawingContext& context, const std::vector<FaceId>& faces);

/// The whole file.
std::string finish_sheet(const SvgSheet& sheet, const DrawingContext& context, const DrawnFloor& floor,
                         const glm::dvec2& size_mm, const std::string& what, const ZoneSizes& sizes);

}  // namespace naturel
