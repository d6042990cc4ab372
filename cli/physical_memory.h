#pragma once

namespace naturel {

/// What this process may use, bytes, whoever uses it now: the memory of the machine, or less where a control group (a job of a
/// cluster, a container) is limited.
double physical_memory_bytes();

/// The most memory that this process has had in place at a time so far.
double peak_memory_bytes();

}  // namespace naturel
