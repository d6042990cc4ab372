#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace naturel {

/// Text of a result file: keys in their order, two blanks per level, lists of numbers (and lists of such
/// lists) on one line. A number that is not finite is an internal fault.
std::string json_text(const nlohmann::ordered_json& json);

/// The same data on one line without blanks and without an end of line. Names come from files; what is not UTF-8 in them is
/// replaced rather than refused after a long calculation.
std::string json_line(const nlohmann::ordered_json& json);

}  // namespace naturel
