#include "core/sky_series.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <list>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "core/aperture_light.h"
#include "core/errors.h"
#include "core/importance.h"
#include "core/light_rows.h"
#include "core/minimal_residual.h"
#include "core/parallel.h"
#include "core/patch_means.h"
#include "core/patches_under_points.h"
#include "core/sky_interpolation.h"
#include "core/sun_on_patches.h"
#include "core/wide.h"

namespace naturel {
namespace {

/// Variants that go through the rows together, each on its own.
constexpr std::size_t lane_count = 8;
using Variants = Lanes<lane_count>;

// Directions of formulas' skies, and the rays that stand for the view. Found by trial (tests/core/sky_series_test.cpp): sensors want
// their direct light within the direct tolerance, in IRC the errors of many nodes average out.
constexpr double sensor_step_rad = 1.0 * pi / 180.0, node_step_rad = 2.0 * pi / 180.0;
constexpr RaySpacing sensor_rays{.sky = 0.05, .surfaces = 0.1}, node_rays{.sky = 0.1, .surfaces = 0.2};
/// Of tables whose luminance jumps.
constexpr RaySpacing sensor_rays_of_steps{.sky = 0.02, .surfaces = 0.1}, node_rays_of_steps{.sky = 0.05, .surfaces = 0.2};

/// A set is solved forwards where it has fewer variants than columns of its importance (bands x readings) over this: one variant
/// takes the time of so many columns (16 in the test room, 22 in the furnished office).
constexpr std::size_t columns_of_a_variant = 20;

/// Sets of reflectances and glazings, and divisions of the sky, that are kept at a time.
constexpr std::size_t most_kept = 4;

double of_band(const Band3& x, std::size_t band) { return band == 0 ? x.r : band == 1 ? x.g : x.b; }
bool is_grey(const Band3& x) { return x.r == x.g && x.g == x.b; }

/// Directions in which the sky of a variant is asked for.
struct SkyDirections {
    SkyInterpolation sensors, nodes;

    explicit SkyDirections(const SkyDescription& sky)
        : sensors(sky.table ? SkyInterpolation(*sky.table, sky.north_rad) : SkyInterpolation(sensor_step_rad)),
          nodes(sky.table ? sensors : SkyInterpolation(node_step_rad)) {}

    bool is_for(const SkyDescription& sky) const {
        return sky.table ? sensors == SkyInterpolation(*sky.table, sky.north_rad) : sensors.is_of_formulas();
    }
    bool is_smooth() const { return sensors.is_smooth(); }
};

/// out[row] = sum of row x values, for dense rows of `columns` numbers.
NATUREL_WIDE void multiply(std::span<const double> rows, std::size_t columns, std::span<const Variants> values,
                           std::span<Variants> out) {
    constexpr std::size_t together = 4;  // sums that do not wait for each other
    std::size_t row = 0;
    for (; row + together <= out.size(); row += together) {
        Variants sum[together];
        for (std::size_t k = 0; k < columns; ++k) {
            for (std::size_t r = 0; r < together; ++r) {
                const double factor = rows[(row + r) * columns + k];
                for (std::size_t v = 0; v < lane_count; ++v) sum[r].v[v] += factor * values[k].v[v];
            }
        }
        for (std::size_t r = 0; r < together; ++r) out[row + r] = sum[r];
    }
    for (; row < out.size(); ++row) {
        Variants sum;
        for (std::size_t k = 0; k < columns; ++k)
            for (std::size_t v = 0; v < lane_count; ++v) sum.v[v] += rows[row * columns + k] * values[k].v[v];
        out[row] = sum;
    }
}

/// One band of one sparse row.
NATUREL_WIDE Variants multiply(const BandRows& rows, std::size_t row, std::size_t band, std::span<const Variants> values) {
    Variants sum;
    for (std::size_t e = rows.begin[row]; e < rows.begin[row + 1]; ++e) {
        const double factor = rows.value[e * rows.bands + band];
        const Variants& x = values[rows.column[e]];
        for (std::size_t v = 0; v < lane_count; ++v) sum.v[v] += factor * x.v[v];
    }
    return sum;
}

/// to[k] += factor from[k].
NATUREL_WIDE void add_scaled(double factor, std::span<const double> from, double* to) {
    for (std::size_t k = 0; k < from.size(); ++k) to[k] += factor * from[k];
}

std::vector<std::uint32_t> used_columns(std::initializer_list<const BandRows*> all, std::size_t columns) {
    std::vector<bool> used(columns, false);
    for (const BandRows* rows : all)
        for (const std::uint32_t column : rows->column) used[column] = true;
    std::vector<std::uint32_t> list;
    for (std::size_t k = 0; k < columns; ++k)
        if (used[k]) list.push_back(static_cast<std::uint32_t>(k));
    return list;
}

/// Rows of readings over the columns that matter.
struct DenseRows {
    std::vector<std::uint32_t> columns{};
    std::vector<double> value{};  ///< [band][reading][columns]
};

/// Importance of nodes times the rows of the nodes. node_importance: [node][bands][readings].
DenseRows collect_rows(const BandRows& rows, std::size_t all_columns, std::span<const double> node_importance, std::size_t readings,
                       std::size_t importance_bands, std::size_t bands) {
    DenseRows dense{.columns = used_columns({&rows}, all_columns)};
    std::vector<std::uint32_t> place(all_columns, 0);
    for (std::size_t k = 0; k < dense.columns.size(); ++k) place[dense.columns[k]] = static_cast<std::uint32_t>(k);
    const std::size_t width = dense.columns.size();
    dense.value.resize(bands * readings * width);
    constexpr std::size_t chunk = 64;  // readings, so that a column of them is a few cache lines
    const std::size_t chunks = (readings + chunk - 1) / chunk;
    parallel_for(bands * chunks, 1, [&](std::size_t task) {
        const std::size_t band = task / chunks, first = task % chunks * chunk, count = std::min(chunk, readings - first);
        std::vector<double> sums(width * count, 0.0);
        const std::size_t row_band = rows.bands == 3 ? band : 0, importance_band = importance_bands == 3 ? band : 0;
        for (std::size_t n = 0; n < rows.count(); ++n) {
            const std::span<const double> importance =
                node_importance.subspan((n * importance_bands + importance_band) * readings + first, count);
            for (std::size_t e = rows.begin[n]; e < rows.begin[n + 1]; ++e)
                add_scaled(rows.value[e * rows.bands + row_band], importance, sums.data() + place[rows.column[e]] * count);
        }
        for (std::size_t r = 0; r < count; ++r)
            for (std::size_t k = 0; k < width; ++k) dense.value[(band * readings + first + r) * width + k] = sums[k * count + r];
    });
    return dense;
}

/// What light on points is made of, for one set of glazings and one division of the sky.
struct RowsThroughGlazings {
    LightRows sensors, nodes;                      ///< nodes: of the grid, then the middles of patches of panes
    LightRows outdoor_surfaces;                    ///< lattice, then faces; empty when nothing shines on them that matters
    std::vector<std::uint32_t> sensor_directions;  ///< SkyDirections::sensors that are seen
    std::vector<std::uint32_t> node_directions;    ///< SkyDirections::nodes, the same
    std::vector<std::uint32_t> outdoor_columns;    ///< that are seen from sensors or nodes
};

bool same_transmission(const Glazing& a, const Glazing& b) {
    return a.normal_transmittance == b.normal_transmittance && a.panes == b.panes && a.angular_law == b.angular_law &&
           a.refractive_index == b.refractive_index && a.maintenance == b.maintenance && a.frame == b.frame &&
           std::ranges::equal(a.angular_table, b.angular_table, [](const AngularSample& x, const AngularSample& y) {
               return x.incidence_rad == y.incidence_rad && x.transmittance == y.transmittance;
           });
}

/// The numbers of a scene that what happens to light indoors depends on.
struct IndoorNumbers {
    std::vector<Glazing> glazings;
    std::vector<std::pair<Band3, Band3>> materials;  ///< reflectance and exitance, of indoor surfaces

