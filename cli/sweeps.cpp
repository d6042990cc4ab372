#include "cli/sweeps.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "cli/choices.h"
#include "core/light_zones.h"

namespace naturel {
namespace {

/// Two-sided 95 % of Student's t with 1 to 8 degrees of freedom (standard table).
constexpr std::array student_t{12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306};

/// Straight line through log error against log value, by least squares.
void fit_slope(Sweep& sweep) {
    std::vector<std::pair<double, double>> logs;
    for (const SweepPoint& point : sweep.points)
        if (point.value > 0.0 && point.rms_percent > 0.0) logs.emplace_back(std::log(point.value), std::log(point.rms_percent));
    const auto n = static_cast<double>(logs.size());
    if (logs.size() < 3 || logs.size() - 2 > student_t.size()) return;
    double mean_x = 0.0, mean_y = 0.0;
    for (const auto& [x, y] : logs) mean_x += x / n, mean_y += y / n;
    double xx = 0.0, xy = 0.0, yy = 0.0;
    for (const auto& [x, y] : logs) {
        xx += (x - mean_x) * (x - mean_x);
        xy += (x - mean_x) * (y - mean_y);
        yy += (y - mean_y) * (y - mean_y);
    }
    if (!(xx > 0.0)) return;
    sweep.slope = xy / xx;
    const double residual = std::max(0.0, yy - sweep.slope * xy) / (n - 2.0);
    const double reach = student_t[logs.size() - 3] * std::sqrt(residual / xx);
    sweep.slope_low = sweep.slope - reach;
    sweep.slope_high = sweep.slope + reach;
    sweep.has_slope = true;
}

void mark_pareto(std::vector<Sweep>& sweeps) {
    for (Sweep& sweep : sweeps) {
        for (SweepPoint& point : sweep.points) {
            point.pareto = std::ranges::none_of(sweeps, [&](const Sweep& other) {
                return std::ranges::any_of(other.points, [&](const SweepPoint& p) {
                    return p.seconds < point.seconds && p.rms_percent < point.rms_percent;
                });
            });
        }
    }
}

double percentile_95(std::vector<double> sizes) {
    std::ranges::sort(sizes);
    return sizes.empty() ? 0.0 : sizes[(95 * sizes.size() + 99) / 100 - 1];
}

class Sweeper {
public:
    Sweeper(const SweepRequest& request, Progress& progress)
        : request_(request), progress_(progress),
          combinations_(request.scene, request.building, request.grid, request.radiosity, progress),
          direct_(combinations_.direct(request.reference, {.method = DirectMethod::adaptive, .tolerance = request.reference_tolerance})),
          gathering_(combinations_.gathering_at_sensors(request.reference)) {
        for (std::size_t s = 0; s < combinations_.sensors().size(); ++s) {
            if (combinations_.sensors()[s].medium != Medium::indoor_air) continue;
            mean_lx_ += request.reference_state.sensors[s].total();
            ++count_;
        }
        mean_lx_ /= static_cast<double>(std::max<std::size_t>(1, count_));
    }

