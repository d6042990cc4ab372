#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace naturel {

/// A page that shows a study of times in any browser: HTML with data, plots and script in one file that loads nothing.
/// timing: content of timing.json.
std::string timing_report(const nlohmann::ordered_json& timing);

}  // namespace naturel