    bool transmits_as(const IndoorNumbers& other) const {
        return std::ranges::equal(glazings, other.glazings, [](const Glazing& a, const Glazing& b) {
            // Whether a pane reflects decides whether the light on it is asked for.
            return same_transmission(a, b) && (largest(a.inner_reflectance) > 0.0) == (largest(b.inner_reflectance) > 0.0);
        });
    }
    bool operator==(const IndoorNumbers& other) const {
        return transmits_as(other) && materials == other.materials &&
               std::ranges::equal(glazings, other.glazings, {}, &Glazing::inner_reflectance, &Glazing::inner_reflectance);
    }
    bool glazings_are_grey() const {
        return std::ranges::all_of(glazings, [](const Glazing& glazing) {
            return is_grey(glazing.normal_transmittance) &&
                   std::ranges::all_of(glazing.angular_table, [](const AngularSample& s) { return is_grey(s.transmittance); });
        });
    }
};

bool are_grey(std::span<const PatchOptics> optics) {
    return std::ranges::all_of(optics, [](const PatchOptics& p) { return is_grey(p.reflectance) && is_grey(p.transmittance); });
}

/// A few results and what they were made from; the one used longest ago is dropped.
template <class Key, class Value>
class Kept {
public:
    /// is_for(key) -> bool
    /// make() -> pair of the key and a pointer to the value.
    template <class IsFor, class Make>
    std::shared_ptr<const Value> get(const IsFor& is_for, const Make& make) {
        const auto known = std::ranges::find_if(entries_, [&](const auto& entry) { return is_for(entry.first); });
        if (known != entries_.end()) {
            entries_.splice(entries_.begin(), entries_, known);
        } else {
            entries_.push_front(make());
            if (entries_.size() > most_kept) entries_.pop_back();
        }
        return entries_.front().second;
    }

private:
    std::list<std::pair<Key, std::shared_ptr<const Value>>> entries_;
};

}  // namespace

struct SkySeries::Implementation {
    // What sensors read of the radiosity, and after them the flux.
    struct Readings {
        std::size_t sensors = 0;  ///< indoors
        std::size_t absorbed() const { return sensors; }
        std::size_t lost() const { return sensors + 1; }
        std::size_t incoming() const { return sensors + 2; }
        std::size_t count() const { return sensors + 3; }
    };

