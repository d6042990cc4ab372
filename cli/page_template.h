#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace naturel {

/// JSON that may stand in a script element: without "<" there is no end tag and no comment in it. Bytes that are no UTF-8 become
/// the replacement character: a page must come out whatever a name holds.
std::string script_text(const nlohmann::ordered_json& json);

/// The template with its @NAME@ marks replaced; what takes their place is not looked at again.
std::string fill_template(std::string_view page, const std::map<std::string_view, std::string_view>& values);

}  // namespace naturel
