#include "core/picture.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "core/aperture_light.h"
#include "core/parallel.h"
#include "core/view.h"

namespace naturel {

namespace {

using glm::dvec3;

// Each pixel is the mean of this many samples squared, so that edges are smooth.
constexpr int samples_per_side = 2;

class Painter {
public:
    Painter(const Scene& scene, const Building& building, const PatchGrid& grid, const DaylightSolution& solution)
        : scene_(scene),
          building_(building),
          grid_(grid),
          solution_(solution),
          apertures_(scene, building, grid, solution.outdoors) {}

    struct Sample {
        Band3 luminance_cd_m2{};
        std::optional<LightBySource> illuminance_lx{};  // of an indoor surface
    };

    // What first_seen() found along a ray, through all apertures on the way.
    Sample sample(const dvec3& from_m, const dvec3& direction, FacetId seen) const {
        double distance_m = std::numeric_limits<double>::infinity();
        Sample sample;
        Band3& luminance = sample.luminance_cd_m2;
        if (seen != FacetId::none) {
            const Facet& facet = building_.facets[index(seen)];
            const double slope = glm::dot(facet.normal, direction);
            if (slope >= 0.0) return sample;  // the back of a one-sided polygon
            distance_m = glm::dot(facet.normal, facet.vertices_m[0] - from_m) / slope;
            if (facet.environment == Environment::indoor) {
                sample.illuminance_lx = indoor_illuminance(facet, from_m + distance_m * direction);
                const Material& material = scene_.materials[index(building_.faces[index(facet.face)].material)];
                luminance = 1.0 / pi * (material.reflectance * sample.illuminance_lx->total() + material.exitance_lm_m2);
            }
        }
        const bool outdoors = seen == FacetId::none || building_.facets[index(seen)].environment == Environment::outdoor;
        if (outdoors) luminance = outdoor_luminance(solution_.outdoors, building_, grid_, from_m, direction, seen).total();
        for (const Opening& opening : apertures_.openings()) {
            const auto crossing_m = opening.crossing_m(from_m, direction);
            if (crossing_m && *crossing_m < distance_m)
                luminance = luminance * opening.glazing.transmittance(std::abs(glm::dot(opening.normal, direction)));
        }
        return sample;
    }

private:
    LightBySource indoor_illuminance(const Facet& facet, const dvec3& point_m) const {
        const PatchId patch = grid_.patch_at(facet.face, point_m);
        if (patch == PatchId::none) return {};
        const auto corners = grid_.corners_of(patch);
        std::vector<double>& weights = weights_.local();
        weights.resize(corners.size());
        grid_.interpolation_weights(patch, point_m, weights);
        LightBySource illuminance_lx;
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const PointIlluminance& node = solution_.nodes[index(corners[k])];
            illuminance_lx += weights[k] * (node.direct.by_source() + node.indirect_lx);
        }
        return illuminance_lx;
    }

    const Scene& scene_;
    const Building& building_;
    const PatchGrid& grid_;
    const DaylightSolution& solution_;
    ApertureLight apertures_;
    mutable ThreadScratch<std::vector<double>> weights_;
};

}  // namespace

Picture draw_view(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                  const DaylightSolution& solution, const View& view, Progress& progress) {
    View fine = view;
    fine.width *= samples_per_side;
    fine.height *= samples_per_side;
    const Camera camera = make_camera(fine);
    const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
    std::vector<FacetId> seen(static_cast<std::size_t>(fine.width) * static_cast<std::size_t>(fine.height));
    visibility.view_facets(fine, seen);

    const Painter painter(scene, building, grid, solution);
    Picture picture{.width = view.width, .height = view.height, .luminance_cd_m2 = std::vector<Band3>(width * height),
                    .illuminance_lx = std::vector<Band3>(width * height), .sky_illuminance_lx = std::vector<Band3>(width * height)};
    parallel_stage("picture", height, 4, progress, [&](std::size_t row) {
        for (std::size_t column = 0; column < width; ++column) {
            Band3 luminance;
            LightBySource illuminance;
            int on_surfaces = 0;
            for (std::size_t j = row * samples_per_side; j < (row + 1) * samples_per_side; ++j) {
                for (std::size_t i = column * samples_per_side; i < (column + 1) * samples_per_side; ++i) {
                    const Camera::Ray ray = camera.ray(static_cast<double>(i) + 0.5, static_cast<double>(j) + 0.5);
                    const auto sample = painter.sample(ray.origin_m, ray.direction, seen[j * width * samples_per_side + i]);
                    luminance += sample.luminance_cd_m2;
                    if (!sample.illuminance_lx) continue;
                    illuminance += *sample.illuminance_lx;
                    ++on_surfaces;
                }
            }
            const std::size_t pixel = row * width + column;
            picture.luminance_cd_m2[pixel] = 1.0 / (samples_per_side * samples_per_side) * luminance;
            const Band3 none = grey(std::numeric_limits<double>::quiet_NaN());
            picture.illuminance_lx[pixel] = on_surfaces > 0 ? 1.0 / on_surfaces * illuminance.total() : none;
            picture.sky_illuminance_lx[pixel] = on_surfaces > 0 ? 1.0 / on_surfaces * illuminance.sky : none;
        }
    });
    return picture;
}

}  // namespace naturel