    /// The interreflection of one set of surfaces and glazings.
    struct Interreflection {
        std::size_t bands = 1;
        Importance importance{};        ///< of direct light on patches: [patch][bands][Readings]
        std::vector<double> emitted{};  ///< [band][reading], lx or lm: from surfaces that emit
        std::vector<double> of_nodes{}; ///< [node][bands][reading]
    };
    /// What the sky and outdoor surfaces give to readings by interreflection.
    struct IndirectRows {
        std::size_t bands = 1;
        DenseRows sky{}, outdoors{};
    };
    Implementation(const Scene& base, const Building& its_building, const PatchGrid& its_grid, const Visibility& its_visibility,
                   const FormFactors& its_form_factors, std::vector<Sensor> its_sensors, const DaylightOptions& its_options,
                   Progress& progress)
        : building(its_building), grid(its_grid), visibility(its_visibility), form_factors(its_form_factors),
          sensors(std::move(its_sensors)), options(its_options), sun_on_patches(building, grid), tree(building),
          surfaces(find_outdoor_surfaces(base, building, grid)), columns(surfaces),
          rows_scene{building, grid, surfaces, tree, visibility, base.direct.tolerance} {
        for (const Sensor& sensor : sensors) {
            const bool indoors = sensor.medium == Medium::indoor_air;
            sensor_points.push_back({sensor.point, indoors ? RowPoint::Kind::indoors
                                                   : sensor.medium == Medium::outdoor_air ? RowPoint::Kind::open_air
                                                                                          : RowPoint::Kind::dark});
            reading_of_sensor.push_back(indoors ? readings.sensors++ : no_reading);
        }
        for (const Node& node : grid.nodes) {
            const bool dark = grid.follows_zones && node.umbra;
            node_points.push_back({{node.gather_position_m, building.faces[index(node.face)].normal},
                                   dark ? RowPoint::Kind::dark : RowPoint::Kind::indoors});
        }
        for (std::size_t p = grid.indoor_patch_count; p < grid.gather_patch_count; ++p)
            node_points.push_back({{grid.patches[p].centroid_m, grid.patches[p].normal}, RowPoint::Kind::indoors});
        for (const GroundLattice::Node& node : surfaces.lattice.nodes)
            surface_points.push_back({{node.position_m, {0, 0, 1}}, node.open ? RowPoint::Kind::open_air : RowPoint::Kind::dark});
        for (const OutdoorSurfaces::Node& node : surfaces.nodes) surface_points.push_back({node.point, RowPoint::Kind::open_air});
        for (std::size_t p = 0; p < grid.gather_patch_count; ++p) area_m2.push_back(grid.patches[p].area_m2);
        room_area_m2 = std::accumulate(area_m2.begin(), area_m2.end(), 0.0);
        for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) corner_weights.push_back(mean_weights(grid, make_id<PatchId>(p)));
        for (std::size_t p = 0; p < grid.indoor_patch_count; ++p)
            indoor_materials.push_back(index(building.faces[index(grid.patches[p].face)].material));
        std::ranges::sort(indoor_materials);
        indoor_materials.erase(std::unique(indoor_materials.begin(), indoor_materials.end()), indoor_materials.end());
        find_gather_rows(progress);
    }

    /// What sensors see of the patches.
    void find_gather_rows(Progress& progress) {
        gather_rows.resize(sensors.size());
        std::optional<PatchesUnderPoints> patches;
        if (options.sensor_indirect == IndirectMethod::patch) patches.emplace(building, grid);
        ThreadScratch<std::vector<std::uint32_t>> near;
        parallel_stage("gathering at sensors", sensors.size(), 2, progress, [&](std::size_t s) {
            if (sensors[s].medium != Medium::indoor_air) return;
            FormFactorRow& row = gather_rows[s];
            const PatchId under = patches ? patches->patch_under(sensors[s].point, near.local()) : PatchId::none;
            if (under != PatchId::none) {
                for (std::size_t e = form_factors.row_begin[index(under)]; e < form_factors.row_begin[index(under) + 1]; ++e) {
                    row.patches.push_back(make_id<PatchId>(form_factors.column[e]));
                    row.values.push_back(form_factors.value[e]);
                }
                return;
            }
            visibility.gather_row(sensors[s].point, row);
            if (options.form_factors.repair == FormFactorRepair::none || row.truncated >= 1.0) return;
            for (double& value : row.values) value /= 1.0 - row.truncated;
        });
        for (std::size_t s = 0; s < sensors.size(); ++s)
            if (reading_of_sensor[s] != no_reading) sensor_of_reading.push_back(s);
    }

    RowsThroughGlazings find_rows(const Scene& scene, const ApertureOutlook& apertures, const SkyDirections& sky, std::size_t bands,
                                  Progress& progress) const {
        RowsThroughGlazings rows;
        rows.sensors = find_light_rows(rows_scene, apertures, sensor_points, bands, sky.sensors,
                                       sky.is_smooth() ? sensor_rays : sensor_rays_of_steps, progress);
        std::vector<RowPoint> points = node_points;
        for (std::size_t p = grid.indoor_patch_count; p < grid.gather_patch_count; ++p) {
            // What falls on a pane that reflects nothing is of no concern.
            const Aperture& aperture = building.apertures[index(*building.faces[index(grid.patches[p].face)].aperture)];
            if (largest(scene.glazings[index(aperture.glazing)].inner_reflectance) <= 0.0)
                points[grid.nodes.size() + p - grid.indoor_patch_count].kind = RowPoint::Kind::dark;
        }
        const RaySpacing node_spacing = sky.is_smooth() ? node_rays : node_rays_of_steps;
        rows.nodes = find_light_rows(rows_scene, apertures, points, bands, sky.nodes, node_spacing, progress);
        rows.outdoor_columns = used_columns({&rows.sensors.outdoors, &rows.nodes.outdoors}, columns.size());
        const bool surfaces_seen = !rows.outdoor_columns.empty() && rows.outdoor_columns.back() != columns.open_ground();
        if (surfaces_seen)
            rows.outdoor_surfaces = find_light_rows(rows_scene, apertures, surface_points, 1, sky.nodes, node_spacing, progress);
        rows.sensor_directions = used_columns({&rows.sensors.sky}, sky.sensors.size());
        rows.node_directions = used_columns({&rows.nodes.sky, &rows.outdoor_surfaces.sky}, sky.nodes.size());
        return rows;
    }

