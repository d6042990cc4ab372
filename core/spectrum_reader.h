#pragma once
#include "core/scene_values.h"
#include "core/side_files.h"
#include "core/spectrum.h"

namespace naturel {

/// A spectrum of shares in [0, 1] from a scene: a list of [wavelength_nm, value], or {"file": ..., "column": ...}, which
/// names a column of a CSV file whose first column is the wavelength. Faults in that file are reported with its name,
/// line and column.
Spectrum read_spectrum(const JsonValue& value, SideFiles& files);

}  // namespace naturel
