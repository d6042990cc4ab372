#include "core/colour_difference.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/units.h"

namespace naturel {
namespace {

constexpr double degree = pi / 180.0;

double square(double x) {
    return x * x;
}

/// sqrt(C^7 / (C^7 + 25^7)): how saturated a chroma is, 0 to 1.
double saturation(double chroma) {
    const double power = std::pow(chroma, 7.0);
    return std::sqrt(power / (power + 6103515625.0));
}

/// Angle of (a, b) in [0, 2 pi); 0 for a grey.
double hue_rad(double a, double b) {
    if (a == 0.0 && b == 0.0) return 0.0;
    const double angle = std::atan2(b, a);
    return angle < 0.0 ? angle + 2.0 * pi : angle;
}

}  // namespace

Lab lab_from_xyz(const glm::dvec3& xyz, const glm::dvec3& white) {
    NATUREL_EXPECT(white.x > 0.0 && white.y > 0.0 && white.z > 0.0);
    // docs/method.md eq. (Colour 10) and (Colour 11).
    const auto f = [](double t) {
        return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0;
    };
    const double fx = f(xyz.x / white.x), fy = f(xyz.y / white.y), fz = f(xyz.z / white.z);
    return {116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)};
}

double colour_difference(const Lab& first, const Lab& second) {
    // docs/method.md eq. (Colour 12) to (Colour 16); the paper's equation numbers in brackets.
    const double g =  // [4]
        0.5 * (1.0 - saturation(0.5 * (std::hypot(first.a, first.b) + std::hypot(second.a, second.b))));
    const double a1 = (1.0 + g) * first.a, a2 = (1.0 + g) * second.a;  // [5]
    const double c1 = std::hypot(a1, first.b), c2 = std::hypot(a2, second.b);
    const double h1 = hue_rad(a1, first.b), h2 = hue_rad(a2, second.b);

    // The shorter way around [10], and the mean hue on that way [14]; greys have no hue.
    double hue_step = 0.0, mean_hue = h1 + h2;
    if (c1 * c2 != 0.0) {
        hue_step = h2 - h1;
        mean_hue = 0.5 * (h1 + h2);
        if (std::abs(hue_step) > pi) {
            hue_step += hue_step > 0.0 ? -2.0 * pi : 2.0 * pi;
            mean_hue += mean_hue < pi ? pi : -pi;
        }
    }
    const double mean_l = 0.5 * (first.L + second.L), mean_c = 0.5 * (c1 + c2);

    const double t = 1.0 - 0.17 * std::cos(mean_hue - 30.0 * degree) + 0.24 * std::cos(2.0 * mean_hue) +
                     0.32 * std::cos(3.0 * mean_hue + 6.0 * degree) -
                     0.20 * std::cos(4.0 * mean_hue - 63.0 * degree);  // [15]
    const double from_50 = square(mean_l - 50.0);
    const double scale_l = 1.0 + 0.015 * from_50 / std::sqrt(20.0 + from_50);                   // [18]
    const double scale_c = 1.0 + 0.045 * mean_c;                                                // [19]
    const double scale_h = 1.0 + 0.015 * mean_c * t;                                            // [20]
    const double turn = 60.0 * degree * std::exp(-square((mean_hue / degree - 275.0) / 25.0));  // 2 [16]
    const double rotation = -2.0 * saturation(mean_c) * std::sin(turn);                         // [21]

    const double l = (second.L - first.L) / scale_l;
    const double c = (c2 - c1) / scale_c;
    const double h = 2.0 * std::sqrt(c1 * c2) * std::sin(0.5 * hue_step) / scale_h;  // [11]
    return std::sqrt(std::max(0.0, l * l + c * c + h * h + rotation * c * h));       // [22]
}

}  // namespace naturel
