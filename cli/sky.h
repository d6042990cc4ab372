#pragma once
#include "cli/options.h"

namespace naturel {

/// Prints zenith luminance, illuminances and sun of a sky, and writes sky.png, its dome in false colour.
void show_sky(const SkyOptions& options);

}  // namespace naturel
