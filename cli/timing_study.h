#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/machine_description.h"
#include "cli/timing_statistics.h"

namespace naturel {

/// The whole of a run, as a stage.
inline const std::string whole_run = "total";

/// What one stage of one run took, or the whole run.
struct MeasuredStage {
    std::string stage;
    double wall_s = 0.0, cpu_s = 0.0;
    int threads_that_worked = 0;
    double work = 0.0;  ///< rays, cells or pairs; 0 where it is not known
    std::string work_unit{};
};

/// strong: the same scene for every number of threads; weak: as many patches per thread.
enum class Scaling { strong, weak };

/// One run of the program.
struct MeasuredRun {
    std::string backend;
    Scaling scaling = Scaling::strong;
    int threads = 1;
    std::size_t repeat = 0;
    std::vector<MeasuredStage> stages{};  ///< in their order, last whole_run
    std::size_t patches = 0;
    double grid_spacing_m = 0.0;
    double peak_memory_bytes = 0.0;
    std::optional<ForeignLoad> load{};
    bool converged = true;
    std::map<std::string, std::string> hashes{};  ///< SHA-256 of every result by its file

    const MeasuredStage* find(const std::string& stage) const;
};

struct TimingStudy {
    std::string scene;         ///< file name
    std::string scene_sha256;
    std::string command;       ///< that asked for it
    MachineDescription machine;
    std::vector<int> threads;  ///< as asked for
    std::size_t repeats = 0;
    std::vector<MeasuredRun> runs{};
};

/// What the repeats of a stage with one number of threads say.
struct StageFigures {
    std::string backend;
    Scaling scaling = Scaling::strong;
    std::string stage;
    int threads = 1;
    std::size_t patches = 0;
    Estimate wall_s, cpu_s;
    double share = 0.0;  ///< of the wall time of the whole run
    std::string work_unit{};
    Estimate work_per_s{};
    int fewest_threads_that_worked = 0;
    double peak_memory_bytes = 0.0;  ///< median
    // Beside the least number of threads; empty for it.
    std::optional<Estimate> speed_up;         ///< wall time; weak scaling: of as many patches per thread, at best 1
    std::optional<Estimate> efficiency;       ///< speed-up per thread; weak scaling: the speed-up
    std::optional<Estimate> cpu_ratio;        ///< processor time; 1 where threads cost nothing
    std::optional<Estimate> karp_flatt;       ///< serial fraction; strong scaling from one thread
};

/// Amdahl's serial fraction over all numbers of threads of strong scaling.
struct SerialFraction {
    std::string backend;
    std::string stage;
    Estimate fraction;
};

struct TimingFigures {
    std::vector<StageFigures> stages;
    std::vector<SerialFraction> serial;
    std::vector<std::string> warnings;  ///< why the figures may not be trusted
};
/// The runs of a backend have the same stages, and as many repeats with every number of threads.
TimingFigures timing_figures(const TimingStudy& study);

/// The first file that differs between the results of two runs, and how; empty when they are the same to the last bit.
std::string first_difference(const MeasuredRun& a, const MeasuredRun& b);

}  // namespace naturel
