#include "core/sky_shape.h"
#include "core/units.h"

namespace naturel {
namespace {

/// docs/method.md eq. (Sky 1)
class UniformSky final : public SkyShape {
public:
    double luminance(const glm::dvec3&) const override { return 1.0; }
    double horizontal() const override { return pi; }
};

/// docs/method.md eq. (Sky 2): P. Moon & D. E. Spencer 1942, the CIE's traditional overcast sky.
class MoonSpencerSky final : public SkyShape {
public:
    double luminance(const glm::dvec3& direction) const override { return (1.0 + 2.0 * direction.z) / 3.0; }
    double horizontal() const override { return 7.0 * pi / 9.0; }
};

}  // namespace

std::unique_ptr<SkyShape> make_uniform_sky(const SkyDescription&, const glm::dvec3&) {
    return std::make_unique<UniformSky>();
}

std::unique_ptr<SkyShape> make_moon_spencer_sky(const SkyDescription&, const glm::dvec3&) {
    return std::make_unique<MoonSpencerSky>();
}

}  // namespace naturel
