#pragma once
#include "cli/options.h"

namespace naturel {

/// Finds sunspots and umbra zones of a scene, writes them to zones.json and, on demand, draws them: for every
/// floor a plan and its unrolled walls. A short table goes to stdout.
void find_zones(const ZonesOptions& options, Progress& progress);

}  // namespace naturel