    Interreflection find_interreflection(const Scene& scene, Progress& progress) const {
        const std::vector<PatchOptics> optics = patch_optics(scene, building, grid);
        Interreflection found{.bands = are_grey(optics) ? std::size_t{1} : std::size_t{3}};
        const std::size_t patches = grid.gather_patch_count;
        const auto kept_share = [&](std::size_t p, std::size_t band) {
            return of_band(optics[p].reflectance, band) + of_band(optics[p].transmittance, band);
        };
        const auto weights_of = [&](std::size_t reading, std::size_t band, std::span<double> out) {
            if (reading < readings.sensors) {
                const FormFactorRow& row = gather_rows[sensor_of_reading[reading]];
                for (std::size_t k = 0; k < row.patches.size(); ++k) out[index(row.patches[k])] = row.values[k];
                return;
            }
            // Flux over the area of the room, to be of the size of an illuminance.
            for (std::size_t p = 0; p < patches; ++p) {
                double row_sum = 0.0;
                for (std::size_t e = form_factors.row_begin[p]; e < form_factors.row_begin[p + 1]; ++e) {
                    row_sum += form_factors.value[e];
                    if (reading == readings.absorbed())
                        out[form_factors.column[e]] += area_m2[p] * (1.0 - kept_share(p, band)) * form_factors.value[e] / room_area_m2;
                }
                if (reading == readings.lost()) out[p] = area_m2[p] * (1.0 - row_sum) / room_area_m2;
            }
        };
        const Importance of_exitance = solve_importance(form_factors, area_m2, optics, readings.incoming(), found.bands, weights_of,
                                                        options.radiosity, progress);
        found.importance = {.readings = readings.count(), .bands = found.bands, .iterations = of_exitance.iterations,
                            .relative_residual = of_exitance.relative_residual, .converged = of_exitance.converged};
        found.importance.value.resize(patches * found.bands * readings.count());
        found.emitted.resize(3 * readings.count());
        for (std::size_t p = 0; p < patches; ++p) {
            const bool pane = p >= grid.indoor_patch_count;
            for (std::size_t band = 0; band < found.bands; ++band) {
                const double reflectance = of_band(optics[p].reflectance, band);
                double* of_light = found.importance.value.data() + (p * found.bands + band) * readings.count();
                const auto of = of_exitance.of(p, band);
                for (std::size_t r = 0; r < of.size(); ++r) {
                    const double of_one = r < readings.sensors ? of[r] : room_area_m2 * of[r];
                    of_light[r] = reflectance * of_one;
                    for (std::size_t b = 0; b < 3; ++b)
                        if (found.bands == 1 || b == band)
                            found.emitted[b * readings.count() + r] += of_one * of_band(optics[p].exitance_lm_m2.other, b);
                }
                // Light on a pane counts as far as the pane sends it back.
                of_light[readings.incoming()] = area_m2[p] * (pane ? reflectance : 1.0);
                if (!pane) of_light[readings.absorbed()] += area_m2[p] * (1.0 - kept_share(p, band));
            }
            for (std::size_t b = 0; b < 3; ++b)
                found.emitted[b * readings.count() + readings.incoming()] += area_m2[p] * of_band(optics[p].exitance_lm_m2.other, b);
        }
        const std::size_t width = found.bands * readings.count();
        found.of_nodes.resize(node_points.size() * width);
        const std::span<const double> of_patches(found.importance.value);
        for (std::size_t p = 0; p < patches; ++p) {
            const std::span<const double> of_patch = of_patches.subspan(p * width, width);
            if (p >= grid.indoor_patch_count) {
                add_scaled(1.0, of_patch, found.of_nodes.data() + (grid.nodes.size() + p - grid.indoor_patch_count) * width);
                continue;
            }
            const auto corners = grid.corners_of(make_id<PatchId>(p));
            for (std::size_t k = 0; k < corners.size(); ++k)
                add_scaled(corner_weights[p][k], of_patch, found.of_nodes.data() + index(corners[k]) * width);
        }
        return found;
    }

    IndirectRows find_indirect_rows(const RowsThroughGlazings& rows, const SkyDirections& sky, const Interreflection& inter) const {
        IndirectRows found{.bands = std::max({rows.nodes.sky.bands, rows.nodes.outdoors.bands, inter.bands})};
        found.sky = collect_rows(rows.nodes.sky, sky.nodes.size(), inter.of_nodes, readings.count(), inter.bands, found.bands);
        found.outdoors = collect_rows(rows.nodes.outdoors, columns.size(), inter.of_nodes, readings.count(), inter.bands, found.bands);
        return found;
    }

    using Glazed = std::pair<ApertureOutlook, RowsThroughGlazings>;
    using Through = std::pair<IndoorNumbers, std::shared_ptr<const SkyDirections>>;

    /// One variant on its way through a block.
    struct InWork {
        const Scene& scene;
        DaylightSolution& solution;
    };

    /// Lights the outdoor surfaces of a variant by their rows.
    /// by_sky: [row], in lux.
    void light_outdoor_surfaces(const Scene& scene, const RowsThroughGlazings& rows, std::span<const Variants> by_sky, std::size_t lane,
                                OutdoorLight& light) const {
        const BandRows& reflected = rows.outdoor_surfaces.outdoors;
        const auto at = [&](const OutdoorLight& so_far, std::size_t row) {
            OutdoorIlluminance lit;
            lit.sky_lx = by_sky[row][lane] * so_far.sky_colour;
            for (std::size_t e = reflected.begin[row]; e < reflected.begin[row + 1]; ++e)
                lit.reflected_lx += reflected.value[e] * luminance_of(so_far, reflected.column[e]);
            return lit;
        };
        const OutdoorGather gather{
            .at_lattice = [&](const OutdoorLight& so_far, std::size_t n) { return at(so_far, n); },
            .at_face = [&](const OutdoorLight& so_far, std::size_t n) { return at(so_far, columns.lattice_count() + n); }};
        NoProgress progress;
        light_surfaces(scene, building, grid, visibility, surfaces, gather, progress, light);
    }

