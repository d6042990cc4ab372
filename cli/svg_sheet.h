#pragma once
#include <glm/vec2.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/planar_region.h"

namespace naturel {

/// Text as it may stand between tags and in attributes.
/// text: UTF-8 without control characters, as the reader lets names pass.
std::string xml_text(std::string_view text);

/// A length or coordinate, mm, to the micrometre.
std::string millimetres(double value_mm);

/// An upright rectangle on paper; y goes down.
struct PaperBox {
    glm::dvec2 low_mm{}, high_mm{};

    double width_mm() const { return high_mm.x - low_mm.x; }
    double height_mm() const { return high_mm.y - low_mm.y; }
};

/// Width of a line of text, estimated: fonts differ from reader to reader.
double text_width_mm(std::string_view text, double size_mm);

/// The largest usual scale (20 for 1:20) at which a width and height, m, fit on a sheet.
double usual_scale(const glm::dvec2& size_m, const glm::dvec2& sheet_mm);

/// Writes labels where they cover nothing that matters.
class LabelPlacer {
public:
    explicit LabelPlacer(const PaperBox& frame) : frame_(frame) {}

    /// Keeps labels away from a box as far as possible; boxes of less weight are covered first.
    void avoid(const PaperBox& box, double weight = 1.0) { taken_.push_back({box, weight}); }

    /// The place of a label of a given size beside a point: the box with least overlap, near rather than far.
    PaperBox place_beside(const glm::dvec2& point_mm, const glm::dvec2& size_mm);

private:
    struct Taken {
        PaperBox box;
        double weight;
    };

    PaperBox frame_;
    std::vector<Taken> taken_;
};

/// An SVG drawing that grows element by element. Lengths are mm on paper.
class SvgSheet {
public:
    /// Groups carry a class and, for tooltips and screen readers, a title.
    void open_group(std::string_view css_class, std::string_view title = {});
    void close_group() { body_ += "</g>\n"; }

    /// Elements with a class; `extra` are further attributes, written as they are.
    void path(std::string_view css_class, std::string_view data, std::string_view extra = {});
    void line(std::string_view css_class, const glm::dvec2& a_mm, const glm::dvec2& b_mm);
    void rectangle(std::string_view css_class, const PaperBox& box, std::string_view extra = {});
    void dot(std::string_view css_class, const glm::dvec2& centre_mm, double radius_mm);
    /// On a baseline; the class says where the point is in the text.
    void text(std::string_view css_class, const glm::dvec2& at_mm, std::string_view text, std::string_view extra = {});
    /// With a white seam, to be read on any ground.
    void label(std::string_view css_class, const glm::dvec2& at_mm, std::string_view text);

    /// The whole file.
    std::string finish(const glm::dvec2& size_mm, std::string_view title, std::string_view description) const;

private:
    std::string body_;
};

}  // namespace naturel
