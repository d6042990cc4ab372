#include "cli/machine_description.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <string_view>

#include "cli/physical_memory.h"

namespace naturel {
namespace {

std::string first_line(const std::filesystem::path& file) {
    std::string line;
    std::ifstream stream(file);
    std::getline(stream, line);
    return line;
}

std::optional<double> first_number(const std::filesystem::path& file) {
    double number = 0.0;
    std::ifstream stream(file);
    return stream >> number ? std::optional(number) : std::nullopt;
}

/// What follows "key : " in the first line of /proc/cpuinfo that begins with it.
std::string cpu_info(const std::filesystem::path& root, std::string_view key) {
    std::ifstream stream(root / "proc/cpuinfo");
    for (std::string line; std::getline(stream, line);) {
        const std::size_t colon = line.find(": ");
        if (colon != std::string::npos && line.starts_with(key) && line.find_first_not_of(" \t", key.size()) == colon)
            return line.substr(colon + 2);
    }
    return {};
}

bool has_word(const std::string& words, std::string_view wanted) {
    std::istringstream stream(words);
    for (std::string word; stream >> word;)
        if (word == wanted) return true;
    return false;
}

std::string widest_simd(const std::string& flags) {
    constexpr std::pair<std::string_view, std::string_view> levels[]{
        {"avx512f", "AVX-512"}, {"avx2", "AVX2"}, {"avx", "AVX"}, {"sse4_2", "SSE4.2"}, {"asimd", "NEON"}};
    for (const auto& [flag, name] : levels)
        if (has_word(flags, flag)) return std::string(name);
    return {};
}

/// The smallest of the quotas from the group of this process up to the root: cgroup v2 "cpu.max", else v1 "cpu.cfs_quota_us".
std::optional<double> quota(const std::filesystem::path& root) {
    std::optional<double> least;
    const auto take = [&](double share) {
        if (share > 0.0) least = std::min(least.value_or(share), share);
    };
    std::ifstream groups(root / "proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) {
        const std::size_t name = line.find(':'), path = line.find(':', name + 1);
        if (path == std::string::npos) continue;
        const std::string controllers = line.substr(name + 1, path - name - 1);
        const bool unified = controllers.empty();
        if (!unified && controllers != "cpu" && !controllers.starts_with("cpu,") && controllers != "cpuacct,cpu") continue;
        const std::filesystem::path top = root / "sys/fs/cgroup" / (unified ? "" : controllers);
        std::filesystem::path inner = std::filesystem::path(line.substr(path + 1)).relative_path();
        while (true) {
            const std::filesystem::path folder = top / inner;
            if (unified) {
                double granted_us = 0.0, period_us = 0.0;
                std::ifstream stream(folder / "cpu.max");
                if (stream >> granted_us >> period_us && period_us > 0.0) take(granted_us / period_us);  // "max" is no number
            } else {
                const auto granted_us = first_number(folder / "cpu.cfs_quota_us"), period_us = first_number(folder / "cpu.cfs_period_us");
                if (granted_us && period_us && *period_us > 0.0) take(*granted_us / *period_us);  // -1: no limit
            }
            if (inner.empty()) break;
            inner = inner.parent_path();
        }
    }
    return least;
}

int usable_processors() {
    cpu_set_t set;
    CPU_ZERO(&set);
    return ::sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 0;
}

}  // namespace

double MachineDescription::most_threads() const {
    double most = processors;
    if (usable_processors > 0) most = std::min(most, static_cast<double>(usable_processors));
    if (quota) most = std::min(most, *quota);
    return most;
}

MachineDescription describe_machine(const std::filesystem::path& root) {
    MachineDescription machine{.cpu = cpu_info(root, "model name"),
                               .processors = static_cast<int>(::sysconf(_SC_NPROCESSORS_ONLN)),
                               .usable_processors = usable_processors(),
                               .quota = quota(root),
                               .widest_simd = {},
                               .governor = first_line(root / "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"),
                               .clock_mhz = {},
                               .kernel = {},
                               .memory_bytes = physical_memory_bytes(),
                               .load = first_number(root / "proc/loadavg"),
                               .software = {}};
    std::string flags = cpu_info(root, "flags");
    if (flags.empty()) flags = cpu_info(root, "Features");
    machine.widest_simd = widest_simd(flags);
    machine.virtual_machine = has_word(flags, "hypervisor");
    std::istringstream clock(cpu_info(root, "cpu MHz"));
    if (double mhz = 0.0; clock >> mhz) machine.clock_mhz = mhz;
    utsname system{};
    if (::uname(&system) == 0) machine.kernel = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
    return machine;
}

std::optional<MachineTimes> machine_times(const std::filesystem::path& root) {
    // "cpu user nice system idle iowait irq softirq steal ..." in ticks; guests are part of user (man 5 proc).
    std::ifstream stream(root / "proc/stat");
    std::string name;
    double user = 0.0, nice = 0.0, system = 0.0, idle = 0.0, waiting = 0.0, irq = 0.0, soft_irq = 0.0, stolen = 0.0;
    if (!(stream >> name >> user >> nice >> system >> idle >> waiting >> irq >> soft_irq >> stolen) || name != "cpu") return {};
    if (user + system + idle <= 0.0) return {};  // a sandbox that hides its host
    const double tick_s = 1.0 / static_cast<double>(::sysconf(_SC_CLK_TCK));
    return MachineTimes{tick_s * (user + nice + system + irq + soft_irq), tick_s * stolen, tick_s * (idle + waiting)};
}

std::optional<ForeignLoad> foreign_load(const std::optional<MachineTimes>& before, const std::optional<MachineTimes>& after,
                                        double own_cpu_s) {
    if (!before || !after) return {};
    const double busy_s = after->busy_s - before->busy_s, stolen_s = after->stolen_s - before->stolen_s;
    const double all_s = busy_s + stolen_s + after->idle_s - before->idle_s;
    if (all_s <= 0.0) return {};  // shorter than a tick
    return ForeignLoad{std::max(0.0, busy_s - own_cpu_s) / all_s, std::max(0.0, stolen_s) / all_s};
}

}  // namespace naturel
