#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace naturel {

/// What a time depends on besides the program. What cannot be read is empty.
struct MachineDescription {
    std::string cpu;                ///< model name
    int processors = 0;             ///< that the system has online
    int usable_processors = 0;      ///< that this process may run on (affinity)
    std::optional<double> quota;    ///< processors' worth of time that the control group grants
    std::string widest_simd;        ///< of the processor: "AVX-512", "AVX2", "SSE4.2" or empty
    std::string governor;           ///< of the clock frequency of the first processor
    std::optional<double> clock_mhz;  ///< of the first processor, at this moment
    bool virtual_machine = false;
    std::string kernel;
    double memory_bytes = 0.0;
    std::optional<double> load;     ///< mean number of running tasks over the last minute
    std::vector<std::pair<std::string, std::string>> software;  ///< compiler, flags, libraries: name, version

    /// Threads that can run at the same time.
    double most_threads() const;
};

/// root: where "proc" and "sys" are.
MachineDescription describe_machine(const std::filesystem::path& root = "/");

/// Processor time of the whole machine since it was started, s.
struct MachineTimes {
    double busy_s = 0.0;    ///< of all processes
    double stolen_s = 0.0;  ///< that the host of a virtual machine gave to others
    double idle_s = 0.0;
};
/// None where /proc/stat tells nothing.
std::optional<MachineTimes> machine_times(const std::filesystem::path& root = "/");

/// What others took of the processors while something ran, as shares of all processor time.
struct ForeignLoad {
    double others = 0.0, stolen = 0.0;
};
/// own_cpu_s: what was measured used itself.
std::optional<ForeignLoad> foreign_load(const std::optional<MachineTimes>& before, const std::optional<MachineTimes>& after,
                                        double own_cpu_s);

}  // namespace naturel
