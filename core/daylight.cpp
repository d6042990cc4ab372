#include "core/daylight.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <optional>

#include "core/box_index.h"
#include "core/parallel.h"

namespace naturel {

namespace {

using glm::dvec3;

// Mean over a convex polygon of what is linear between its corners and the mean of the corners at its centroid: the weights
// of the corners. Parallelograms: all equal.
std::vector<double> mean_weights(std::span<const dvec3> polygon, const dvec3& centroid_m, const dvec3& normal) {
    const std::size_t n = polygon.size();
    std::vector<double> weights(n, 0.0);
    double area = 0.0, centre_weight = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const dvec3 a = polygon[i] - centroid_m, b = polygon[(i + 1) % n] - centroid_m;
        const double triangle = 0.5 * glm::dot(normal, glm::cross(a, b));
        weights[i] += triangle / 3.0;
        weights[(i + 1) % n] += triangle / 3.0;
        centre_weight += triangle / 3.0;
        area += triangle;
    }
    for (double& w : weights) w = (w + centre_weight / static_cast<double>(n)) / area;
    return weights;
}

// Points that share the area of a convex polygon, with their shares: four in each triangle of the fan round the centroid.
struct AreaSamples {
    std::vector<dvec3> positions_m;
    std::vector<double> shares;
};

AreaSamples area_samples(std::span<const dvec3> polygon, const dvec3& centroid_m, double area_m2) {
    AreaSamples samples;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec3 &a = centroid_m, &b = polygon[i], &c = polygon[(i + 1) % polygon.size()];
        const double share = 0.5 * glm::length(glm::cross(b - a, c - a)) / area_m2 / 4.0;
        const dvec3 middle = (a + b + c) / 3.0;
        for (const dvec3& p : {middle, 0.5 * (a + middle), 0.5 * (b + middle), 0.5 * (c + middle)}) {
            samples.positions_m.push_back(p);
            samples.shares.push_back(share);
        }
    }
    return samples;
}

// Direct light on the room side of a pane, sampled over the patch.
LightBySource light_on_pane(const DirectLight& direct, const PatchGrid& grid, PatchId id) {
    const Patch& patch = grid.patches[index(id)];
    const AreaSamples samples = area_samples(grid.polygon_of(id), patch.centroid_m, patch.area_m2);
    std::vector<Band3> sun_lx(samples.positions_m.size());
    direct.sun_at(samples.positions_m, patch.normal, sun_lx);
    LightBySource sum = direct.without_sun({patch.centroid_m, patch.normal}).by_source();
    for (std::size_t k = 0; k < sun_lx.size(); ++k) sum.other += samples.shares[k] * sun_lx[k];
    return sum;
}

std::vector<PatchOptics> patch_optics(const Scene& scene, const Building& building, const PatchGrid& grid) {
    std::vector<Band3> diffuse_transmittance;
    for (const Glazing& glazing : scene.glazings)
        diffuse_transmittance.push_back(GlazingTransmission(glazing).diffuse_transmittance());
    std::vector<PatchOptics> optics(grid.gather_patch_count);
    for (std::size_t p = 0; p < optics.size(); ++p) {
        const Face& face = building.faces[index(grid.patches[p].face)];
        if (!face.aperture) {
            const Material& material = scene.materials[index(face.material)];
            optics[p].reflectance = material.reflectance;
            optics[p].exitance_lm_m2.other = material.exitance_lm_m2;
            continue;
        }
        const Aperture& aperture = building.apertures[index(*face.aperture)];
        optics[p].reflectance = scene.glazings[index(aperture.glazing)].inner_reflectance;
        if (aperture.inner) {
            optics[p].transmittance = diffuse_transmittance[index(aperture.glazing)];
            optics[p].behind = grid.behind(make_id<PatchId>(p));
        }
    }
    return optics;
}