    LightBySource luminance_of(const OutdoorLight& light, std::uint32_t column) const {
        if (column == columns.open_ground()) return light.ground_luminance_cd_m2;
        if (columns.is_ground(column)) return light.lattice_luminance_cd_m2[column - columns.lattice(0)];
        return light.corner_luminance_cd_m2[surfaces.nodes[column - columns.face(0)].corner];
    }

    /// Calls add(patch, mean_lx) with the direct light of the sun on patches, panes included where that matters.
    template <class Add>
    void for_each_sunlit(const Scene& scene, const OutdoorLight& light, const ApertureOutlook& apertures, const Add& add) const {
        const SunBeam sun{light.sun_direction, light.direct_normal_illuminance_lx, light.sun_colour};
        for (const SunOnPatches::LitPatch& lit : sun_on_patches.lit_by(scene, sun)) add(lit.patch, lit.mean_lx);
        for (std::size_t p = grid.indoor_patch_count; p < grid.gather_patch_count; ++p) {
            const Patch& patch = grid.patches[p];
            if (glm::dot(patch.normal, light.sun_direction) <= 0.0) continue;
            const Aperture& aperture = building.apertures[index(*building.faces[index(patch.face)].aperture)];
            if (largest(scene.glazings[index(aperture.glazing)].inner_reflectance) <= 0.0) continue;
            const AreaSamples samples = area_samples(grid, make_id<PatchId>(p));
            Band3 mean_lx;
            for (std::size_t k = 0; k < samples.shares.size(); ++k)
                mean_lx += samples.shares[k] *
                           sun_through_apertures({samples.positions_m[k], patch.normal}, apertures, light, visibility);
            add(make_id<PatchId>(p), mean_lx);
        }
    }

    /// What lights a block: luminance of directions, and of outdoor surfaces [band of sky's light, then of others'][column].
    struct Lights {
        std::vector<Variants> node_sky;
        std::array<std::vector<Variants>, 6> outdoor_luminance;
    };

    /// The interreflected light on sensors, from what they owe to it.
    void reflect_by_importance(std::span<InWork> block, const ApertureOutlook& apertures, const Lights& lights, const Interreflection& inter,
                               const IndirectRows& indirect) const {
        const auto& [node_sky, outdoor_luminance] = lights;
        const std::size_t reading_count = readings.count();
        std::vector<Variants> by_sky(indirect.bands * reading_count), compact;
        for (const std::uint32_t k : indirect.sky.columns) compact.push_back(node_sky[k]);
        multiply(indirect.sky.value, compact.size(), compact, by_sky);
        std::array<std::vector<Variants>, 6> by_outdoors;
        for (std::size_t channel = 0; channel < 6; ++channel) {
            by_outdoors[channel].resize(reading_count);
            compact.clear();
            for (const std::uint32_t k : indirect.outdoors.columns) compact.push_back(outdoor_luminance[channel][k]);
            const std::size_t size = reading_count * compact.size();
            multiply(std::span(indirect.outdoors.value).subspan((indirect.bands == 3 ? channel % 3 : 0) * size, size), compact.size(),
                     compact, by_outdoors[channel]);
        }
        std::vector<double> by_sun(3 * reading_count);
        for (std::size_t lane = 0; lane < block.size(); ++lane) {
            DaylightSolution& solution = block[lane].solution;
            std::copy(inter.emitted.begin(), inter.emitted.end(), by_sun.begin());
            if (solution.outdoors.direct_normal_illuminance_lx > 0.0)
                for_each_sunlit(block[lane].scene, solution.outdoors, apertures, [&](PatchId patch, const Band3& mean_lx) {
                    for (std::size_t b = 0; b < 3; ++b)
                        add_scaled(of_band(mean_lx, b), inter.importance.of(index(patch), inter.bands == 3 ? b : 0),
                                   by_sun.data() + b * reading_count);
                });
            const auto reading = [&](std::size_t r) {
                std::array<double, 3> of_sky{}, of_other{};
                for (std::size_t band = 0; band < 3; ++band) {
                    of_sky[band] = of_band(solution.outdoors.sky_colour, band) *
                                       by_sky[(indirect.bands == 3 ? band : 0) * reading_count + r][lane] +
                                   by_outdoors[band][r][lane];
                    of_other[band] = by_outdoors[3 + band][r][lane] + by_sun[band * reading_count + r];
                }
                return LightBySource{{of_sky[0], of_sky[1], of_sky[2]}, {of_other[0], of_other[1], of_other[2]}};
            };
            solution.sensor_values.resize(sensors.size());
            for (std::size_t s = 0; s < sensors.size(); ++s)
                if (reading_of_sensor[s] != no_reading) solution.sensor_values[s].indirect_lx = reading(reading_of_sensor[s]);
            solution.radiosity = {.iterations = inter.importance.iterations,
                                  .relative_residual = inter.importance.relative_residual,
                                  .converged = inter.importance.converged,
                                  .flux_in_lm = reading(readings.incoming()).total(),
                                  .flux_absorbed_lm = reading(readings.absorbed()).total(),
                                  .flux_lost_lm = reading(readings.lost()).total()};
        }
    }

