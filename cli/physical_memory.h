#pragma once
#include <unistd.h>

namespace naturel {

/// What the machine has, bytes, whoever uses it now.
inline double physical_memory_bytes() {
    return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

}  // namespace naturel
