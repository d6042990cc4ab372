#include "cli/svg_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "core/units.h"

namespace naturel {
namespace {

using glm::dvec2;

// Colours of Okabe and Ito's set and their neighbours: orange against blue-grey is told apart with any colour
// vision, and in grey print the dots of the sun and the strokes of the umbra remain.
constexpr std::string_view style = R"css(<style>
text { font-family: Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif; font-size: 2.6px; fill: #222 }
.title { font-size: 5px; font-weight: bold }
.subtitle { font-size: 2.9px; fill: #444 }
.small { font-size: 2.1px; fill: #444 }
.name { font-size: 2.1px; fill: #444; text-anchor: middle }
.lx { font-size: 2.4px; font-weight: bold; fill: #5c2a00; text-anchor: middle }
.window-name { font-size: 2.1px; font-style: italic; fill: #0b4f86; text-anchor: middle }
.value { font-size: 2.1px; text-anchor: middle }
.value.little { font-size: 1.4px }
.value.on-dark { fill: #fff }
.value.ground { stroke-width: 0.6; stroke-linejoin: round }
.isoline { stroke: #fff; stroke-width: 0.3; fill: none; stroke-linejoin: round }
.isoline.on-bright { stroke: #222 }
.middle { text-anchor: middle }
.end { text-anchor: end }
.seam { stroke: #fff; stroke-width: 0.9; stroke-linejoin: round; fill: #fff }
.paper { fill: #fff }
.face { fill: #fbfaf7; fill-rule: evenodd }
.umbra { fill: #c5d0dd; stroke: #5f7590; stroke-width: 0.15; stroke-linejoin: round; fill-rule: evenodd }
.umbra-strokes { fill: url(#strokes); fill-rule: evenodd }
.sun { stroke: #b34700; stroke-width: 0.18; stroke-linejoin: round; fill-rule: evenodd }
.sun-dots { fill: url(#dots); fill-rule: evenodd }
.grid { fill: none; stroke: #6b6b6b; stroke-width: 0.07 }
.outline { fill: none; stroke: #222; stroke-width: 0.25; stroke-linejoin: round }
.cut { fill: #4b4f55; stroke: #111; stroke-width: 0.4; stroke-linejoin: round; fill-rule: evenodd }
.room { fill: none; stroke: #111; stroke-width: 0.4; stroke-linejoin: round }
.window-gap { stroke: #fff; stroke-width: 1.5 }
.window { stroke: #0072b2; stroke-width: 0.55; fill: none }
.window-above { stroke: #0072b2; stroke-width: 0.35; stroke-dasharray: 1.6 0.8; fill: none }
.window-above-gap { stroke: #fff; stroke-width: 0.7; fill: none }
.glass { fill: #d9ecf7; stroke: #0072b2; stroke-width: 0.3 }
.leader { stroke: #5c2a00; stroke-width: 0.15; fill: none }
.tip { fill: #5c2a00 }
.disc { fill: #e8690b; stroke: #5c2a00; stroke-width: 0.2 }
.sensor { fill: #fff; stroke: #00664d; stroke-width: 0.16 }
.rule { stroke: #222; stroke-width: 0.2; fill: none }
.level { stroke: #888; stroke-width: 0.15; stroke-dasharray: 1 1 }
.black { fill: #222 }
.white { fill: #fff; stroke: #222; stroke-width: 0.2 }
</style>
)css";

constexpr std::string_view patterns = R"xml(<defs>
<pattern id="strokes" width="1.5" height="1.5" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><path d="M0 0V1.5" stroke="#5f7590" stroke-width="0.3"/></pattern>
<pattern id="dots" width="1.4" height="1.4" patternUnits="userSpaceOnUse"><circle cx="0.7" cy="0.7" r="0.16" fill="#8a3a00"/></pattern>
<linearGradient id="lux"><stop offset="0" stop-color="#fff0c2"/><stop offset="0.5" stop-color="#fdb84d"/><stop offset="1" stop-color="#e8690b"/></linearGradient>
</defs>
)xml";

double overlap_mm2(const PaperBox& a, const PaperBox& b) {
    const dvec2 size = glm::min(a.high_mm, b.high_mm) - glm::max(a.low_mm, b.low_mm);
    return std::max(0.0, size.x) * std::max(0.0, size.y);
}

}  // namespace

std::string xml_text(std::string_view text) {
    std::string safe;
    for (std::size_t k = 0; k < text.size(); ++k) {
        const std::string_view character = text.substr(k, 3);
        if (character == "\xef\xbf\xbe" || character == "\xef\xbf\xbf") {
            safe += "\xef\xbf\xbd";  // U+FFFE and U+FFFF are no characters in XML: the replacement character
            k += 2;
            continue;
        }
        switch (text[k]) {
            case '&':
                safe += "&amp;";
                break;
            case '<':
                safe += "&lt;";
                break;
            case '>':
                safe += "&gt;";
                break;
            case '"':
                safe += "&quot;";
                break;
            default:
                safe += text[k];
        }
    }
    return safe;
}

std::string millimetres(double value_mm) {
    if (!std::isfinite(value_mm)) throw std::logic_error("a coordinate of a drawing is not a finite number");
    return fmt::format("{}", std::round(value_mm * 1000.0) / 1000.0 + 0.0);
}

double text_width_mm(std::string_view text, double size_mm) {
    // UTF-8 continuation bytes take no room. 0.56: the mean character of Helvetica in bold is less wide, that
    // of DejaVu Sans little more.
    const auto characters =
        std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xc0u) != 0x80u; });
    return 0.56 * size_mm * static_cast<double>(characters);
}

double usual_scale(const dvec2& size_m, const dvec2& sheet_mm) {
    const double needed = 1000.0 * std::max(size_m.x / sheet_mm.x, size_m.y / sheet_mm.y);
    for (double decade = 1.0; decade < 1e9; decade *= 10.0)
        for (const double step : {1.0, 2.0, 2.5, 5.0})
            if (decade * step >= needed) return decade * step;
    return needed;
}

PaperBox LabelPlacer::place_beside(const dvec2& point_mm, const dvec2& size_mm) {
    PaperBox best;
    double least_cost = std::numeric_limits<double>::infinity();
    constexpr int directions = 24;
    for (int ring = 0; ring < 14; ++ring) {
        for (int k = 0; k < directions; ++k) {
            const double angle = 2.0 * pi * k / directions;
            const double reach_mm = 2.5 + 2.5 * ring;
            const dvec2 towards{std::cos(angle), std::sin(angle)};
            const dvec2 centre = point_mm + towards * (dvec2{reach_mm} + 0.5 * size_mm);
            const PaperBox box{centre - 0.5 * size_mm, centre + 0.5 * size_mm};
            const double inside_mm2 = overlap_mm2(box, frame_), area_mm2 = size_mm.x * size_mm.y;
            // Leaving the frame is worst, covering something is bad, every millimetre away costs a little.
            double cost = reach_mm + 1e3 * (area_mm2 - inside_mm2);
            for (const Taken& taken : taken_)
                cost += 20.0 * taken.weight * overlap_mm2(box, taken.box);
            if (cost < least_cost) least_cost = cost, best = box;
        }
    }
    avoid(best);
    return best;
}

void SvgSheet::open_group(std::string_view css_class, std::string_view title) {
    body_ += fmt::format("<g class=\"{}\">", css_class);
    if (!title.empty()) body_ += "<title>" + xml_text(title) + "</title>";
    body_ += '\n';
}

void SvgSheet::path(std::string_view css_class, std::string_view data, std::string_view extra) {
    if (data.empty()) return;
    body_ +=
        fmt::format("<path class=\"{}\" d=\"{}\"{}{}/>\n", css_class, data, extra.empty() ? "" : " ", extra);
}

void SvgSheet::line(std::string_view css_class, const dvec2& a_mm, const dvec2& b_mm) {
    path(css_class, fmt::format("M{} {}L{} {}", millimetres(a_mm.x), millimetres(a_mm.y), millimetres(b_mm.x),
                                millimetres(b_mm.y)));
}

void SvgSheet::rectangle(std::string_view css_class, const PaperBox& box, std::string_view extra) {
    body_ += fmt::format("<rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"{}{}/>\n", css_class,
                         millimetres(box.low_mm.x), millimetres(box.low_mm.y), millimetres(box.width_mm()),
                         millimetres(box.height_mm()), extra.empty() ? "" : " ", extra);
}

void SvgSheet::dot(std::string_view css_class, const dvec2& centre_mm, double radius_mm) {
    body_ += fmt::format("<circle class=\"{}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>\n", css_class,
                         millimetres(centre_mm.x), millimetres(centre_mm.y), millimetres(radius_mm));
}

void SvgSheet::text(std::string_view css_class, const dvec2& at_mm, std::string_view text, std::string_view extra) {
    body_ += fmt::format("<text class=\"{}\" x=\"{}\" y=\"{}\"{}{}>{}</text>\n", css_class, millimetres(at_mm.x),
                         millimetres(at_mm.y), extra.empty() ? "" : " ", extra, xml_text(text));
}

void SvgSheet::label(std::string_view css_class, const dvec2& at_mm, std::string_view words) {
    text(fmt::format("{} seam", css_class), at_mm, words);
    text(css_class, at_mm, words);
}

std::string SvgSheet::finish(const dvec2& size_mm, std::string_view title,
                             std::string_view description) const {
    const std::string width = millimetres(size_mm.x), height = millimetres(size_mm.y);
    std::string file = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 0 {0} {1}\" "
        "role=\"img\" "
        "aria-labelledby=\"title description\">\n"
        "<title id=\"title\">{2}</title>\n<desc id=\"description\">{3}</desc>\n",
        width, height, xml_text(title), xml_text(description));
    file += style;
    file += patterns;
    file += fmt::format("<rect class=\"paper\" width=\"{}\" height=\"{}\"/>\n", width, height);
    return file + body_ + "</svg>\n";
}

}  // namespace naturel
