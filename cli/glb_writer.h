#pragma once
#include <string>

#include "cli/surface_mesh.h"

namespace naturel {

/// Bytes of a binary glTF 2.0 file: every face an object under "indoor", "windows" or "outdoor", unlit, y up. Colours are what
/// the eye sees (exposed as pictures are, indoors and outdoors each by itself), attributes hold the values (docs/report.md).
std::string scene_glb(const Result& result, const SurfaceMesh& mesh);

}  // namespace naturel
