#pragma once
#include <string>
#include <string_view>

#include "cli/result.h"

namespace naturel {

// Tables as comma-separated text: one header line, "\n" at line ends, '.' as decimal mark, nine significant
// digits. Photometric columns are Primaries::luminous() of the bands. A number that is not finite is an
// internal fault.

/// One row per sensor, in the order of the scene; the last column tells what it is in. Values inside a solid stay empty.
std::string sensors_csv(const Result& result);
std::string nodes_csv(const Result& result);    ///< one row per node of the indoor grid
std::string patches_csv(
    const Result& result);  ///< one row per patch that exchanges light indoors, apertures included

/// "solid", "indoor_air" or "outdoor_air".
std::string_view medium_word(Medium medium);

}  // namespace naturel