    /// The same, from the direct light on patches. In parallel.
    void reflect_forwards(std::span<InWork> block, const ApertureOutlook& apertures, const Lights& lights, const RowsThroughGlazings& rows) const {
        // Direct light on nodes and panes: [channel][row].
        const std::size_t row_count = rows.nodes.sky.count();
        std::array<std::vector<Variants>, 6> on_nodes;
        for (auto& channel : on_nodes) channel.resize(row_count);
        std::vector<Band3> sky_colours;
        for (const InWork& variant : block) sky_colours.push_back(variant.solution.outdoors.sky_colour);
        parallel_for(row_count, 32, [&](std::size_t row) {
            const BandRows &sky = rows.nodes.sky, &outdoors = rows.nodes.outdoors;
            for (std::size_t band = 0; band < sky.bands; ++band) on_nodes[band][row] = multiply(sky, row, band, lights.node_sky);
            for (std::size_t band = sky.bands; band < 3; ++band) on_nodes[band][row] = on_nodes[0][row];
            for (std::size_t band = 0; band < 3; ++band)
                for (std::size_t lane = 0; lane < block.size(); ++lane) on_nodes[band][row][lane] *= of_band(sky_colours[lane], band);
            for (std::size_t channel = 0; channel < 6; ++channel) {
                const Variants reflected = multiply(outdoors, row, outdoors.bands == 3 ? channel % 3 : 0, lights.outdoor_luminance[channel]);
                for (std::size_t lane = 0; lane < lane_count; ++lane) on_nodes[channel][row][lane] += reflected[lane];
            }
        });
        const auto on_node = [&](std::size_t row, std::size_t lane) {
            const auto in = [&](std::size_t channel) { return on_nodes[channel][row][lane]; };
            return LightBySource{{in(0), in(1), in(2)}, {in(3), in(4), in(5)}};
        };
        for (std::size_t lane = 0; lane < block.size(); ++lane) {
            const Scene& scene = block[lane].scene;
            DaylightSolution& solution = block[lane].solution;
            std::vector<LightBySource> direct_lx(grid.gather_patch_count);
            for (std::size_t p = 0; p < grid.indoor_patch_count; ++p) {
                const auto corners = grid.corners_of(make_id<PatchId>(p));
                for (std::size_t k = 0; k < corners.size(); ++k) direct_lx[p] += corner_weights[p][k] * on_node(index(corners[k]), lane);
            }
            for (std::size_t p = grid.indoor_patch_count; p < grid.gather_patch_count; ++p)
                direct_lx[p] = on_node(grid.nodes.size() + p - grid.indoor_patch_count, lane);
            if (solution.outdoors.direct_normal_illuminance_lx > 0.0)
                for_each_sunlit(scene, solution.outdoors, apertures,
                                [&](PatchId patch, const Band3& mean_lx) { direct_lx[index(patch)].other += mean_lx; });
            // Panes send back some of the light on them, and the rest is lost to the room.
            std::vector<PatchOptics> optics = patch_optics(scene, building, grid);
            for (std::size_t p = grid.indoor_patch_count; p < grid.gather_patch_count; ++p) {
                optics[p].exitance_lm_m2 += optics[p].reflectance * direct_lx[p];
                direct_lx[p] = {};
            }
            NoProgress progress;
            RadiositySolution solved = solve_radiosity(form_factors, area_m2, optics, direct_lx, options.radiosity, progress);
            solution.sensor_values.resize(sensors.size());
            for (std::size_t s = 0; s < sensors.size(); ++s) {
                if (reading_of_sensor[s] == no_reading) continue;
                LightBySource& indirect_lx = solution.sensor_values[s].indirect_lx;
                for (std::size_t k = 0; k < gather_rows[s].patches.size(); ++k)
                    indirect_lx += gather_rows[s].values[k] * solved.exitance_lm_m2[index(gather_rows[s].patches[k])];
            }
            solved.exitance_lm_m2 = {}, solved.indirect_illuminance_lx = {};
            solution.radiosity = std::move(solved);
        }
    }