// Indirect illuminance of a point from the exitance of what it sees.
LightBySource gather(const Visibility& visibility, const GatherPoint& point, std::span<const LightBySource> exitance_lm_m2,
                     FormFactorRepair repair, FormFactorRow& row) {
    visibility.gather_row(point, row);
    return collect(row, exitance_lm_m2, repair);
}

/// Finds the patches that sensors lie on.
class PatchesUnderPoints {
public:
    PatchesUnderPoints(const Building& building, const PatchGrid& grid)
        : building_(building), grid_(grid), facets_(boxes(building)) {}

    /// None in the air. near: scratch.
    PatchId patch_under(const GatherPoint& point, std::vector<std::uint32_t>& near) const {
        facets_.containing(point.position_m, near);
        for (const std::uint32_t f : near) {
            const Facet& facet = building_.facets[f];
            if (facet.environment != Environment::indoor || facet.is_aperture) continue;
            const double height = glm::dot(point.position_m - facet.vertices_m[0], facet.normal);
            if (height < 0.0 || height > touching_m || glm::dot(point.normal, facet.normal) < 1.0 - 1e-6) continue;
            bool inside = true;
            for (std::size_t i = 0; i < facet.vertices_m.size(); ++i) {
                const dvec3 edge = facet.vertices_m[(i + 1) % facet.vertices_m.size()] - facet.vertices_m[i];
                inside = inside && glm::dot(glm::cross(facet.normal, edge), point.position_m - facet.vertices_m[i]) >= 0.0;
            }
            if (inside) return grid_.patch_at(facet.face, point.position_m);
        }
        return PatchId::none;
    }

private:
    static constexpr double touching_m = 1e-3;

    static std::vector<Box> boxes(const Building& building) {
        std::vector<Box> list;
        for (const Facet& facet : building.facets) list.push_back(box_around(facet.vertices_m, 2.0 * touching_m));
        return list;
    }

    const Building& building_;
    const PatchGrid& grid_;
    BoxIndex facets_;
};

}  // namespace

std::vector<LightBySource> mean_of_patches_at_nodes(const PatchGrid& grid, std::span<const LightBySource> patch_values) {
    std::vector<LightBySource> sums(grid.nodes.size());
    std::vector<double> areas(grid.nodes.size(), 0.0);
    for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) {
        for (const NodeId node : grid.corners_of(make_id<PatchId>(p))) {
            sums[index(node)] += grid.patches[p].area_m2 * patch_values[p];
            areas[index(node)] += grid.patches[p].area_m2;
        }
    }
    for (std::size_t n = 0; n < sums.size(); ++n) sums[n] = 1.0 / areas[n] * sums[n];
    return sums;
}

LightBySource collect(const FormFactorRow& row, std::span<const LightBySource> exitance_lm_m2, FormFactorRepair repair) {
    LightBySource sum;
    for (std::size_t k = 0; k < row.patches.size(); ++k) sum += row.values[k] * exitance_lm_m2[index(row.patches[k])];
    // As the rows of the form factors: what the method does not look at is taken to be like the rest.
    return repair == FormFactorRepair::none || row.truncated >= 1.0 ? sum : 1.0 / (1.0 - row.truncated) * sum;
}

