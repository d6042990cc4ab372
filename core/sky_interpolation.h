#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "core/sky_description.h"
#include "core/sky_patches.h"

namespace naturel {

/// Luminance all over the sky from its values in some directions: what makes light on a point linear in numbers that are the same
/// for all points (docs/method.md, "Series of skies").
class SkyInterpolation {
public:
    /// Cubic between rows of directions a given angle apart: for skies given by formulas.
    explicit SkyInterpolation(double spacing_rad);

    /// Exactly the interpolation of a table, be its patches constant or not. Of the table only the patches count.
    SkyInterpolation(const SkyTable& table, double north_rad);

    std::size_t size() const { return directions_.size(); }
    const glm::dvec3& direction(std::size_t k) const { return directions_[k]; }  ///< unit, z >= 0
    bool is_smooth() const { return order_ != Order::constant; }
    bool is_of_formulas() const { return order_ == Order::cubic; }

    /// Whether both interpolate between the same directions in the same way.
    bool operator==(const SkyInterpolation& other) const;

    struct Stencil {
        static constexpr std::size_t most = 16;
        std::array<std::uint32_t, most> nodes;
        std::array<double, most> weights;
        std::size_t count = 0;
    };
    /// direction: unit, z >= 0.
    void find(const glm::dvec3& direction, Stencil& stencil) const;

private:
    enum class Order { constant, linear, cubic };
    SkyInterpolation(SkyPatches patches, Order order, double north_rad);
    void add_linear(const SkyRow& row, double turn, double share, Stencil& stencil) const;
    void add_cubic(const SkyRow& row, double turn, double share, Stencil& stencil) const;

    SkyPatches patches_;
    Order order_;
    double north_rad_;
    std::vector<glm::dvec3> directions_;
};

}  // namespace naturel
