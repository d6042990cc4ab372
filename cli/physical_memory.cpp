#include "cli/physical_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

namespace naturel {
namespace {

/// The smallest memory.max from the group of this process up to the root (cgroup v2, Linux admin guide); `all` without any.
double control_group_bytes(double all) {
    std::ifstream groups("/proc/self/cgroup");
    std::string line;
    while (std::getline(groups, line)) {
        if (!line.starts_with("0::/")) continue;
        const std::filesystem::path root = "/sys/fs/cgroup";
        std::filesystem::path folder = root / line.substr(4);
        while (true) {
            double limit = 0.0;
            if (std::ifstream(folder / "memory.max") >> limit) all = std::min(all, limit);  // "max" is no number
            if (folder == root || !folder.has_relative_path()) break;
            folder = folder.parent_path();
        }
    }
    return all;
}

}  // namespace

double physical_memory_bytes() {
    return control_group_bytes(static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE)));
}

double peak_memory_bytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * static_cast<double>(usage.ru_maxrss);  // Linux counts kibibytes
}

}  // namespace naturel
