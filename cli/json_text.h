#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace naturel {

/// Text of a result file: keys in their order, two blanks per level, lists of numbers (and lists of such
/// lists) on one line. A number that is not finite is an internal fault.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace naturel
