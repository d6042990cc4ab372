#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

namespace naturel {

/// The figures of a comparison for papers, SVG in millimetres: per sensor set the budget, maps in false
/// colour and a histogram of the total illuminance, and the convergence of the sweeps. Equal input gives
/// equal bytes. comparison: content of comparison.json; a figure for which it lacks the data is left out.
/// Returns file names, each once, and contents.
std::vector<std::pair<std::string, std::string>> comparison_figures(const nlohmann::ordered_json& comparison);

}  // namespace naturel
