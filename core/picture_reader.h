#pragma once
#include "core/picture_options.h"
#include "core/scene_values.h"

namespace naturel {

/// How a picture is shown, "picture" of a scene or of a view. Keys that are absent leave `options` as they are.
void read_picture(const JsonValue& value, PictureOptions& options);

/// Values that make sense for a way to expose.
Range exposure_range(ExposureMode mode);

}  // namespace naturel
