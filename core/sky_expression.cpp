#include "core/sky_expression.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/sky_about_sun.h"
#include "core/parallel.h"
#include "core/sky_shape.h"
#include "core/sun.h"

namespace naturel {
namespace {

using glm::dvec3;

double bounded_acos(double c) { return std::acos(std::clamp(c, -1.0, 1.0)); }

/// muParser assigns to variables with a single "=": a formula has no use for that.
void refuse_assignment(const std::string& text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '=') continue;
        const bool after = i > 0 && std::string_view("=<>!").find(text[i - 1]) != std::string_view::npos;
        const bool before = i + 1 < text.size() && text[i + 1] == '=';
        if (!after && !before) throw ExpressionError(i + 1, "a formula cannot assign (== compares)");
    }
}

/// A parser with variables of its own.
struct Formula {
    Formula(const std::string& text, const dvec3& sun) {
        values[4] = std::asin(std::clamp(sun.z, -1.0, 1.0));
        values[5] = std::atan2(sun.x, sun.y);
        if (values[5] < 0.0) values[5] += 2.0 * pi;
        parser.ClearConst();
        parser.DefineConst("pi", pi);
        for (std::size_t k = 0; k < values.size(); ++k)
            parser.DefineVar(std::string(SkyExpression::variables[k]), &values[k]);
        parser.SetExpr(text);
    }
    Formula(const Formula&) = delete;
    Formula& operator=(const Formula&) = delete;

    mu::Parser parser;
    std::array<double, 6> values{};
};

ExpressionError translated(const mu::ParserError& error) {
    const int at = error.GetPos();
    std::string text = error.GetMsg();
    while (!text.empty() && (text.back() == '.' || text.back() == '\n'))
        text.pop_back();
    // The position is given in another way.
    for (const char* place : {" found at position", " at position"})
        text.resize(std::min(text.size(), text.find(place)));
    return ExpressionError(at < 0 ? 1 : static_cast<std::size_t>(at) + 1, text);
}

}  // namespace

struct SkyExpression::Parsers {
    std::string text;
    dvec3 sun;
    bool depends_on_sun = false;
    // muParser writes to its variables and its stack while it computes.
    mutable ThreadScratch<std::unique_ptr<Formula>> formulas{};
};

SkyExpression::SkyExpression(const std::string& text, const dvec3& sun)
    : parsers_(std::make_unique<Parsers>(text, sun)) {
    if (text.find_first_not_of(" \t") == std::string::npos) throw ExpressionError(1, "the formula is empty");
    if (text.size() > longest)
        throw ExpressionError(longest, fmt::format("the formula is longer than {} characters", longest));
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] < ' ' || text[i] > '~' || text[i] == '"')
            throw ExpressionError(i + 1, "this character has no place in a formula");
    }
    refuse_assignment(text);
    try {
        Formula formula(text, sun);
        formula.values[0] = 0.5 * pi;
        formula.parser.Eval();
        if (formula.parser.GetNumResults() != 1)
            throw ExpressionError(text.find(',') + 1, "the formula has several values (one is needed)");
        for (const auto& [name, unused] : formula.parser.GetUsedVar())
            parsers_->depends_on_sun |= name == "chi" || name.starts_with("sun_");
    } catch (const mu::ParserError& error) {
        throw translated(error);
    }
}

SkyExpression::~SkyExpression() = default;

bool SkyExpression::depends_on_sun() const { return parsers_->depends_on_sun; }

double SkyExpression::luminance(const dvec3& direction) const {
    std::unique_ptr<Formula>& formula = parsers_->formulas.local();
    if (!formula) formula = std::make_unique<Formula>(parsers_->text, parsers_->sun);
    std::array<double, 6>& values = formula->values;
    values[0] = std::asin(std::clamp(direction.z, -1.0, 1.0));
    values[1] = 0.5 * pi - values[0];
    values[2] = std::atan2(direction.x, direction.y);
    if (values[2] < 0.0) values[2] += 2.0 * pi;
    values[3] = bounded_acos(glm::dot(direction, parsers_->sun));
    try {
        return formula->parser.Eval();
    } catch (const mu::ParserError& error) {
        throw translated(error);
    }
}

std::string expression_fault(const SkyExpression& expression) {
    for (int altitude_deg = 90; altitude_deg >= 0; --altitude_deg) {
        for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 2) {
            const double value = expression.luminance(direction_from_angles(radians_from_degrees(altitude_deg),
                                                                            radians_from_degrees(azimuth_deg)));
            if (std::isfinite(value) && value >= 0.0 && value <= 1e12) continue;
            return fmt::format("the formula gives {:.4g} at altitude {} and azimuth {} degrees", value, altitude_deg,
                               azimuth_deg);
        }
    }
    return {};
}

namespace {

/// Into the frame in which y is true north.
dvec3 to_world(const dvec3& d, double north_rad) {
    const double c = std::cos(north_rad), s = std::sin(north_rad);
    return {d.x * c + d.y * s, d.y * c - d.x * s, d.z};
}

/// As integrate_about_sun() (core/sky_about_sun.h), but luminance may depend on every direction.
template <class Function>
double integrate_about(const dvec3& axis, const Function& luminance) {
    const QuadratureRule rule = gauss_legendre(64);
    const double cos_axis = std::hypot(axis.x, axis.y);
    // u rises from the axis towards the zenith (towards the north if the axis is the zenith), v is level.
    const dvec3 v = cos_axis > 1e-9 ? dvec3(axis.y, -axis.x, 0.0) / cos_axis : dvec3(1.0, 0.0, 0.0);
    const dvec3 u = glm::cross(v, axis);
    return integrate_half_sky_about(axis, rule, [&](double chi, double, double, double half_arc) {
        double mean = 0.0;  // of both halves together
        for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
            for (const double side : {-1.0, 1.0}) {
                const double psi = side * half_arc * rule.nodes[k];
                const dvec3 direction = std::cos(chi) * axis + std::sin(chi) * (std::cos(psi) * u + std::sin(psi) * v);
                mean += rule.weights[k] * direction.z * luminance(direction);
            }
        }
        return mean;
    });
}

class ExpressionSky final : public SkyShape {
public:
    ExpressionSky(const std::string& text, const dvec3& world_sun, double north_rad)
        : expression_(text, world_sun), cos_(std::cos(north_rad)), sin_(std::sin(north_rad)) {
        const dvec3 axis = expression_.depends_on_sun() ? world_sun : dvec3(0.0, 0.0, 1.0);
        horizontal_ = integrate_about(axis, [&](const dvec3& d) { return std::max(0.0, expression_.luminance(d)); });
    }

    double luminance(const dvec3& d) const override {
        const double value = expression_.luminance({d.x * cos_ + d.y * sin_, d.y * cos_ - d.x * sin_, d.z});
        // The check grid of the reader may have missed a spot.
        return value > 0.0 && std::isfinite(value) ? value : 0.0;
    }
    double horizontal() const override { return horizontal_; }

private:
    SkyExpression expression_;
    double cos_, sin_;
    double horizontal_ = 0.0;
};

}  // namespace

std::unique_ptr<SkyShape> make_expression_sky(const SkyDescription& description, const dvec3& sun) {
    return std::make_unique<ExpressionSky>(description.expression, to_world(sun, description.north_rad),
                                           description.north_rad);
}

}  // namespace naturel
