#pragma once
#include "core/outdoors.h"

namespace naturel {

/// Sky, sun and open ground: what shines before buildings are lit.
OutdoorLight outdoor_sources(const Scene& scene);

}  // namespace naturel
