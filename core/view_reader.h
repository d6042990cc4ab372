#pragma once
#include <string>

#include "core/scene.h"
#include "core/scene_values.h"

namespace naturel {

/// Of one picture: 81 bytes per pixel while it is drawn (three colours of three bands, a share, a surface and a kind), about 140 while it is encoded.
inline constexpr double most_megapixels = 64.0;
inline constexpr int most_pixels_per_side = 16384;

/// A view of a scene file. scene: what plans and sections are fitted to, and how pictures are shown that do not say otherwise.
View read_view(const JsonValue& value, const std::string& id, const Scene& scene);

}  // namespace naturel
