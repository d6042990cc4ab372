#pragma once
#include <string>
#include <vector>

namespace naturel {

/// A file name for each id, without an ending: the id without what could leave the folder or upset a shell or another file
/// system. Different ids get different names, also where upper and lower case are the same.
std::vector<std::string> file_stems(const std::vector<std::string>& ids);

}  // namespace naturel
