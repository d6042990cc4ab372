#pragma once
#include <string>

#include "core/scene.h"
#include "core/scene_values.h"

namespace naturel {

/// A view of a scene file. picture: how it is shown unless it says otherwise. scene: what plans and sections are fitted to.
View read_view(const JsonValue& value, const std::string& id, const PictureOptions& picture, const Scene& scene);

}  // namespace naturel
