#pragma once
#include <glm/vec3.hpp>

// How different two colours look (docs/method.md, "Colour difference").
namespace naturel {

/// A colour of CIE 1976 L*a*b*: lightness 0 to 100 (white), towards red, towards yellow.
struct Lab {
    double L = 0.0, a = 0.0, b = 0.0;
};

/// L*a*b* to an eye that takes `white` for white. Both in the same unit; white: X, Y, Z above 0.
/// Below the knee of the cube root, straight lines with the exact constants 216/24389 and 24389/27 (ISO/CIE
/// 11664-4).
Lab lab_from_xyz(const glm::dvec3& xyz, const glm::dvec3& white);

/// CIEDE2000 colour difference, parametric factors 1; 1 is about what is just seen side by side.
/// Source: G. Sharma, W. Wu, E. N. Dalal, Color Research and Application 30 (2005) 21, with their rules for
/// the mean hue.
double colour_difference(const Lab& a, const Lab& b);

}  // namespace naturel