    /// Solves up to lane_count variants of one set of surfaces and glazings and one division of the sky.
    /// reflect(lights): finds the interreflected light on their sensors.
    template <class Reflect>
    void solve_block(std::span<InWork> block, const ApertureOutlook& apertures, const SkyDirections& sky, const RowsThroughGlazings& rows,
                     const Reflect& reflect) const {
        Lights lights{.node_sky = std::vector<Variants>(sky.nodes.size()), .outdoor_luminance = {}};
        auto& [node_sky, outdoor_luminance] = lights;
        std::vector<Variants> sensor_sky(sky.sensors.size());
        for (std::size_t lane = 0; lane < block.size(); ++lane) {
            const Sky& own = block[lane].solution.outdoors.sky;
            for (const std::uint32_t k : rows.sensor_directions) sensor_sky[k][lane] = own.luminance(sky.sensors.direction(k)).value;
            for (const std::uint32_t k : rows.node_directions) node_sky[k][lane] = own.luminance(sky.nodes.direction(k)).value;
        }
        std::vector<Variants> surface_sky(rows.outdoor_surfaces.sky.count());
        for (std::size_t n = 0; n < surface_sky.size(); ++n) surface_sky[n] = multiply(rows.outdoor_surfaces.sky, n, 0, node_sky);
        for (auto& channel : outdoor_luminance) channel.resize(columns.size());
        for (std::size_t lane = 0; lane < block.size(); ++lane) {
            OutdoorLight& light = block[lane].solution.outdoors;
            if (!surface_sky.empty()) light_outdoor_surfaces(block[lane].scene, rows, surface_sky, lane, light);
            for (const std::uint32_t column : rows.outdoor_columns) {
                const LightBySource luminance = luminance_of(light, column);
                for (std::size_t band = 0; band < 3; ++band) {
                    outdoor_luminance[band][column][lane] = of_band(luminance.sky, band);
                    outdoor_luminance[3 + band][column][lane] = of_band(luminance.other, band);
                }
            }
        }

        reflect(lights);

        // Direct light on sensors.
        for (std::size_t s = 0; s < sensors.size(); ++s) {
            if (sensors[s].medium == Medium::solid) continue;
            const LightRows& own = rows.sensors;
            std::array<Variants, 3> from_sky;
            for (std::size_t band = 0; band < own.sky.bands; ++band) from_sky[band] = multiply(own.sky, s, band, sensor_sky);
            for (std::size_t lane = 0; lane < block.size(); ++lane) {
                const OutdoorLight& light = block[lane].solution.outdoors;
                const auto in = [&](std::size_t band) { return from_sky[own.sky.bands == 3 ? band : 0][lane]; };
                DirectIlluminance& direct = block[lane].solution.sensor_values[s].direct;
                direct.sky_lx = light.sky_colour * Band3{in(0), in(1), in(2)};
                direct.sun_lx = sensors[s].medium == Medium::indoor_air
                                    ? sun_through_apertures(sensors[s].point, apertures, light, visibility)
                                    : sun_in_open_air(light, visibility, sensors[s].point);
            }
            std::array<Variants, 6> from_ground, from_buildings;
            for (std::size_t e = own.outdoors.begin[s]; e < own.outdoors.begin[s + 1]; ++e) {
                const std::uint32_t column = own.outdoors.column[e];
                auto& sums = columns.is_ground(column) ? from_ground : from_buildings;
                for (std::size_t channel = 0; channel < 6; ++channel) {
                    const double factor = own.outdoors.value[e * own.outdoors.bands + (own.outdoors.bands == 3 ? channel % 3 : 0)];
                    const Variants& luminance = outdoor_luminance[channel][column];
                    for (std::size_t v = 0; v < lane_count; ++v) sums[channel].v[v] += factor * luminance.v[v];
                }
            }
            for (std::size_t lane = 0; lane < block.size(); ++lane) {
                DirectIlluminance& direct = block[lane].solution.sensor_values[s].direct;
                const auto light = [&](const std::array<Variants, 6>& x) {
                    return LightBySource{{x[0][lane], x[1][lane], x[2][lane]}, {x[3][lane], x[4][lane], x[5][lane]}};
                };
                direct.ground_lx = light(from_ground);
                direct.outdoor_lx = light(from_ground) + light(from_buildings);
            }
        }
        // Nobody asks for the surfaces any more.
        for (const InWork& variant : block) {
            OutdoorLight& light = variant.solution.outdoors;
            light.patch_luminance_cd_m2 = {}, light.corner_luminance_cd_m2 = {}, light.lattice_luminance_cd_m2 = {};
            light.ground_lattice = {};
        }
    }

    IndoorNumbers numbers_of(const Scene& scene) const {
        IndoorNumbers numbers{.glazings = scene.glazings, .materials = {}};
        for (const std::size_t material : indoor_materials)
            numbers.materials.emplace_back(scene.materials[material].reflectance, scene.materials[material].exitance_lm_m2);
        return numbers;
    }

    /// Variants that share everything that is worked out once.
    struct Group {
        IndoorNumbers numbers;
        std::shared_ptr<const SkyDirections> sky;
        std::vector<std::size_t> variants;
    };
    std::vector<Group> groups_of(std::span<const Scene> variants) {
        std::vector<Group> groups;
        for (std::size_t k = 0; k < variants.size(); ++k) {
            const SkyDescription& sky = variants[k].sky;
            IndoorNumbers numbers = numbers_of(variants[k]);
            const auto known = std::ranges::find_if(
                groups, [&](const Group& group) { return group.numbers == numbers && group.sky->is_for(sky); });
            if (known != groups.end()) {
                known->variants.push_back(k);
                continue;
            }
            const auto directions = skies.get([&](const std::shared_ptr<const SkyDirections>& made) { return made->is_for(sky); }, [&] {
                const auto made = std::make_shared<const SkyDirections>(sky);
                return std::pair{made, made};
            });
            groups.push_back({std::move(numbers), directions, {k}});
        }
        return groups;
    }

    bool is_solved_forwards(const Scene& scene, std::size_t alike) const {
        const std::size_t bands = are_grey(patch_optics(scene, building, grid)) ? 1 : 3;
        return std::min(alike, readings.count()) * columns_of_a_variant < bands * readings.count();
    }

    /// alike: how many variants of its set there are in all.
    void solve_group(const Group& group, std::size_t alike, std::span<const Scene> variants,
                     std::vector<std::optional<DaylightSolution>>& solutions, Progress& progress) {
        const Scene& one = variants[group.variants.front()];
        const Through through{group.numbers, group.sky};
        const auto glazed = glazings.get([&](const Through& made) { return made.first.transmits_as(group.numbers) && made.second == group.sky; },
                                         [&] {
                                             ApertureOutlook outlook(one, building);
                                             RowsThroughGlazings rows = find_rows(one, outlook, *group.sky,
                                                                                  group.numbers.glazings_are_grey() ? 1 : 3, progress);
                                             return std::pair{through, std::make_shared<const Glazed>(std::move(outlook), std::move(rows))};
                                         });
        const auto& [apertures, rows] = *glazed;
        if (is_solved_forwards(one, alike)) {
            solve_blocks(group, variants, *glazed, solutions, progress,
                         [&](std::span<InWork> block, const Lights& lights) { reflect_forwards(block, apertures, lights, rows); });
            return;
        }
        const auto inter = interreflections.get([&](const IndoorNumbers& made) { return made == group.numbers; }, [&] {
            return std::pair{group.numbers, std::make_shared<const Interreflection>(find_interreflection(one, progress))};
        });
        const auto indirect = indirect_rows.get(
            [&](const Through& made) { return made.first == group.numbers && made.second == group.sky; },
            [&] {
                return std::pair{through, std::make_shared<const IndirectRows>(find_indirect_rows(glazed->second, *group.sky, *inter))};
            });
        solve_blocks(group, variants, *glazed, solutions, progress, [&](std::span<InWork> block, const Lights& lights) {
            reflect_by_importance(block, apertures, lights, *inter, *indirect);
        });
    }