DirectSolution compute_direct_light(const Scene& scene, const Building& building, const PatchGrid& grid,
                                    const Visibility& visibility, Progress& progress) {
    DirectSolution solution{.outdoors = light_outdoors(scene, building, grid, visibility, progress)};
    const DirectLight direct(scene, building, grid, solution.outdoors, visibility);

    solution.nodes.resize(grid.nodes.size());
    parallel_stage("direct light at nodes", grid.nodes.size(), 8, progress, [&](std::size_t n) {
        const Node& node = grid.nodes[n];
        const GatherPoint point{node.gather_position_m, building.faces[index(node.face)].normal};
        DirectIlluminance& light = solution.nodes[n];
        if (!grid.follows_zones) {
            light = direct.at(point);
        } else if (!node.umbra) {
            light = direct.without_sun(point);
            if (node.sunspot != no_sunspot) light.sun_lx = grid.sunspot_illuminance_lx[node.sunspot];
        }
    });

    // Patches: the mean of their nodes, but for the sun, whose edges run through the patches of a grid without zones.
    solution.patch_components.resize(grid.gather_patch_count);
    parallel_stage("direct light on patches", grid.indoor_patch_count, 16, progress, [&](std::size_t p) {
        const auto id = make_id<PatchId>(p);
        const Patch& patch = grid.patches[p];
        DirectIlluminance& mean = solution.patch_components[p];
        const auto corners = grid.corners_of(id);
        const std::vector<double> weights = mean_weights(grid.polygon_of(id), patch.centroid_m, patch.normal);
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const DirectIlluminance& corner = solution.nodes[index(corners[k])];
            mean.sky_lx += weights[k] * corner.sky_lx;
            mean.outdoor_lx += weights[k] * corner.outdoor_lx;
            mean.ground_lx += weights[k] * corner.ground_lx;
        }
        if (grid.follows_zones) {
            if (patch.sunspot != no_sunspot) mean.sun_lx = grid.sunspot_illuminance_lx[patch.sunspot];
        } else if (solution.outdoors.direct_normal_illuminance_lx > 0.0) {
            const AreaSamples samples = area_samples(grid.polygon_of(id), patch.centroid_m, patch.area_m2);
            std::vector<Band3> sun_lx(samples.positions_m.size());
            direct.sun_at(samples.positions_m, patch.normal, sun_lx);
            for (std::size_t k = 0; k < sun_lx.size(); ++k) mean.sun_lx += samples.shares[k] * sun_lx[k];
        }
    });
    for (const DirectIlluminance& components : solution.patch_components)
        solution.patch_direct_lx.push_back(components.by_source());

    // Panes send some of the direct light that falls on them back into the room; the rest is lost to the room, or has been
    // followed through them already.
    const std::vector<PatchOptics> optics = patch_optics(scene, building, grid);
    solution.pane_exitance_lm_m2.resize(grid.gather_patch_count - grid.indoor_patch_count);
    parallel_stage("direct light on panes", grid.gather_patch_count - grid.indoor_patch_count, 4, progress, [&](std::size_t k) {
        const std::size_t p = grid.indoor_patch_count + k;
        if (largest(optics[p].reflectance) <= 0.0) return;
        solution.pane_exitance_lm_m2[k] = optics[p].reflectance * light_on_pane(direct, grid, make_id<PatchId>(p));
    });
    return solution;
}

RadiositySolution compute_interreflection(const Scene& scene, const Building& building, const PatchGrid& grid,
                                          const FormFactors& form_factors, const DirectSolution& direct,
                                          const RadiosityOptions& options, Progress& progress) {
    std::vector<PatchOptics> optics = patch_optics(scene, building, grid);
    std::vector<double> area_m2;
    for (std::size_t p = 0; p < grid.gather_patch_count; ++p) {
        area_m2.push_back(grid.patches[p].area_m2);
        if (p >= grid.indoor_patch_count && largest(optics[p].reflectance) > 0.0)
            optics[p].exitance_lm_m2 = direct.pane_exitance_lm_m2[p - grid.indoor_patch_count];
    }
    return solve_radiosity(form_factors, area_m2, optics, direct.patch_direct_lx, options, progress);
}

std::vector<LightBySource> indirect_on_nodes(const Building& building, const PatchGrid& grid, const Visibility& visibility,
                                             const RadiositySolution& radiosity, const DaylightOptions& options,
                                             Progress& progress) {
    if (options.node_indirect == IndirectMethod::patch) return mean_of_patches_at_nodes(grid, radiosity.indirect_illuminance_lx);
    std::vector<LightBySource> indirect_lx(grid.nodes.size());
    ThreadScratch<FormFactorRow> scratch;
    parallel_stage("gathering at nodes", grid.nodes.size(), 4, progress, [&](std::size_t n) {
        const Node& node = grid.nodes[n];
        indirect_lx[n] = gather(visibility, {node.gather_position_m, building.faces[index(node.face)].normal},
                                radiosity.exitance_lm_m2, options.form_factors.repair, scratch.local());
    });
    return indirect_lx;
}

