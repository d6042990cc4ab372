#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/direct_integrators.h"
#include "core/spherical_polygon.h"

namespace naturel {
namespace {

// Solid angles of an aperture at which the article goes from 16 to 64 and from 64 to 256 aperture elements.
constexpr double limit_16_sr = 0.7;
constexpr double limit_64_sr = 1.5;

/// An aperture nearer than this many element sizes is integrated over sky zones instead. The article does not say when it
/// changes over; solid angle cannot tell, since it falls again close to the plane of the aperture, where the
/// elements fail (docs/method.md, "Direct illuminance").
constexpr double near_sizes = 2.0;

/// The article's sky zones: "256 zones seen under the same solid angle (0,00237 sr)". 256 equal zones of a hemisphere
/// are 2 pi / 256 = 0.0245 sr each, which is what we take: 16 bands uniform in sin(altitude) x 16 azimuths.
constexpr int zone_bands = 16;
constexpr int zone_azimuths = 16;
constexpr double zone_sr = 2.0 * pi / (zone_bands * zone_azimuths);

using ApertureElement = ArticleElements::ApertureElement;
using Division = ArticleElements::Division;

/// The parallelogram with the directions of a face's frame that just encloses what is left of the face, and whether
/// the face is the half of it: its frame's triangle, uncut.
struct Enclosure {
    glm::dvec3 origin_m{}, u_m{}, v_m{};
    bool triangle = false;
};

Enclosure enclosure_of(const Face& face, const Opening::Part* /*unused*/ = nullptr);

}  // namespace
}  // namespace naturel