    /// reflect(block, lights)
    template <class Reflect>
    void solve_blocks(const Group& group, std::span<const Scene> variants, const Glazed& glazed,
                      std::vector<std::optional<DaylightSolution>>& solutions, Progress& progress, const Reflect& reflect) {
        const std::size_t blocks = (group.variants.size() + lane_count - 1) / lane_count;
        parallel_stage("skies", blocks, 1, progress, [&](std::size_t block) {
            std::vector<InWork> work;
            for (std::size_t k = block * lane_count; k < std::min(group.variants.size(), (block + 1) * lane_count); ++k) {
                const std::size_t variant = group.variants[k];
                solutions[variant].emplace(DaylightSolution{.outdoors = outdoor_sources(variants[variant])});
                solutions[variant]->sensors = sensors;
                solutions[variant]->form_factor_quality = form_factors.quality;
                work.push_back({variants[variant], *solutions[variant]});
            }
            solve_block(work, glazed.first, *group.sky, glazed.second, [&](const Lights& lights) { reflect(work, lights); });
        });
    }

    std::vector<DaylightSolution> solve(std::span<const Scene> variants, std::span<const std::size_t> alike, Progress& progress) {
        std::vector<std::optional<DaylightSolution>> solutions(variants.size());
        for (const Group& group : groups_of(variants)) solve_group(group, alike[group.variants.front()], variants, solutions, progress);
        std::vector<DaylightSolution> answers;
        for (std::optional<DaylightSolution>& solution : solutions) answers.push_back(std::move(*solution));
        return answers;
    }

    static constexpr std::size_t no_reading = ~std::size_t{0};

    const Building& building;
    const PatchGrid& grid;
    const Visibility& visibility;
    const FormFactors& form_factors;
    std::vector<Sensor> sensors;
    DaylightOptions options;
    SunOnPatches sun_on_patches;
    FacetTree tree;
    OutdoorSurfaces surfaces;
    OutdoorColumns columns;
    RowScene rows_scene;
    std::vector<RowPoint> sensor_points, node_points, surface_points;
    std::vector<std::size_t> reading_of_sensor;  ///< [sensors]; no_reading: not indoors
    std::vector<std::size_t> sensor_of_reading;
    Readings readings;
    std::vector<FormFactorRow> gather_rows;  ///< [sensors]
    std::vector<double> area_m2;             ///< [gather_patch_count]
    double room_area_m2 = 0.0;
    std::vector<std::vector<double>> corner_weights;  ///< [indoor patch][corner]
    std::vector<std::size_t> indoor_materials;        ///< of patches that exchange light

    Kept<std::shared_ptr<const SkyDirections>, SkyDirections> skies;
    Kept<Through, Glazed> glazings;
    Kept<IndoorNumbers, Interreflection> interreflections;
    Kept<Through, IndirectRows> indirect_rows;
};

SkySeriesCost sky_series_cost(const Scene& scene, const PatchGrid& grid, std::size_t sensors, std::size_t sets, std::size_t alike,
                              double entries) {
    const bool grey = std::ranges::all_of(scene.materials, is_grey, &Material::reflectance) &&
                      IndoorNumbers{.glazings = scene.glazings, .materials = {}}.glazings_are_grey();
    const auto number = [](std::size_t n) { return static_cast<double>(n); };
    const std::size_t columns = (grey ? 1 : 3) * (sensors + 3);
    const double patches = number(grid.gather_patch_count), points = number(grid.nodes.size()) + patches;
    const double directions = 2.0 * pi / (node_step_rad * node_step_rad);
    // Points see a tenth of all directions, rather less; those of sensors are four times as dense.
    const double rows = number(grid.nodes.size() + 4 * sensors);
    SkySeriesCost cost{.bytes = 0.1 * directions * (grey ? 12.0 : 28.0) * rows, .set_seconds = 4e-4 * rows};
    if (std::min(alike, columns) * columns_of_a_variant < columns) {
        cost.variant_seconds = number(columns_of_a_variant) * 2.5e-9 * entries;
        return cost;
    }
    // While a set is made, its importance exists as exitance, too.
    cost.bytes += 8.0 * number(columns) * (number(std::min(sets, most_kept + 1)) * (points + directions) + patches);
    cost.set_seconds += number(columns) * (2.5e-9 * entries + 2.5e-7 * points);
    return cost;
}

SkySeries::SkySeries(const Scene& scene, const Building& building, const PatchGrid& grid, const Visibility& visibility,
                     const FormFactors& form_factors, std::vector<Sensor> sensors, const DaylightOptions& options, Progress& progress)
    : implementation_(new Implementation(scene, building, grid, visibility, form_factors, std::move(sensors), options, progress)) {}

SkySeries::~SkySeries() = default;

std::vector<DaylightSolution> SkySeries::solve(std::span<const Scene> variants, Progress& progress) {
    return solve(variants, std::vector<std::size_t>(variants.size(), ~std::size_t{0}), progress);
}

std::vector<DaylightSolution> SkySeries::solve(std::span<const Scene> variants, std::span<const std::size_t> alike, Progress& progress) {
    NATUREL_EXPECT(alike.size() == variants.size());
    return implementation_->solve(variants, alike, progress);
}

}  // namespace naturel