std::vector<PointIlluminance> light_on_sensors(const Scene& scene, const Building& building, const PatchGrid& grid,
                                               const Visibility& visibility, const OutdoorLight& outdoors,
                                               const RadiositySolution& radiosity, const DaylightOptions& options,
                                               std::span<const Sensor> sensors, Progress& progress) {
    const DirectLight direct(scene, building, grid, outdoors, visibility);
    const FacetTree tree(building);
    std::vector<PointIlluminance> values(sensors.size());
    std::optional<PatchesUnderPoints> patches;
    if (options.sensor_indirect == IndirectMethod::patch) patches.emplace(building, grid);
    ThreadScratch<FormFactorRow> scratch;
    ThreadScratch<std::vector<std::uint32_t>> near;
    parallel_stage("sensors", sensors.size(), 2, progress, [&](std::size_t s) {
        const Sensor& sensor = sensors[s];
        PointIlluminance& value = values[s];
        if (sensor.medium == Medium::outdoor_air) {
            const OutdoorIlluminance open = outdoor_illuminance(outdoors, building, grid, tree, visibility, sensor.point,
                                                                scene.direct.tolerance);
            value.direct = {open.sky_lx, open.sun_lx, open.reflected_lx, open.ground_lx};
        } else if (sensor.medium == Medium::indoor_air) {
            value.direct = direct.at(sensor.point);
            const PatchId under = patches ? patches->patch_under(sensor.point, near.local()) : PatchId::none;
            value.indirect_lx = under != PatchId::none ? radiosity.indirect_illuminance_lx[index(under)]
                                                       : gather(visibility, sensor.point, radiosity.exitance_lm_m2,
                                                                options.form_factors.repair, scratch.local());
        }
    });
    return values;
}

DaylightSolution compute_daylight(const Scene& scene, const Building& building, const PatchGrid& grid,
                                  const Visibility& visibility, const DaylightOptions& options, Progress& progress) {
    return compute_daylight(scene, building, grid, visibility, options, place_sensors(scene, building), progress);
}

DaylightSolution compute_daylight(const Scene& scene, const Building& building, const PatchGrid& grid,
                                  const Visibility& visibility, const DaylightOptions& options,
                                  std::vector<Sensor> sensors, Progress& progress) {
    StageClock clock;
    DirectSolution direct = compute_direct_light(scene, building, grid, visibility, progress);
    clock.end_stage("direct light");
    const FormFactors form_factors = compute_form_factors(visibility, grid, options.form_factors, progress);
    clock.end_stage("form factors");
    RadiositySolution radiosity =
        compute_interreflection(scene, building, grid, form_factors, direct, options.radiosity, progress);
    clock.end_stage("radiosity");
    const std::vector<LightBySource> indirect_lx =
        indirect_on_nodes(building, grid, visibility, radiosity, options, progress);

    DaylightSolution solution{.outdoors = std::move(direct.outdoors)};
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) solution.nodes.push_back({direct.nodes[n], indirect_lx[n]});
    clock.end_stage("nodes");
    solution.patch_direct_lx = std::move(direct.patch_direct_lx);
    solution.patch_components = std::move(direct.patch_components);
    solution.radiosity = std::move(radiosity);
    solution.form_factor_quality = form_factors.quality;
    solution.repair = options.form_factors.repair;
    solution.sensors = std::move(sensors);
    solution.sensor_values = light_on_sensors(scene, building, grid, visibility, solution.outdoors, solution.radiosity, options,
                                              solution.sensors, progress);
    clock.end_stage("sensors");
    solution.stages = std::move(clock).take();
    return solution;
}

}  // namespace naturel
