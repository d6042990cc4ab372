#include "cli/page_template.h"

#include <nlohmann/json.hpp>

#include "cli/json_text.h"

namespace naturel {

std::string script_text(const nlohmann::ordered_json& json) {
    const std::string text = json_line(json);
    std::string safe;
    safe.reserve(text.size());
    for (const char c : text) {
        if (c == '<')
            safe += "\\u003c";
        else
            safe += c;
    }
    return safe;
}

std::string fill_template(std::string_view page, const std::map<std::string_view, std::string_view>& values) {
    std::string filled;
    for (std::size_t at = 0;;) {
        const std::size_t begin = page.find('@', at);
        filled += page.substr(at, begin == std::string_view::npos ? begin : begin - at);
        if (begin == std::string_view::npos) return filled;
        const std::size_t end = page.find('@', begin + 1);
        const auto value = end == std::string_view::npos
                               ? values.end()
                               : values.find(page.substr(begin + 1, end - begin - 1));
        if (value == values.end()) {
            filled += '@';
            at = begin + 1;
        } else {
            filled += value->second;
            at = end + 1;
        }
    }
}

}  // namespace naturel
