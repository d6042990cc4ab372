#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/comparison.h"

namespace naturel {

/// Everything a comparison found, as comparison.json has it and the report shows it.
nlohmann::ordered_json comparison_json(const Comparison& comparison);

/// Tidy tables, one observation per row: file name and text (docs/comparison.md, "Files").
std::vector<std::pair<std::string, std::string>> comparison_tables(const Comparison& comparison);

}  // namespace naturel
