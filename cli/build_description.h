#pragma once
#include <string>
#include <utility>
#include <vector>

namespace naturel {

/// This program, its compiler, flags and libraries: name, version.
std::vector<std::pair<std::string, std::string>> build_description();

}  // namespace naturel
