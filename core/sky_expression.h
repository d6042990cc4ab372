#pragma once
#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace naturel {

/// An expression that cannot be read. position: of the offending character, from 1.
struct ExpressionError : std::runtime_error {
    ExpressionError(std::size_t at, const std::string& text) : std::runtime_error(text), position(at) {}
    std::size_t position;
};

/// Luminance as the user's formula: "1 + 2*sin(altitude)". Angles in radians, azimuths from true north.
class SkyExpression {
public:
    static constexpr std::array<std::string_view, 6> variables{"altitude", "zenith_angle", "azimuth",
                                                               "chi",      "sun_altitude", "sun_azimuth"};
    static constexpr std::size_t longest = 2000;

    /// sun: unit, y towards true north. Throws ExpressionError.
    SkyExpression(const std::string& text, const glm::dvec3& sun);
    ~SkyExpression();

    /// direction: unit, z >= 0, y towards true north. May be negative or not finite: see expression_fault(). Thread-safe.
    double luminance(const glm::dvec3& direction) const;

    /// Whether the formula names chi or the sun.
    bool depends_on_sun() const;

private:
    struct Parsers;
    std::unique_ptr<Parsers> parsers_;
};

/// Where the expression is negative or not finite, in words; empty if nowhere on a grid of 1 x 2 degrees. Throws ExpressionError.
std::string expression_fault(const SkyExpression& expression);

}  // namespace naturel
