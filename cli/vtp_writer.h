#pragma once
#include <string>

#include "cli/surface_mesh.h"

namespace naturel {

/// Bytes of a VTK PolyData file (XML) for ParaView: indoor patches and windows as in patches.csv, their corners, the first of
/// which are those of nodes.csv, with every component of light on both (docs/report.md).
std::string scene_vtp(const Result& result, const SurfaceMesh& mesh);

}  // namespace naturel