    SweepPoint measure(std::string label, double value, const std::function<std::unique_ptr<Visibility>()>& make) const {
        SweepPoint point{.label = std::move(label), .value = value};
        const std::unique_ptr<Visibility> visibility = make();
        std::vector<double> seconds;
        FormFactors form_factors;
        for (int k = 0; k < request_.repeats; ++k) {
            const auto start = std::chrono::steady_clock::now();
            form_factors = compute_form_factors(*visibility, request_.grid, {.repair = FormFactorRepair::none}, progress_);
            seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        std::ranges::sort(seconds);
        point.seconds = seconds[seconds.size() / 2];
        point.seconds_low = seconds.front();
        point.seconds_high = seconds.back();
        const LightState state = combinations_.state(form_factors, direct_, gathering_, IndirectMethod::patch, FormFactorRepair::none);
        std::vector<double> sizes;
        double squares = 0.0;
        for (std::size_t s = 0; s < state.sensors.size(); ++s) {
            if (combinations_.sensors()[s].medium != Medium::indoor_air) continue;
            sizes.push_back(std::abs(state.sensors[s].total() - request_.reference_state.sensors[s].total()));
            squares += sizes.back() * sizes.back();
        }
        if (sizes.empty() || !(mean_lx_ > 0.0)) return point;
        point.rms_percent = 100.0 * std::sqrt(squares / static_cast<double>(sizes.size())) / mean_lx_;
        point.percentile_95_percent = 100.0 * percentile_95(std::move(sizes)) / mean_lx_;
        return point;
    }

    SweepPoint projection(std::string label, double value, const HemicubeOptions& options) const {
        return measure(std::move(label), value, [&] { return make_hemicube_visibility(request_.building, request_.grid, options); });
    }

private:
    const SweepRequest& request_;
    Progress& progress_;
    MethodCombinations combinations_;
    MethodCombinations::Direct direct_;
    MethodCombinations::Gathering gathering_;
    double mean_lx_ = 0.0;
    std::size_t count_ = 0;
};

/// The spacing of the grid, from four times that of the scene, against half of it: rays throughout, the same at every sensor.
Sweep sweep_grid(const SweepRequest& request, Progress& progress) {
    Sweep sweep{.parameter = "grid spacing", .unit = "m", .points = {}};
    const LightZones zones = request.scene.grid.zones ? find_light_zones(request.scene, request.building) : LightZones{};
    EmbreeOptions options = request.backends.embree;
    options.form_factors = FormFactorMethod::hemisphere;
    options.rays_per_patch = 4096;
    options.rays_per_point = 32768;
    std::vector<LightState> states;
    std::vector<Sensor> sensors;
    for (const double factor : {4.0, 2.0, 1.0, 0.5}) {
        Scene scene = request.scene;
        scene.grid.spacing_m *= factor;
        const PatchGrid grid = make_patch_grid(request.building, scene.grid, zones);
        const auto visibility = request.rays.make(request.building, grid, {.hemicube = {}, .embree = options});
        const MethodCombinations combinations(scene, request.building, grid, request.radiosity, progress);
        sensors = combinations.sensors();
        SweepPoint point{.label = fmt::format("{:g}", scene.grid.spacing_m), .value = scene.grid.spacing_m};
        FormFactors form_factors;
        std::vector<double> seconds;
        for (int k = 0; k < request.repeats; ++k) {
            const auto start = std::chrono::steady_clock::now();
            form_factors = compute_form_factors(*visibility, grid, {.repair = FormFactorRepair::reciprocal}, progress);
            seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        std::ranges::sort(seconds);
        point.seconds = seconds[seconds.size() / 2];
        point.seconds_low = seconds.front();
        point.seconds_high = seconds.back();
        states.push_back(combinations.state(
            form_factors, combinations.direct(*visibility, {.method = DirectMethod::adaptive, .tolerance = request.reference_tolerance}),
            combinations.gathering_at_sensors(*visibility), IndirectMethod::patch, FormFactorRepair::reciprocal));
        sweep.points.push_back(point);
    }
    sweep.points.pop_back();  // the finest is the truth of the others
    const LightState& finest = states.back();
    for (std::size_t k = 0; k < sweep.points.size(); ++k) {
        std::vector<double> sizes;
        double squares = 0.0, mean_lx = 0.0;
        for (std::size_t s = 0; s < sensors.size(); ++s) {
            if (sensors[s].medium != Medium::indoor_air) continue;
            sizes.push_back(std::abs(states[k].sensors[s].total() - finest.sensors[s].total()));
            squares += sizes.back() * sizes.back();
            mean_lx += finest.sensors[s].total();
        }
        if (sizes.empty() || !(mean_lx > 0.0)) continue;
        const auto n = static_cast<double>(sizes.size());
        sweep.points[k].rms_percent = 100.0 * std::sqrt(squares / n) * n / mean_lx;
        sweep.points[k].percentile_95_percent = 100.0 * percentile_95(std::move(sizes)) * n / mean_lx;
    }
    return sweep;
}

}  // namespace

std::vector<Sweep> run_sweeps(const SweepRequest& request, Progress& progress) {
    const Sweeper sweeper(request, progress);
    const HemicubeOptions& own = request.backends.hemicube;
    std::vector<Sweep> sweeps;

    Sweep cells{.parameter = "cells", .unit = "along a side", .points = {}};
    for (const int resolution : {32, 64, 128, 256, 512}) {
        HemicubeOptions options = own;
        options.resolution = resolution;
        cells.points.push_back(sweeper.projection(std::to_string(resolution), resolution, options));
    }
    sweeps.push_back(cells);

    if (own.surface == ProjectionSurface::single_plane) {
        Sweep size{.parameter = "d/h", .unit = "half side over height", .points = {}};
        for (const double ratio : {1.0, 3.0, 7.0, 14.0, 28.0}) {
            HemicubeOptions options = own;
            options.half_side_over_height = ratio;
            size.points.push_back(sweeper.projection(fmt::format("{:g}", ratio), ratio, options));
        }
        sweeps.push_back(size);
        Sweep spacing{.parameter = "spacing", .unit = "of the cells", .points = {}};
        double number = 1.0;
        for (const auto& choice : cell_spacings) {
            HemicubeOptions options = own;
            options.spacing = choice.value;
            spacing.points.push_back(sweeper.projection(std::string(choice.name), number++, options));
        }
        sweeps.push_back(spacing);
    }

    Sweep viewpoints{.parameter = "viewpoints", .unit = "of a patch", .points = {}};
    for (const int count : {1, 4, 16}) {
        HemicubeOptions options = own;
        options.viewpoints = count;
        viewpoints.points.push_back(sweeper.projection(std::to_string(count), count, options));
    }
    sweeps.push_back(viewpoints);

    Sweep rays{.parameter = "rays", .unit = "per patch", .points = {}};
    for (const int count : {256, 1024, 4096, 16384}) {
        EmbreeOptions options = request.backends.embree;
        options.form_factors = FormFactorMethod::hemisphere;
        options.rays_per_patch = count;
        options.seed += 17;  // none of those of the reference
        rays.points.push_back(sweeper.measure(std::to_string(count), count, [&] {
            return request.rays.make(request.building, request.grid, {.hemicube = {}, .embree = options});
        }));
    }
    sweeps.push_back(rays);
    // Half the spacing means four times the patches, and up to sixteen times the pairs of them.
    constexpr std::size_t most_patches = 12000;
    if (request.grid.gather_patch_count <= most_patches) sweeps.push_back(sweep_grid(request, progress));

    for (Sweep& sweep : sweeps)
        if (sweep.parameter != "spacing") fit_slope(sweep);
    mark_pareto(sweeps);
    return sweeps;
}

}  // namespace naturel
