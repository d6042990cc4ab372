#include "cli/job_group.h"

#include "cli/file_writer.h"
#include "cli/job_figures.h"
#include "cli/view_writer.h"
#include "core/errors.h"

namespace naturel {
namespace {

/// A grid that serves every sun is cut along no sunspot.
PreparedScene prepare_without_sun(const JobInput& input, const Progress& progress) {
    Scene scene = input.scene;
    scene.sun.reset();
    PreparedScene prepared = prepare_scene(std::move(scene), input.options->quality, progress);
    prepared.scene.sun = input.scene.sun;
    return prepared;
}

/// Jobs of a group draw no pictures, which would take memory.
JobInput without_views(JobInput input) {
    input.scene.views.clear();
    return input;
}

std::unique_ptr<Visibility> make_visibility(const RunOptions& options, const PreparedScene& prepared, std::size_t sensors,
                                            const FormFactorCache& cache, FormFactorMemory& memory, Progress& progress) {
    const Backend backend = backends_named(options.backend).front();
    std::unique_ptr<Visibility> visibility = backend.make(prepared.building, prepared.grid, options.backends);
    refuse_what_memory_cannot_hold(forecast(prepared.scene, prepared.building, prepared.grid, sensors, backend.name, options.backends,
                                            options.daylight.node_indirect),
                                   *visibility, prepared.grid, progress);
    return with_cache(std::move(visibility), prepared.building, prepared.grid, cache, &memory);
}

}  // namespace

JobGroup::JobGroup(const JobInput& any, const FormFactorCache& cache, FormFactorMemory& memory, Progress& progress)
    : options_(*any.options), prepared_(prepare_without_sun(without_views(any), progress)),
      sensors_(place_sensors(prepared_.scene, prepared_.building)),
      visibility_(make_visibility(options_, prepared_, sensors_.size(), cache, memory, progress)),
      form_factors_(compute_form_factors(*visibility_, prepared_.grid, options_.daylight.form_factors, progress)) {
    // The article's rules choose other elements of apertures for every sky: there is nothing to work out once.
    if (prepared_.scene.direct.method == DirectMethod::adaptive)
        series_ = std::make_unique<SkySeries>(prepared_.scene, prepared_.building, prepared_.grid, *visibility_, form_factors_, sensors_,
                                              options_.daylight, progress);
}

DaylightSolution JobGroup::solve(const Scene& variant, Progress& progress) const {
    DirectSolution direct = compute_direct_light(variant, prepared_.building, prepared_.grid, *visibility_, progress);
    DaylightSolution solution{.outdoors = direct.outdoors};
    solution.radiosity = compute_interreflection(variant, prepared_.building, prepared_.grid, form_factors_, direct,
                                                 options_.daylight.radiosity, progress);
    solution.form_factor_quality = form_factors_.quality;
    solution.repair = options_.daylight.form_factors.repair;
    solution.sensors = sensors_;
    solution.sensor_values = light_on_sensors(variant, prepared_.building, prepared_.grid, *visibility_, solution.outdoors,
                                              solution.radiosity, options_.daylight, sensors_, progress);
    return solution;
}

std::vector<std::string> JobGroup::records_of(const std::vector<PendingJob>& jobs, bool keep_sensors, Progress& progress) {
    std::vector<Scene> variants;
    std::vector<std::size_t> alike;
    for (const PendingJob& job : jobs) {
        alike.push_back(job.alike);
        variants.push_back(job.input.scene);
        variants.back().grid.spacing_m = prepared_.scene.grid.spacing_m;  // where the scene left it to the preset
    }
    std::vector<DaylightSolution> solutions;
    if (series_)
        solutions = series_->solve(variants, alike, progress);
    else
        for (const Scene& variant : variants) solutions.push_back(solve(variant, progress));
    std::vector<std::string> records;
    for (std::size_t k = 0; k < jobs.size(); ++k) {
        const Primaries primaries(variants[k].primaries);
        const Result result{options_, variants[k], prepared_.building, prepared_.grid, *visibility_, solutions[k], primaries, {}};
        records.push_back(done_record(jobs[k].key, result, keep_sensors));
    }
    return records;
}

std::vector<std::string> records_with_pictures(const PendingJob& job, const std::filesystem::path& pictures, const std::string& group_key,
                                               const FormFactorCache& cache, FormFactorMemory& memory, Progress& progress) {
    const RunOptions& options = *job.input.options;
    const PreparedScene prepared = prepare_scene(job.input.scene, options.quality, progress);
    std::vector<Sensor> sensors = place_sensors(prepared.scene, prepared.building);
    const std::unique_ptr<Visibility> visibility = make_visibility(options, prepared, sensors.size(), cache, memory, progress);
    const DaylightSolution solution = compute_daylight(prepared.scene, prepared.building, prepared.grid, *visibility, options.daylight,
                                                       std::move(sensors), progress);
    const Primaries primaries(prepared.scene.primaries);
    const Result result{options, prepared.scene, prepared.building, prepared.grid, *visibility, solution, primaries, {}};
    make_writable_folder(pictures);
    prepare_view_folders(prepared.scene, options.picture_files, pictures);
    for (const char* folder : {"views", "views/false_colour"}) remove_left_parts(pictures / folder);
    write_views(result, pictures, progress);
    keep_for_good(pictures);  // before a record says that they are there
    std::vector<std::string> records;
    if (!group_key.empty()) records.push_back(sensors_record(group_key, prepared.scene, solution.sensors));
    records.push_back(done_record(job.key, result, !group_key.empty()));
    return records;
}

GroupForecast forecast_group(const JobInput& any, std::size_t jobs, std::size_t sets, bool pictures, const Progress& progress) {
    JobInput plain = any;
    plain.scene.grid.zones = false;  // they take time and change little
    if (!pictures) plain.scene.views.clear();
    const PreparedScene prepared = prepare_without_sun(plain, progress);
    const std::size_t sensors = place_sensors(prepared.scene, prepared.building).size();
    const Forecast f = forecast(prepared.scene, prepared.building, prepared.grid, sensors, any.options->backend,
                                any.options->backends, any.options->daylight.node_indirect);
    GroupForecast group{.patches = prepared.grid.gather_patch_count, .sensors = sensors, .bytes = f.peak_bytes(),
                        .kept_bytes = f.kept_row_bytes, .form_factor_seconds = f.form_factor_seconds};
    if (pictures) {
        group.job_seconds = f.gather_seconds + f.direct_seconds + f.picture_seconds;
        group.process_seconds = f.picture_writer_seconds;
        return group;
    }
    // Measured: docs/batch.md.
    group.job_seconds = 4e-6 * static_cast<double>(group.patches);
    if (prepared.scene.direct.method == DirectMethod::article) {
        group.job_seconds += f.direct_seconds + f.gather_seconds + 2.5e-8 * f.usual_entries;
        return group;
    }
    const SkySeriesCost series = sky_series_cost(prepared.scene, prepared.grid, sensors, sets, jobs / std::max<std::size_t>(sets, 1), f.usual_entries);
    group.bytes += series.bytes;
    group.first_seconds = f.gather_seconds;
    group.set_seconds = series.set_seconds;
    group.job_seconds += series.variant_seconds;
    return group;
}

}  // namespace naturel
