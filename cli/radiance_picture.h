#pragma once
#include <string>

#include "cli/image_writer.h"
#include "core/picture.h"
#include "core/scene.h"

namespace naturel {

/// Bytes of a picture as Radiance and its tools read it (RGBE with run lengths; docs/pictures.md, "Radiance pictures"): radiance in
/// W/sr/m2, so that luminance is 179 (0.265 R + 0.670 G + 0.065 B) whatever the colour. The header has no exposure: it is 1.
std::string encode_radiance(const Picture& picture, const Primaries& primaries, const View& view, const ImageMetadata& metadata);

/// Radiance's words for a view, e.g. "-vtv -vp 0 0 1.2 -vd 0 1 0 -vu 0 0 1 -vh 60 -vv 46.8"; empty for a kind that Radiance has no word for.
std::string radiance_view(const View& view);

}  // namespace naturel
