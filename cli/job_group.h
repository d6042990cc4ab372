#pragma once
#include <memory>
#include <string>
#include <vector>

#include "cli/form_factor_cache.h"
#include "cli/forecast.h"
#include "cli/prepared_scene.h"
#include "cli/study_jobs.h"
#include "core/sky_series.h"

namespace naturel {

/// A job about to be computed.
struct PendingJob {
    std::string key;
    JobInput input;
    std::size_t alike = 0;  ///< jobs of the study with the same set, see SkySeries::solve()
};

/// What the jobs of a group share: assembly, grid, visibility, form factors, and all that SkySeries works out once.
class JobGroup {
public:
    /// any: one of the jobs. Throws InputError and Interrupted.
    JobGroup(const JobInput& any, const FormFactorCache& cache, FormFactorMemory& memory, Progress& progress);

    const Scene& scene() const { return prepared_.scene; }
    const std::vector<Sensor>& sensors() const { return sensors_; }

    /// The records of jobs, one after the other; the same bytes however jobs are put together. Throws Interrupted.
    std::vector<std::string> records_of(const std::vector<PendingJob>& jobs, bool keep_sensors, Progress& progress);

private:
    /// A job by the article's direct light.
    DaylightSolution solve(const Scene& variant, Progress& progress) const;

    const RunOptions& options_;
    PreparedScene prepared_;
    std::vector<Sensor> sensors_;
    std::unique_ptr<Visibility> visibility_;
    FormFactors form_factors_;
    std::unique_ptr<SkySeries> series_{};  ///< of adaptive direct light
};

/// The records of a job that keeps pictures: computed as `naturel run` would, with a grid cut along its own sunspots. The views are
/// written below `pictures`. group_key: of the sensors, whose record comes first; empty where they are not kept.
std::vector<std::string> records_with_pictures(const PendingJob& job, const std::filesystem::path& pictures, const std::string& group_key,
                                               const FormFactorCache& cache, FormFactorMemory& memory, Progress& progress);

/// What a group will take.
struct GroupForecast {
    std::size_t patches = 0, sensors = 0;
    double bytes = 0.0;
    double kept_bytes = 0.0;     ///< of form factors that wait for another group
    double process_seconds = 0.0;      ///< CPU time, once for all groups
    double form_factor_seconds = 0.0;  ///< other groups may share them
    double first_seconds = 0.0;  ///< more of it before there is any job
    double set_seconds = 0.0;    ///< before the first job of each set of reflectances, glazings and divisions of the sky
    double job_seconds = 0.0;    ///< of each job
};
/// jobs, sets: how many it has.
GroupForecast forecast_group(const JobInput& any, std::size_t jobs, std::size_t sets, bool pictures, const Progress& progress);

}  // namespace naturel
