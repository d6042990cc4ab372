#include "core/glare.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "core/errors.h"

namespace naturel {
namespace {

using glm::dvec3;

constexpr double largest_position_index = 16.0;

enum class Brightness : std::uint8_t { none, source, peak };

}  // namespace

double simplified_glare_probability(Illuminance at_eye) { return std::min(1.0, 6.22e-5 * at_eye.value + 0.184); }

double position_index(const dvec3& direction, const dvec3& forward, const dvec3& up) {
    const dvec3 right = glm::cross(forward, up);
    const double ahead = glm::dot(direction, forward), above = glm::dot(direction, up), aside = glm::dot(direction, right);
    if (above < 0.0) {
        // Iwata & Tokura 1997, as evalglare has it: distances on a plane across the line of sight, in its distance.
        constexpr double near = 0.6, farthest = 3.0;
        const double r = ahead > 0.0 ? std::min(farthest, std::hypot(above, aside) / ahead) : farthest;
        return std::min(largest_position_index, 1.0 + (r > near ? 1.2 : 0.8) * r);
    }
    // Levin 1975 for Guth's tables: tau from the vertical through the line of sight, sigma from the line of sight, both in degrees.
    const double tau = degrees_from_radians(std::atan2(std::abs(aside), above));
    const double sigma = degrees_from_radians(std::atan2(std::hypot(above, aside), ahead));
    const double logarithm = (35.2 - 0.31889 * tau - 1.22 * std::exp(-2.0 * tau / 9.0)) * 1e-3 * sigma +
                             (21.0 + 0.26667 * tau - 0.002963 * tau * tau) * 1e-5 * sigma * sigma;
    return std::min(largest_position_index, std::exp(logarithm));
}

std::vector<GlareSource> find_glare_sources(std::span<const double> luminance_cd_m2, const Camera& camera, Luminance threshold,
                                            Luminance peak) {
    const int width = camera.width, height = camera.height;
    NATUREL_EXPECT(luminance_cd_m2.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const auto number = [&](int column, int row) { return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column); };
    std::vector<Brightness> left(luminance_cd_m2.size(), Brightness::none);
    for (std::size_t k = 0; k < left.size(); ++k)
        if (luminance_cd_m2[k] > 0.0 && luminance_cd_m2[k] >= threshold.value)
            left[k] = luminance_cd_m2[k] >= peak.value ? Brightness::peak : Brightness::source;

    std::vector<GlareSource> sources;
    std::vector<std::pair<int, int>> open;
    for (int first_row = 0; first_row < height; ++first_row) {
        for (int first_column = 0; first_column < width; ++first_column) {
            const Brightness kind = left[number(first_column, first_row)];
            if (kind == Brightness::none) continue;
            dvec3 light{};
            double flux = 0.0, solid_angle_sr = 0.0;
            const auto take = [&](int column, int row) {
                left[number(column, row)] = Brightness::none;
                open.emplace_back(column, row);
            };
            take(first_column, first_row);
            while (!open.empty()) {
                const auto [column, row] = open.back();
                open.pop_back();
                const double pixel_sr = pixel_solid_angle_sr(camera, column, row);
                const double pixel_flux = luminance_cd_m2[number(column, row)] * pixel_sr;
                light += pixel_flux * camera.ray(column + 0.5, row + 0.5).direction;
                flux += pixel_flux;
                solid_angle_sr += pixel_sr;
                for (int j = std::max(0, row - 1); j <= std::min(height - 1, row + 1); ++j)
                    for (int i = std::max(0, column - 1); i <= std::min(width - 1, column + 1); ++i)
                        if (left[number(i, j)] == kind) take(i, j);
            }
            // Light beyond the rim of a fisheye has no solid angle.
            if (!(flux > 0.0)) continue;
            const dvec3 direction = glm::normalize(light);
            sources.push_back({direction, solid_angle_sr, flux / solid_angle_sr, position_index(direction, camera.forward, camera.up)});
        }
    }
    return sources;
}

double glare_probability(Illuminance at_eye, std::span<const GlareSource> sources) {
    if (!(at_eye.value > 0.0)) return 0.0;
    double sum = 0.0;
    for (const GlareSource& source : sources)
        sum += source.luminance_cd_m2 * source.luminance_cd_m2 * source.solid_angle_sr /
               (std::pow(at_eye.value, 1.87) * source.position_index * source.position_index);
    return std::min(1.0, 5.87e-5 * at_eye.value + 0.0918 * std::log10(1.0 + sum) + 0.16);
}

Illuminance illuminance_of_picture(std::span<const double> luminance_cd_m2, const Camera& camera) {
    NATUREL_EXPECT(luminance_cd_m2.size() == static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    double sum_lx = 0.0;
    for (int row = 0; row < camera.height; ++row) {
        for (int column = 0; column < camera.width; ++column) {
            const double luminance = luminance_cd_m2[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(column)];
            if (!(luminance > 0.0)) continue;
            sum_lx += luminance * std::max(0.0, glm::dot(camera.ray(column + 0.5, row + 0.5).direction, camera.forward)) *
                      pixel_solid_angle_sr(camera, column, row);
        }
    }
    return {sum_lx};
}

}  // namespace naturel
