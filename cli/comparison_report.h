#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace naturel {

/// What a comparison finds, in two or three sentences: total error, largest ingredient, the reference's own
/// error. Of the sensor set with most points. comparison: content of comparison.json; what it lacks is not
/// spoken of.
std::string comparison_headline(const nlohmann::ordered_json& comparison);

/// A page that shows a comparison in any browser: HTML with data, plots and script in one file that loads
/// nothing. comparison: content of comparison.json; what it lacks is left out.
std::string comparison_report(const nlohmann::ordered_json& comparison);

}  // namespace naturel
